//! Checks all numbers of a record against their limits at once.

use crate::simd::Lanes;
use pgs_interface::record::{Beat, LANES, WORD_LANE};

/// An f32 without its sign; as a limit, it allows every word.
pub(crate) const MAGNITUDE: u32 = u32::MAX >> 1;

/// Largest magnitudes of the words of a record, as bits. The bits of magnitudes are in the order of
/// the magnitudes, and infinity and NaN are above all numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Largest<const ROWS: usize>(pub(crate) [Beat; ROWS]);

impl<const ROWS: usize> Largest<ROWS> {
    /// Limits every number to `limit`, and the last word of each row to its word of `beside`.
    pub(crate) const fn new(limit: f32, beside: [u32; ROWS]) -> Self {
        let mut rows = [Beat([limit.to_bits(); LANES]); ROWS];
        let mut row = 0;
        while row < ROWS {
            rows[row].0[WORD_LANE] = beside[row];
            row += 1;
        }
        Self(rows)
    }

    /// All bits of each lane in which a word of any row is above its limit, else none.
    #[inline(always)]
    pub(crate) fn beyond(&self, record: &[Lanes; ROWS]) -> Lanes {
        let each = record
            .iter()
            .zip(&self.0)
            .map(|(row, largest)| row.and(Lanes::all(MAGNITUDE)).above(Lanes::from(*largest)));
        each.fold(Lanes::all(0), Lanes::or)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_held_against_the_limit_of_its_own() {
        let limits = Largest::<2>::new(2.0, [MAGNITUDE, 0.5_f32.to_bits()]);
        let row = |number: f32| Lanes::new([0, 0, number.to_bits(), 0.5_f32.to_bits()]);
        let beside = |word| Lanes::new([0, 0, 0, word]);
        for (record, found) in [
            ([row(2.0), row(-2.0)], [0; LANES]),
            ([row(2.0_f32.next_up()), row(0.0)], [0, 0, u32::MAX, 0]),
            ([row(0.0), row(f32::NEG_INFINITY)], [0, 0, u32::MAX, 0]),
            ([row(f32::NAN), row(0.0)], [0, 0, u32::MAX, 0]),
            ([beside(u32::MAX), row(0.0)], [0; LANES]),
            ([row(0.0), beside((-0.75_f32).to_bits())], [0, 0, 0, u32::MAX]),
        ] {
            assert_eq!(limits.beyond(&record).words(), found);
        }
    }
}
