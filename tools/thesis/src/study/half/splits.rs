//! Measures what sixteen bits lose by their split into exponent and mantissa (thesis §4.6.4).

use serde::Serialize;

use crate::formats::{Loss, Sizes};
use crate::narrow::{NarrowFormat, exponent, lowest_exponent};

/// Numbers of exponent bits to try; f32 has eight.
const EXPONENTS: std::ops::RangeInclusive<u32> = 3..=8;
/// Bits behind the sign.
const BITS: u32 = 15;

/// A split of sixteen bits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Split {
    /// Its name: a format of the board, or "split".
    pub(crate) format: &'static str,
    pub(crate) exponent_bits: u32,
    pub(crate) mantissa_bits: u32,
    /// Smallest magnitude with all bits of the mantissa.
    pub(crate) smallest: f64,
    /// Mean relative error of the numbers that are not 0.
    pub(crate) relative_mean_percent: f64,
    /// Share of the numbers that are not 0 with an error below 1 %.
    pub(crate) under_1_percent_share: f64,
    /// Share of the numbers that are not 0 and smaller than `smallest`.
    pub(crate) below_smallest_share: f64,
}

/// Splits of these numbers, and the formats of the board beside them.
pub(super) fn of(numbers: &[f32]) -> Vec<Split> {
    let Some(largest) = Sizes::of(numbers.iter()).largest else { return Vec::new() };
    let top = exponent(largest);
    let power = |exponent: i32| 2.0_f64.powi(exponent);
    let split = |format: NarrowFormat, exponent_bits: u32, smallest: f64| {
        let loss = Loss::of(format, numbers.iter());
        let sizes = numbers.iter().map(|number| f64::from(number.abs())).filter(|size| *size > 0.0);
        let below = sizes.clone().filter(|size| *size < smallest).count() as f64;
        Split {
            format: format.name(),
            exponent_bits,
            mantissa_bits: BITS.saturating_sub(exponent_bits),
            smallest,
            relative_mean_percent: loss.mean() * 100.0,
            under_1_percent_share: loss.under_share(),
            below_smallest_share: below / (sizes.count() as f64).max(1.0),
        }
    };
    let given = [
        split(NarrowFormat::Binary16, 5, power(-14)),
        split(NarrowFormat::Thesis16, 5, power(-15)),
        split(NarrowFormat::Thesis16Literal, 5, power(-15)),
    ];
    let tried = EXPONENTS.map(|exponent| {
        let format = NarrowFormat::Split { exponent, top };
        split(format, exponent, power(lowest_exponent(exponent, top)))
    });
    given.into_iter().chain(tried).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_bits_of_the_exponent_reach_further_and_lose_more() {
        let numbers: Vec<f32> =
            (1..2000_u16).map(|k| 0.13 * f32::from(k)).chain([1e-4, 0.0]).collect();
        let splits = of(&numbers);
        let of_bits = |bits: u32| {
            let found = splits.iter().find(|s| s.format == "split" && s.exponent_bits == bits);
            found.expect("a split").clone()
        };
        let [four, five, eight] = [4, 5, 8].map(of_bits);
        assert_eq!([four.mantissa_bits, five.mantissa_bits, eight.mantissa_bits], [11, 10, 7]);
        // 259.87 has the exponent 8: four bits reach down to 2^-7, five to 2^-23.
        assert!((four.smallest - 2.0_f64.powi(-7)).abs() < 1e-12);
        assert!((four.below_smallest_share - 1.0 / 2000.0).abs() < 1e-12);
        assert!(five.below_smallest_share < 1e-12 && eight.below_smallest_share < 1e-12);
        assert!(five.relative_mean_percent < eight.relative_mean_percent);
        assert!(five.under_1_percent_share > four.under_1_percent_share);
        assert!(of(&[0.0]).is_empty() && of(&[]).is_empty());
    }
}
