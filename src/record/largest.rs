//! This file finds out at once whether all numbers of many records are within their limits.

use super::used;
use crate::interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE};
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

    /// Bits where a word of any row of a record is beyond its limit, lane by lane; none if none is.
    #[inline(always)]
    pub(crate) fn beyond(&self, record: &[Lanes; ROWS]) -> Lanes {
        self.beyond_each(record).fold(Lanes::all(0), Lanes::or)
    }

    /// The same of a collision of so many contact points: what is in the others does not matter.
    ///
    /// Shape: contact points are the last rows.
    #[inline(always)]
    pub(crate) fn beyond_used(&self, record: &[Lanes; ROWS], count: u32) -> Lanes {
        let used = used(count);
        let used = |row: usize| match row.checked_sub(ROWS - CONTACT_POINTS) {
            Some(ordinal) => used[ordinal],
            None => Lanes::all(u32::MAX),
        };
        let found = (0..).zip(self.beyond_each(record)).map(|(row, found)| found.and(used(row)));
        found.fold(Lanes::all(0), Lanes::or)
    }

    /// All bits of each word that is beyond its limit, row by row.
    #[inline(always)]
    fn beyond_each<'a>(&'a self, record: &'a [Lanes; ROWS]) -> impl Iterator<Item = Lanes> + 'a {
        record
            .iter()
            .zip(&self.0)
            .map(|(row, largest)| row.and(Lanes::all(MAGNITUDE)).above(Lanes::from(*largest)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A relative record has infinity in the others.
    #[test]
    fn contact_points_that_are_not_used_are_not_held_against_a_limit() {
        let limits = Largest::<6>::new(2.0, [MAGNITUDE; 6]);
        let row = |number: f32| Lanes::new([0, number.to_bits(), 0, u32::MAX]);
        for wrong in 0..6 {
            let mut record = [row(-2.0); 6];
            record[wrong] = row(f32::INFINITY);
            for count in 0..=4 {
                // Normal and offset are always there.
                let counts = wrong < 2 + count as usize;
                let beyond = limits.beyond_used(&record, count).words();
                assert_eq!(beyond, [0, if counts { u32::MAX } else { 0 }, 0, 0], "{wrong} {count}");
            }
            assert_eq!(limits.beyond(&record).words(), [0, u32::MAX, 0, 0]);
        }
        assert_eq!(limits.beyond(&[row(2.0); 6]).words(), [0; LANES]);
    }
}
