//! The tables of how far orders lead apart.

use super::super::recorded::RecordedDeviation;
use super::{Comparison, Outcome};
use crate::experiment::Part;
use crate::histogram::Histogram;
use crate::table::{Cell, Table, text};
use pgs_command::numbers::number;

/// Rows of steps.
const ROWS: usize = 12;

impl Outcome {
    /// The facts and tables of the outcome.
    pub(super) fn part(&self) -> Part {
        let Comparison { original, new, .. } = &self.gpu;
        let source = self.gpu_order;
        let mut part = Part::of(vec![self.steps()]).with(self);
        part.complete = self.complete;
        part.fact("start", &self.start_text);
        let pairs = self.pairs.len();
        let orders =
            format!("{new} against {original} ({source}); random orders in pairs: {pairs}");
        part.fact("orders", orders);
        for recorded in &self.recorded {
            part.fact("recorded", recorded.text());
        }
        part.tables.extend(self.decades());
        part
    }

    fn steps(&self) -> Table {
        let mut table = Table::new(
            "orders",
            "Deviation of one order from another, step by step",
            &[
                ("step", "step"),
                ("orders", "orders"),
                ("position_mean_percent", "position\n% mean"),
                ("position_mean_deviation_percent", "position\n+-"),
                ("position_under_1_percent", "position\n% < 1 %"),
                ("position_under_deviation_percent", "position\n+-"),
                ("position_mean_mm", "position\nmm mean"),
                ("linear_within_1_percent", "linear\n% in 1 %"),
                ("angular_within_1_percent", "spin\n% in 1 %"),
                ("energy_difference_percent", "energy\n% apart"),
            ],
        );
        let steps = self.gpu.curve.len();
        let every = steps.div_ceil(ROWS).max(1);
        for (place, point) in self.gpu.curve.iter().enumerate() {
            if place > 0 && !(place + 1).is_multiple_of(every) && place + 1 != steps {
                continue;
            }
            let state = &point.state;
            let percent = |share: f64| Cell::Digits(share * 100.0);
            table.row([
                Cell::Whole(point.step.into()),
                text("gpu, as-given"),
                percent(state.position.mean),
                Cell::Missing,
                percent(state.position.under_share()),
                Cell::Missing,
                Cell::Digits(state.position.mean_absolute * 1e3),
                percent(state.linear.within_share()),
                percent(state.angular.within_share()),
                percent(point.energy_difference()),
            ]);
            let Some(over) = self.over_pairs.get(place) else { continue };
            let share = over.position_under_1_percent_share;
            table.row([
                Cell::Whole(over.step.into()),
                text("random pairs"),
                Cell::Digits(over.position_mean_percent.mean),
                Cell::Digits(over.position_mean_percent.standard_deviation),
                percent(share.mean),
                percent(share.standard_deviation),
                Cell::Digits(over.position_mean_m.mean * 1e3),
                percent(over.linear_within_1_percent_share.mean),
                percent(over.angular_within_1_percent_share.mean),
                Cell::Digits(over.energy_difference_percent.mean),
            ]);
        }
        table
    }

    /// The positions of the last step by decades of their deviation.
    fn decades(&self) -> Option<Table> {
        let histograms = [&self.gpu.position_histogram, &self.pairs_position_histogram];
        if histograms.iter().all(|histogram| histogram.is_none()) {
            return None;
        }
        let mut table = Table::new(
            "decades",
            "Positions after the last step by deviation, % of them",
            &[
                ("from_percent", "from %"),
                ("gpu_percent", "gpu, as-given"),
                ("pairs_percent", "random pairs"),
            ],
        );
        let [gpu, random] = histograms
            .map(|histogram| histogram.as_ref().map(Histogram::decades).unwrap_or_default());
        for row in 0..gpu.len().max(random.len()) {
            let both = [&gpu, &random].map(|decades| decades.get(row));
            let shares = both.map(|decade| decade.map(|(_, share)| *share));
            if shares.iter().flatten().all(|share| *share <= 0.0) {
                continue;
            }
            let edge = both.iter().flatten().next().map_or(0.0, |(edge, _)| *edge);
            let share = |share| Cell::known(share, |share: f64| Cell::Number(share * 100.0, 4));
            let edge = if row == 0 { text("less") } else { text(format!("{edge:.0e}")) };
            table.row([edge, share(shares[0]), share(shares[1])]);
        }
        Some(table)
    }
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
}
