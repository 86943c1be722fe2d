//! Checks, while results are read, that all their numbers are finite.

use super::result::Record;
use crate::simd::Lanes;
use pgs_interface::record::{Beat, LANES, WORD_LANE, result};

/// Accumulates whether all numbers of results are finite.
///
/// Zero times a finite number is zero. Zero times infinity or NaN is NaN, and later products keep
/// it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Finite([Lanes; result::ROWS]);

impl Finite {
    /// No results yet.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self([Lanes::all(0); result::ROWS])
    }

    /// Takes one more result.
    #[inline(always)]
    pub(crate) fn see(&mut self, rows: &[Lanes; result::ROWS]) {
        for (product, row) in self.0.iter_mut().zip(rows) {
            *product = product.times_f32(*row);
        }
    }

    /// Whether all numbers were finite.
    pub(crate) fn all(&self) -> bool {
        finite(&self.0.map(Beat::from))
    }
}

/// The lanes of a record that hold numbers. The word beside a vec3 holds none.
const NUMBERS: [[bool; LANES]; result::ROWS] = {
    let mut numbers = [[true; LANES]; result::ROWS];
    numbers[result::POSITION][WORD_LANE] = false;
    numbers[result::LINEAR][WORD_LANE] = false;
    numbers[result::ANGULAR][WORD_LANE] = false;
    numbers
};

/// Whether all numbers of this record are finite.
pub(crate) fn finite(record: &Record) -> bool {
    let mut words =
        record.iter().zip(&NUMBERS).flat_map(|(row, numbers)| row.0.iter().zip(numbers));
    words.all(|(word, number)| !number || f32::from_bits(*word).is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_found_wherever_it_is_and_nothing_else_is() {
        let numbers = [f32::MAX, f32::MIN, -0.0, f32::from_bits(1)].map(f32::to_bits);
        let good = [Beat(numbers); result::ROWS];
        let all = |records: &[Record]| {
            let mut seen = Finite::new();
            records.iter().for_each(|record| seen.see(&record.map(Lanes::from)));
            seen.all()
        };
        assert!(all(&[]) && all(&[good; 3]) && finite(&good));
        for value in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN] {
            for at in 0..16 {
                let mut record = good;
                record[at / 4].0[at % 4] = value.to_bits();
                let beside = [3, 11, 15].contains(&at);
                assert_eq!(finite(&record), beside, "{value} {at}");
                // One such record among others, or two.
                for records in [&[good, record, good][..], &[record, good, record]] {
                    assert_eq!(all(records), beside, "{value} {at}");
                }
            }
        }
    }
}
