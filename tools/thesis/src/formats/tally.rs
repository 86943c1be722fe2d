//! Counts numbers by size, and by their error in a 16-bit format.

use std::collections::BTreeMap;

use crate::deviation::share;
use crate::narrow::NarrowFormat;

/// Numbers below this count as small; the smallest number of thesis16 is 2^-15 = 3.05e-5.
const SMALL: f32 = 3e-5;
/// Largest error with which a number counts as the same.
const ONE_PERCENT: f64 = 0.01;

/// The errors of a format.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Loss {
    numbers: u64,
    zeros: u64,
    /// Numbers outside the format's range.
    pub(crate) refused: u64,
    relative_sum: f64,
    under: u64,
    pub(crate) largest_absolute: f64,
}

impl Loss {
    pub(crate) fn of<'a>(format: NarrowFormat, values: impl Iterator<Item = &'a f32>) -> Self {
        let mut loss = Self::default();
        for &value in values {
            loss.numbers += 1;
            let Some(back) = format.round_trip(value) else {
                loss.refused += 1;
                continue;
            };
            let error = (f64::from(back) - f64::from(value)).abs();
            if error > loss.largest_absolute {
                loss.largest_absolute = error;
            }
            if value == 0.0 {
                loss.zeros += 1;
                continue;
            }
            let relative = error / f64::from(value).abs();
            loss.relative_sum += relative;
            loss.under += u64::from(relative < ONE_PERCENT);
        }
        loss
    }

    /// Numbers with a relative error.
    fn counted(&self) -> u64 {
        self.numbers - self.zeros - self.refused
    }

    /// Mean relative error.
    pub(crate) fn mean(&self) -> f64 {
        if self.counted() == 0 { 0.0 } else { self.relative_sum / self.counted() as f64 }
    }

    /// Share of the counted numbers whose error is below 1 %.
    pub(crate) fn under_share(&self) -> f64 {
        share(self.under, self.counted())
    }
}

/// The sizes of numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sizes {
    pub(crate) numbers: u64,
    pub(crate) zeros: u64,
    /// Small numbers without zeros.
    small: u64,
    pub(crate) smallest: Option<f32>,
    pub(crate) largest: Option<f32>,
    /// Numbers by their exponent of ten, without zeros.
    pub(crate) decades: BTreeMap<i32, u64>,
}

impl Sizes {
    pub(crate) fn of<'a>(values: impl Iterator<Item = &'a f32>) -> Self {
        let mut sizes = Self::default();
        for size in values.map(|value| value.abs()) {
            sizes.numbers += 1;
            if size == 0.0 {
                sizes.zeros += 1;
                continue;
            }
            sizes.small += u64::from(size < SMALL);
            if sizes.smallest.is_none_or(|smallest| size < smallest) {
                sizes.smallest = Some(size);
            }
            if sizes.largest.is_none_or(|largest| size > largest) {
                sizes.largest = Some(size);
            }
            *sizes.decades.entry(decade(size)).or_default() += 1;
        }
        sizes
    }

    /// Share of small numbers among all but zeros.
    pub(crate) fn small_share(&self) -> f64 {
        let others = self.numbers - self.zeros;
        if others == 0 { 0.0 } else { self.small as f64 / others as f64 }
    }
}

/// The printed exponent of ten of a magnitude above 0: exact where a logarithm rounds.
fn decade(size: f32) -> i32 {
    let text = format!("{size:e}");
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_counted_by_decade() {
        let sizes = Sizes::of([0.0, 1e-6, -2.9e-5, 3.1e-5, 1.0, -9.99, 10.0, 400.0].iter());
        assert_eq!((sizes.numbers, sizes.zeros, sizes.small), (8, 1, 2));
        assert!((sizes.small_share() - 2.0 / 7.0).abs() < 1e-12);
        assert_eq!((sizes.smallest, sizes.largest), (Some(1e-6), Some(400.0)));
        let decades: Vec<(i32, u64)> = sizes.decades.into_iter().collect();
        assert_eq!(decades, [(-6, 1), (-5, 2), (0, 2), (1, 1), (2, 1)]);
    }

    #[test]
    fn powers_of_ten_begin_their_decade() {
        for exponent in -37..=38 {
            let power: f32 = format!("1e{exponent}").parse().expect("a number");
            assert_eq!(decade(power), exponent);
        }
    }

    #[test]
    fn losses_leave_zeros_out_of_what_is_relative() {
        // 100.03 is read back as 100.0, 0 as 2^-15; 1e5 is refused.
        let values = [0.0, 1.0, 100.03, 1e5];
        let loss = Loss::of(NarrowFormat::Thesis16, values.iter());
        assert_eq!((loss.numbers, loss.zeros, loss.refused, loss.under), (4, 1, 1, 2));
        assert!((loss.mean() - 0.03 / 100.03 / 2.0).abs() < 1e-7, "{loss:?}");
        assert!((loss.largest_absolute - 0.03).abs() < 1e-5, "{loss:?}");
        let zero = Loss::of(NarrowFormat::Thesis16, [0.0].iter());
        assert!((zero.largest_absolute - 2.0_f64.powi(-15)).abs() < 1e-12);
        assert!((zero.under_share() - 1.0).abs() < 1e-12);
    }
}
