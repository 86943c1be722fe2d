//! The figures of the thesis' fourth chapter, as recorded there.

use crate::figure::{Axis, Drawn, Series, lines};
use pgs_command::numbers::number;

/// A comparison of two sets of positions in the thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RecordedDeviation {
    /// Its place in the thesis.
    pub(crate) thesis: &'static str,
    /// The two sides of the comparison.
    pub(crate) subject: &'static str,
    /// Mean deviation (eq. 4.1): lowest and highest, the same if one is given.
    pub(crate) mean_percent: [f64; 2],
    /// Share of the positions that deviate by less than 1 %, if it is given.
    pub(crate) under_1_percent_share: Option<f64>,
}

impl RecordedDeviation {
    /// The thesis' figure in words.
    pub(crate) fn text(&self) -> String {
        let Self { thesis, subject, mean_percent: [low, high], under_1_percent_share } = self;
        let mean = if (low - high).abs() > 0.0 { format!("{low} to {high}") } else { number(*low) };
        let under = under_1_percent_share
            .map_or_else(String::new, |share| format!(", {} % under 1 %", number(share * 100.0)));
        format!("{thesis}, {subject}: mean {mean} %{under}")
    }

    /// A chart of the shares of positions that deviate by less, with the thesis' point at 1 %.
    pub(crate) fn spread(&self, mut series: Vec<Series>) -> String {
        if let Some(share) = self.under_1_percent_share.map(|share| share * 100.0) {
            let name = format!("{share:.2} % below 1 %, recorded");
            series.push(Series::new(name, Drawn::Marked, vec![(1.0, share)]));
        }
        let (x, y) = ("deviation (eq. 4.1), %", "positions that deviate by less, %");
        lines(Axis::log(x), Axis::linear(y), &series)
    }
}

/// A share as percent.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.3} %", share * 100.0)
}

/// Two runs of the demo on a GPU.
pub(crate) const TWO_GPU_RUNS: RecordedDeviation = RecordedDeviation {
    thesis: "§4.5, Figure 4.2",
    subject: "two runs on the GPU",
    mean_percent: [1.0, 3.0],
    under_1_percent_share: None,
};

/// The design in float against the GPU.
pub(crate) const FLOAT_AGAINST_GPU: RecordedDeviation = RecordedDeviation {
    thesis: "§4.6.3, Figure 4.9",
    subject: "the float design against the GPU",
    mean_percent: [2.97, 2.97],
    under_1_percent_share: Some(0.8429),
};

/// The design in half against the design in float.
pub(crate) const HALF_AGAINST_FLOAT: RecordedDeviation = RecordedDeviation {
    thesis: "§4.6.3, Figure 4.10",
    subject: "the half design against the float design",
    mean_percent: [0.06, 0.06],
    under_1_percent_share: Some(0.9964),
};

/// The input of a step in binary16 (§4.6.2, Figures 4.7 and 4.8).
pub(crate) struct RecordedInput {
    /// Magnitudes of the numbers, smallest and largest (§4.6.4).
    pub(crate) magnitudes: [f64; 2],
    /// Mean error of binary16.
    pub(crate) mean_percent: f64,
    /// Share of the numbers with an error below 1 %.
    pub(crate) under_1_percent_share: f64,
}

/// The numbers that the thesis gives its design.
pub(crate) const INPUT: RecordedInput = RecordedInput {
    magnitudes: [3.0e-5, 450.0],
    mean_percent: 0.02,
    under_1_percent_share: 0.9993,
};

/// Bits of exponent and mantissa of sixteen bits, in IEEE 754 and in the thesis' own form (Figures
/// 4.4 and 4.11).
pub(crate) const SIXTEEN_BITS: [u32; 2] = [5, 10];
/// Smallest and largest magnitude of its own form (§4.6.4).
pub(crate) const SIXTEEN_BITS_RANGE: [f64; 2] = [6.10352e-5, 512.0];

/// Most bodies alive in its sorted order (§4.7), and the share of all bodies that it prints.
pub(crate) const MOST_ALIVE: u32 = 1528;

pub(crate) const MOST_ALIVE_PERCENT: f64 = 3.85;
