//! Figures 4.5 to 4.8: the input numbers of a step in binary32 and in binary16, and their errors.

use super::{EACH_ONCE, Loss, Numbers, Sizes};
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::narrow::NarrowFormat;
use crate::study::recorded::{INPUT, percent};
use pgs_command::numbers::grouped;

/// Bins of a decade of magnitudes.
const PER_DECADE: f64 = 4.0;
/// Powers of ten between which the charts show numbers.
const LOWEST: i32 = -9;
const HIGHEST: i32 = 3;
/// Most dots of a sample.
const DOTS: usize = 1500;
/// The error at which Figure 4.8 cuts, percent.
const CUT: f64 = 1.0;

/// Numbers by magnitude: (middle of the bin, numbers in it).
fn distribution<'a>(values: impl Iterator<Item = &'a f32>) -> Vec<(f64, f64)> {
    let bins = (f64::from(HIGHEST - LOWEST) * PER_DECADE).round();
    let middle = |bin: f64| 10_f64.powf(f64::from(LOWEST) + (bin + 0.5) / PER_DECADE);
    let mut found = Vec::new();
    let mut bin = 0.0;
    while bin < bins {
        found.push((middle(bin), 0.0));
        bin += 1.0;
    }
    for value in values.filter(|value| **value != 0.0) {
        let place = (f64::from(value.abs()).log10() - f64::from(LOWEST)) * PER_DECADE;
        if place < 0.0 {
            continue;
        }
        let index = (0..found.len()).zip(1_u32..).find(|(_, end)| place < f64::from(*end));
        if let Some((index, _)) = index {
            found[index].1 += 1.0;
        }
    }
    found
}

/// A number and its relative error, percent.
fn errors(values: &[f32]) -> Vec<(f64, f64)> {
    let error = |value: &f32| {
        let back = NarrowFormat::Binary16.round_trip(*value)?;
        let (value, back) = (f64::from(*value), f64::from(back));
        (value != 0.0).then(|| (value.abs(), (back - value).abs() / value.abs() * 100.0))
    };
    values.iter().filter_map(error).collect()
}

/// As many points as a chart holds, evenly among all.
fn thinned(points: impl Iterator<Item = (f64, f64)>, count: usize) -> Vec<(f64, f64)> {
    points.step_by(count.div_ceil(DOTS).max(1)).collect()
}

/// Adds the figures of a step's numbers; `step` names it.
pub(super) fn add(part: &mut Part, kinds: &[Numbers], step: &str) {
    let values: Vec<f32> = EACH_ONCE.of(kinds).copied().collect();
    let halves: Vec<f32> =
        values.iter().filter_map(|value| NarrowFormat::Binary16.round_trip(*value)).collect();
    let (sizes, loss) = (Sizes::of(values.iter()), Loss::of(NarrowFormat::Binary16, values.iter()));
    let (x, count) = (Axis::log("magnitude"), Axis::log("numbers"));
    let spread = |id, title: &str, values: &[f32]| {
        let series = [Series::new("numbers", Drawn::Marked, distribution(values.iter()))];
        let [all, zeros] = [values.len() as u64, Sizes::of(values.iter()).zeros].map(grouped);
        let caption = format!(
            "{all} numbers of {step}, four bins a decade; {zeros} are 0 and not shown, nor are \
             numbers outside the axis."
        );
        Figure::new(id, title, lines(x, count, &series), caption)
    };
    let errors = errors(&values);
    let (cut, high): (Vec<_>, Vec<_>) = errors.iter().copied().partition(|error| error.1 < CUT);
    let cut_dots = thinned(cut.iter().copied(), cut.len());
    let all = [&cut_dots[..], &high].concat();
    let scatter = |id, title: &str, dots, caption: String| {
        let series = [Series::new("error", Drawn::Dots, dots)];
        Figure::new(id, title, lines(x, Axis::log("error, % of the number"), &series), caption)
    };
    let size = |size: Option<f32>| size.map_or("none".to_owned(), |size| format!("{size:.2e}"));
    let [smallest, largest] = INPUT.magnitudes;
    let figure = spread(
        ("figure-4-5", "§4.6.2, Figure 4.5"),
        "Input numbers in binary32, by magnitude",
        &values,
    );
    let mut row = figure.row(
        "magnitudes of the input",
        format!("{smallest:.1e} to {largest}"),
        format!(
            "{} to {}; {:.2} % below 3e-5",
            size(sizes.smallest),
            size(sizes.largest),
            sizes.small_share() * 100.0
        ),
    );
    "§4.6.2, Figures 4.5 and 4.6".clone_into(&mut row.thesis);
    part.figure(figure, [row]);
    let id = ("figure-4-6", "§4.6.2, Figure 4.6");
    part.figure(spread(id, "The same numbers rounded to binary16", &halves), []);
    let figure = scatter(
        ("figure-4-7", "§4.6.2, Figure 4.7"),
        "Error of binary16 on all input numbers",
        all,
        "Each dot is a number: all errors of 1 % and more, and a sample of the smaller ones. Below \
         6.1e-5 binary16 has subnormal numbers, and the relative error grows; numbers that \
         binary16 holds exactly have no error and no dot."
            .to_owned(),
    );
    let row = figure.row(
        "mean error of the input in binary16",
        format!("{} %", INPUT.mean_percent),
        format!("{:.4} %", loss.mean() * 100.0),
    );
    part.figure(figure, [row]);
    let figure = scatter(
        ("figure-4-8", "§4.6.2, Figure 4.8"),
        "The same without errors of 1 % and more",
        cut_dots,
        format!("{} of the numbers that are not 0.", percent(loss.under_share())),
    );
    let row = figure.row(
        "input numbers with an error below 1 % in binary16",
        format!("{:.2} %", INPUT.under_1_percent_share * 100.0),
        percent(loss.under_share()),
    );
    part.figure(figure, [row]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fall_into_the_bin_of_their_magnitude() {
        let found = distribution([1.0, -1.1, 100.0, 0.0].iter());
        let full: Vec<_> = found.iter().filter(|bin| bin.1 > 0.0).collect();
        assert_eq!(full.len(), 2);
        assert!((full[0].0 - 10_f64.powf(0.125)).abs() < 1e-9 && (full[0].1 - 2.0).abs() < 1e-9);
    }

    #[test]
    fn exact_numbers_have_no_error() {
        let found = errors(&[1.0, 0.0, 1.0 + 1.0 / 4096.0]);
        assert_eq!(found.len(), 2);
        assert!(found[0].1 == 0.0 && (found[1].1 - 100.0 / 4097.0).abs() < 1e-9);
    }
}
