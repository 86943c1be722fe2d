//! The tables of how far orders lead apart.

use super::super::recorded::{FLOAT_AGAINST_GPU, TWO_GPU_RUNS, percent};
use super::{Comparison, Outcome};
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::histogram::Histogram;
use crate::index::Row;
use crate::table::{Cell, Table, text};

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
        let [over_steps, positions] = self.figures();
        let mut rows = Vec::new();
        rows.extend(self.row_of_pairs(&over_steps));
        part.figure(over_steps, rows);
        let rows = self.rows_of_gpu(&positions);
        part.figure(positions, rows);
        part
    }

    /// The source of the order that stands for the GPU's.
    fn source(&self) -> String {
        match self.gpu_order {
            "cells" => "reconstructed by Bullet's cells and batches (cells)".to_owned(),
            file => format!("as Bullet recorded it ({file})"),
        }
    }

    /// The steps after which the orders are compared.
    fn after(&self) -> String {
        match self.gpu.curve.last().map_or(0, |at| at.step) {
            1 => "after one step".to_owned(),
            steps => format!("after {steps} steps"),
        }
    }

    /// Figures 4.2 and 4.9, each of one step and of many.
    fn figures(&self) -> [Figure; 2] {
        let means = self.over_pairs.iter();
        let means = means.map(|at| (f64::from(at.step), at.position_mean_percent.mean)).collect();
        let gpu = self.gpu.curve.iter();
        let gpu = gpu.map(|at| (f64::from(at.step), at.state.position.mean * 100.0)).collect();
        let last = self.gpu.curve.last().map_or(1, |at| at.step);
        let band = |percent: f64| vec![(1.0, percent), (f64::from(last), percent)];
        let [low, high] = TWO_GPU_RUNS.mean_percent;
        let series = [
            Series::new("two random orders", Drawn::Marked, means),
            Series::new("as given against the GPU's", Drawn::Marked, gpu),
            Series::new(format!("{low} %, recorded"), Drawn::Dashes, band(low)),
            Series::new(format!("{high} %, recorded"), Drawn::Dashes, band(high)),
        ];
        let over_steps = Figure::new(
            (if last == 1 { "figure-4-2-once" } else { "figure-4-2" }, TWO_GPU_RUNS.thesis),
            "Deviation of positions between two executions, step by step",
            lines(Axis::linear("step"), Axis::log("mean deviation (eq. 4.1), %"), &series),
            format!(
                "{}: the runs differ by the order of their collisions alone, and the GPU's order \
                 is {}. The thesis does not say after how many steps its snapshots were taken.",
                self.subject,
                self.source()
            ),
        );
        let mut series = Vec::new();
        for (name, histogram) in [
            ("as given against the GPU's", &self.gpu.position_histogram),
            ("random orders", &self.pairs_position_histogram),
        ] {
            let points = histogram.as_ref().map(Histogram::below);
            series.extend(points.map(|points| Series::new(name, Drawn::Line, points)));
        }
        let share = FLOAT_AGAINST_GPU.under_1_percent_share.unwrap_or_default();
        let falls = self.gpu.curve.iter().find(|at| at.state.position.under_share() <= share);
        let falls = match falls {
            Some(at) => {
                format!("in step {} the share below 1 % first falls to the thesis'", at.step)
            }
            None => "the share below 1 % stays above the thesis'".to_owned(),
        };
        let positions = Figure::new(
            (if last == 1 { "figure-4-9-once" } else { "figure-4-9" }, FLOAT_AGAINST_GPU.thesis),
            format!(
                "Deviation of positions between the order as given and the GPU's, {}",
                self.after()
            ),
            FLOAT_AGAINST_GPU.spread(series),
            format!(
                "Both orders are solved on the emulated board: no GPU takes part. {}, the GPU's \
                 order {}; {falls}. A step moves a body by centimetres, its position is metres: \
                 one step leads to less than the thesis' figures.",
                self.subject,
                self.source()
            ),
        );
        [over_steps, positions]
    }

    fn row_of_pairs(&self, figure: &Figure) -> Option<Row> {
        let of = self.over_pairs.last()?.position_mean_percent;
        let [low, high] = TWO_GPU_RUNS.mean_percent;
        let subject = "mean deviation of positions between two random orders; the thesis compares \
            two executions on the GPU";
        let ours = match self.pairs.len() {
            1 => format!("{:.4} %", of.mean),
            pairs => format!("{:.4} ± {:.4} % ({pairs} pairs)", of.mean, of.standard_deviation),
        };
        let recorded = format!("{low} % to {high} %");
        Some(figure.row(format!("{subject}, {}", self.after()), recorded, ours))
    }

    fn rows_of_gpu(&self, figure: &Figure) -> Vec<Row> {
        let Some(last) = self.gpu.curve.last() else { return Vec::new() };
        let position = last.state.position;
        let orders = format!(
            "the order as given against the GPU's order ({}), both on the emulated board, {}",
            self.gpu_order,
            self.after()
        );
        let share = FLOAT_AGAINST_GPU.under_1_percent_share.unwrap_or_default();
        vec![
            figure.row(
                format!("positions that deviate by less than 1 %: {orders}"),
                format!("{:.2} %", share * 100.0),
                percent(position.under_share()),
            ),
            figure.row(
                format!("mean deviation of positions: {orders}"),
                format!("{} %", FLOAT_AGAINST_GPU.mean_percent[0]),
                format!("{:.4} %", position.mean * 100.0),
            ),
        ]
    }

    fn steps(&self) -> Table {
        let mut table = Table::with_columns(
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
        let mut table =
            Table::new("decades", "Positions after the last step by deviation, % of them");
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
            table.row([
                ("from_percent", "from %", edge),
                ("gpu_percent", "gpu, as-given", share(shares[0])),
                ("pairs_percent", "random pairs", share(shares[1])),
            ]);
        }
        Some(table)
    }
}
