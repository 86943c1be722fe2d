//! Compares arrays bit by bit.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// The difference between an array and its expected values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Difference {
    /// Name of the expected array.
    pub(crate) array: String,
    /// Values compared.
    pub(crate) values: usize,
    /// Values that differ in any bit.
    pub(crate) differing: usize,
    /// Largest absolute difference; infinite if a value found is not a number.
    pub(crate) largest: f64,
    /// Index of the first value that differs, in the flattened array.
    pub(crate) first: Option<usize>,
}

/// An expected value is NaN, and a comparison with it would mean nothing.
#[derive(Debug, Error)]
#[error("{}: value {index} (counted through the array) is NaN, expected a number", path.display())]
pub(crate) struct NotANumber {
    path: PathBuf,
    index: usize,
}

/// Refuses expected values that are NaN.
pub(crate) fn check(path: &Path, expected: &[f32]) -> Result<(), NotANumber> {
    match expected.iter().position(|value| value.is_nan()) {
        None => Ok(()),
        Some(index) => Err(NotANumber { path: path.to_path_buf(), index }),
    }
}

/// Compares `found` with `expected`, which have the same length; `expected` holds no NaN.
pub(crate) fn compare(
    array: impl Into<String>,
    found: impl Iterator<Item = f32>,
    expected: &[f32],
) -> Difference {
    let mut difference =
        Difference { array: array.into(), values: 0, differing: 0, largest: 0.0, first: None };
    for (index, (found, expected)) in found.zip(expected).enumerate() {
        difference.values += 1;
        if found.to_bits() == expected.to_bits() {
            continue;
        }
        difference.differing += 1;
        difference.first.get_or_insert(index);
        let distance = (f64::from(found) - f64::from(*expected)).abs();
        let distance = if distance.is_nan() { f64::INFINITY } else { distance };
        if distance > difference.largest {
            difference.largest = distance;
        }
    }
    if difference.values != expected.len() {
        // Impossible with a folder whose shapes were checked; missing values count as different.
        difference.first.get_or_insert(difference.values);
        difference.differing += expected.len() - difference.values;
        difference.largest = f64::INFINITY;
    }
    difference
}

#[cfg(test)]
mod tests {
    use super::*;

    fn difference(found: &[f32], expected: &[f32]) -> (usize, f64, Option<usize>) {
        let d = compare("x", found.iter().copied(), expected);
        (d.differing, d.largest, d.first)
    }

    #[test]
    fn equal_bits_are_no_difference() {
        assert_eq!(difference(&[1.0, -0.0], &[1.0, -0.0]), (0, 0.0, None));
        assert_eq!(difference(&[], &[]), (0, 0.0, None));
    }

    #[test]
    fn the_sign_of_zero_is_a_difference() {
        assert_eq!(difference(&[1.0, -0.0], &[1.0, 0.0]), (1, 0.0, Some(1)));
    }

    #[test]
    fn the_largest_difference_and_the_first_are_found() {
        assert_eq!(difference(&[1.0, 2.0, 3.5], &[1.0, 2.25, 3.0]), (2, 0.5, Some(1)));
    }

    #[test]
    fn what_is_no_number_or_missing_differs() {
        assert_eq!(difference(&[f32::NAN], &[1.0]), (1, f64::INFINITY, Some(0)));
        assert_eq!(difference(&[1.0], &[1.0, 2.0]), (1, f64::INFINITY, Some(1)));
        check(Path::new("x"), &[1.0, f32::NAN]).expect_err("NaN");
    }
}
