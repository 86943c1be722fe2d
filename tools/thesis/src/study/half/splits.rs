//! Measures the loss of sixteen bits on the numbers of a step, by their form (thesis §4.6.4).

use crate::formats::{Loss, Sizes};
use crate::narrow::NarrowFormat;
use crate::table::{Cell, Table, text};

/// Bits of the exponent and of the mantissa, in each form.
pub(super) const BITS: [u32; 2] = [5, 10];

/// A form of sixteen bits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Split {
    pub(crate) format: &'static str,
    /// Smallest magnitude with all bits of the mantissa.
    pub(crate) smallest: f64,
    /// Mean relative error of the numbers that are not 0.
    pub(crate) relative_mean_percent: f64,
    /// Share of the numbers that are not 0 with an error below 1 %.
    pub(crate) under_1_percent_share: f64,
    /// Share of the numbers that are not 0 and smaller than `smallest`.
    pub(crate) below_smallest_share: f64,
}

/// The forms, on these numbers; none where all of them are 0.
pub(super) fn of(numbers: &[f32]) -> Vec<Split> {
    if Sizes::of(numbers.iter()).largest.is_none() {
        return Vec::new();
    }
    let lowest = [(NarrowFormat::Binary16, -14), (NarrowFormat::Thesis16, -15)];
    let all = lowest.into_iter().chain([(NarrowFormat::Thesis16Literal, -15)]);
    let split = |(format, lowest): (NarrowFormat, i32)| {
        let (loss, smallest) = (Loss::of(format, numbers.iter()), 2.0_f64.powi(lowest));
        let sizes = numbers.iter().map(|number| f64::from(number.abs())).filter(|size| *size > 0.0);
        let below = sizes.clone().filter(|size| *size < smallest).count() as f64;
        Split {
            format: format.name(),
            smallest,
            relative_mean_percent: loss.mean() * 100.0,
            under_1_percent_share: loss.under_share(),
            below_smallest_share: below / (sizes.count() as f64).max(1.0),
        }
    };
    all.map(split).collect()
}

/// The table of the forms.
pub(super) fn table(splits: &[Split]) -> Table {
    let mut table = Table::new("splits", "Sixteen bits, on the numbers of a step");
    for split in splits {
        let percent = |share: f64| Cell::Digits(share * 100.0);
        table.row([
            ("format", "format", text(split.format)),
            ("smallest", "smallest", Cell::Digits(split.smallest)),
            ("below_smallest_percent", "smaller\n%", percent(split.below_smallest_share)),
            ("mean_percent", "error\n% mean", Cell::Digits(split.relative_mean_percent)),
            ("under_1_percent", "error\n% < 1 %", percent(split.under_1_percent_share)),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_below_the_range_are_counted_and_lose_most() {
        let numbers: Vec<f32> =
            (1..2000_u16).map(|k| 0.13 * f32::from(k)).chain([2e-5, 0.0]).collect();
        let [binary16, thesis, literal] = &of(&numbers)[..] else { panic!("three forms") };
        for form in [binary16, thesis, literal] {
            assert!((form.below_smallest_share - 1.0 / 2000.0).abs() < 1e-12, "{form:?}");
        }
        assert!((thesis.smallest - 2.0_f64.powi(-15)).abs() < 1e-12);
        assert!(binary16.relative_mean_percent < thesis.relative_mean_percent);
        assert!(thesis.relative_mean_percent < literal.relative_mean_percent);
        assert!(of(&[0.0]).is_empty() && of(&[]).is_empty());
    }
}
