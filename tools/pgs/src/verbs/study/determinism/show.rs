//! Shows how far orders lead apart.

use std::io::Write;

use super::super::recorded::RecordedDeviation;
use super::super::spread::Spread;
use super::{Comparison, Outcome, OverPairs, Point};
use crate::failure::Failure;
use crate::histogram::Histogram;
use crate::numbers::number;
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const COLUMNS: [Column; 10] = [
    Column { name: "step", unit: "", width: 5 },
    Column { name: "orders", unit: "", width: 15 },
    Column { name: "position", unit: "% mean", width: 9 },
    Column { name: "position", unit: "+-", width: 8 },
    Column { name: "position", unit: "% < 1 %", width: 8 },
    Column { name: "position", unit: "+-", width: 8 },
    Column { name: "position", unit: "mm mean", width: 8 },
    Column { name: "linear", unit: "% in 1 %", width: 8 },
    Column { name: "spin", unit: "% in 1 %", width: 8 },
    Column { name: "energy", unit: "% apart", width: 8 },
];

/// Rows of steps.
const ROWS: usize = 12;

/// Shows the outcome.
pub(in super::super) fn show(outcome: &Outcome, out: &mut dyn Write) -> Result<(), Failure> {
    let pairs = outcome.pairs.len();
    fact(out, "start", &outcome.start_text)?;
    let Comparison { original, new, .. } = &outcome.gpu;
    let source = outcome.gpu_order;
    let orders = format!("{new} against {original} ({source}); random orders in pairs: {pairs}");
    fact(out, "orders", &orders)?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    let steps = outcome.gpu.curve.len();
    let every = steps.div_ceil(ROWS).max(1);
    for (place, point) in outcome.gpu.curve.iter().enumerate() {
        if place > 0 && !(place + 1).is_multiple_of(every) && place + 1 != steps {
            continue;
        }
        line(out, &COLUMNS, gpu_cells(point))?;
        if let Some(over) = outcome.over_pairs.get(place) {
            line(out, &COLUMNS, pair_cells(over))?;
        }
    }
    writeln!(out)?;
    for RecordedDeviation { thesis, subject, mean_percent: [low, high], under_1_percent_share } in
        &outcome.recorded
    {
        let mean = if (low - high).abs() > 0.0 { format!("{low} to {high}") } else { number(*low) };
        let under = under_1_percent_share
            .map_or_else(String::new, |share| format!(", {} % under 1 %", number(share * 100.0)));
        fact(out, "recorded", &format!("{thesis}, {subject}: mean {mean} %{under}"))?;
    }
    let histograms = [&outcome.gpu.position_histogram, &outcome.pairs_position_histogram];
    if histograms.iter().any(|histogram| histogram.is_some()) {
        writeln!(out)?;
        decades(histograms, out)?;
    }
    Ok(())
}

fn gpu_cells(point: &Point) -> [String; COLUMNS.len()] {
    let state = &point.state;
    let percent = |share: f64| number(share * 100.0);
    [
        point.step.to_string(),
        "gpu, as-given".to_owned(),
        percent(state.position.mean),
        String::new(),
        percent(state.position.under_share()),
        String::new(),
        number(state.position.mean_absolute * 1e3),
        percent(state.linear.within_share()),
        percent(state.angular.within_share()),
        percent(point.energy_difference()),
    ]
}

fn pair_cells(over: &OverPairs) -> [String; COLUMNS.len()] {
    let mean = |spread: &Spread, scale: f64| number(spread.mean * scale);
    let apart = |spread: &Spread, scale: f64| number(spread.standard_deviation * scale);
    [
        String::new(),
        "random pairs".to_owned(),
        mean(&over.position_mean_percent, 1.0),
        apart(&over.position_mean_percent, 1.0),
        mean(&over.position_under_1_percent_share, 100.0),
        apart(&over.position_under_1_percent_share, 100.0),
        mean(&over.position_mean_m, 1e3),
        mean(&over.linear_within_1_percent_share, 100.0),
        mean(&over.angular_within_1_percent_share, 100.0),
        mean(&over.energy_difference_percent, 1.0),
    ]
}

/// The positions of the last step by decades of their deviation.
fn decades(histograms: [&Option<Histogram>; 2], out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(out, "positions after the last step by deviation     gpu, as-given   random pairs")?;
    let [gpu, random] =
        histograms.map(|histogram| histogram.as_ref().map(Histogram::decades).unwrap_or_default());
    let rows = gpu.len().max(random.len());
    for row in 0..rows {
        let [one, other] = [&gpu, &random].map(|decades| decades.get(row));
        let shares = [one, other].map(|decade| decade.map(|(_, share)| *share));
        if shares.iter().flatten().all(|share| *share <= 0.0) {
            continue;
        }
        let edge = one.or(other).map_or(0.0, |(edge, _)| *edge);
        let from = if row == 0 { "less".to_owned() } else { format!("from {edge:.0e} %") };
        let cell = |share: Option<f64>| {
            share.map_or_else(|| "-".to_owned(), |share| format!("{:.4} %", share * 100.0))
        };
        writeln!(out, "  {from:<43} {:>14} {:>14}", cell(shares[0]), cell(shares[1]))?;
    }
    Ok(())
}
