//! Sums up a measure over several runs.

/// A measure over several runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    pub(crate) mean: f64,
    /// From the mean, over n - 1; 0 for one run.
    pub(crate) standard_deviation: f64,
}

impl Spread {
    /// Sums up; none without a run.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        let count = values.len() as f64;
        let mean = (!values.is_empty()).then(|| sum(values.iter().copied()) / count)?;
        let squares = sum(values.iter().map(|value| (value - mean) * (value - mean)));
        let standard_deviation =
            if values.len() < 2 { 0.0 } else { (squares / (count - 1.0)).sqrt() };
        Some(Self { mean, standard_deviation })
    }
}

/// The sum in the order given.
fn sum(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_a_calculation_by_hand() {
        let spread = Spread::of(&[1.0, 2.0, 3.0, 6.0]).expect("four runs");
        assert!((spread.mean - 3.0).abs() < 1e-12);
        // (4 + 1 + 0 + 9) / 3
        assert!((spread.standard_deviation - (14.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        let one = Spread::of(&[5.0]).expect("one run");
        assert!((one.mean - 5.0).abs() + one.standard_deviation < 1e-12);
        assert_eq!(Spread::of(&[]), None);
    }
}
