//! This file finds out at once whether all numbers of many records are within their limits.

use crate::interface::record::{Beat, LANES, WORD_LANE};
use crate::platform::Lanes;

/// An f32 without its sign; as a limit, any word at all.
pub(crate) const MAGNITUDE: u32 = u32::MAX >> 1;

/// Largest magnitudes of the words of a record, as bits: magnitudes are in the order of their bits,
/// and infinity and NaN are beyond all numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Largest<const ROWS: usize>(pub(crate) [Beat; ROWS]);

impl<const ROWS: usize> Largest<ROWS> {
    /// Numbers of at most `limit`, but what lies beside the vec3 of these rows.
    pub(crate) const fn new(limit: f32, beside: [u32; ROWS]) -> Self {
        let mut rows = [Beat([limit.to_bits(); LANES]); ROWS];
        let mut row = 0;
        while row < ROWS {
            rows[row].0[WORD_LANE] = beside[row];
            row += 1;
        }
        Self(rows)
    }

    /// Whether all of these records are within. Without a branch per number.
    #[inline]
    pub(crate) fn bound(&self, records: &[[Beat; ROWS]]) -> bool {
        let magnitude = Lanes::all(MAGNITUDE);
        let mut beyond = Lanes::all(0);
        for record in records {
            for (beat, largest) in record.iter().zip(&self.0) {
                let found = Lanes::from(*beat).and(magnitude);
                beyond = beyond.or(found.above(Lanes::from(*largest)));
            }
        }
        beyond.words() == [0; LANES]
    }
}
