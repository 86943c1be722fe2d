//! The tables of sixteen bits beside float.

use super::{ORIGINAL, Outcome};
use crate::experiment::Part;
use crate::table::{Cell, Table, text};

/// Rows of steps.
const ROWS: usize = 8;

impl Outcome {
    /// The facts and tables of the outcome.
    pub(super) fn part(&self) -> Part {
        let mut part = Part::of(vec![self.steps(), self.of_splits()]).with(self);
        part.complete = self.complete;
        part.fact("start", &self.start_text);
        for of_build in &self.builds {
            if let Some(failed) = &of_build.failed {
                let text = format!("{} in step {}: {}", of_build.build, failed.step, failed.error);
                part.fact("failed", text);
            }
        }
        for recorded in &self.recorded {
            part.fact("recorded", recorded.text());
        }
        self.add_figure(&mut part);
        part
    }

    fn steps(&self) -> Table {
        let mut table = Table::with_columns(
            "half",
            "Sixteen bits beside float, step by step",
            &[
                ("step", "step"),
                ("build", "build"),
                ("kinetic_kj", "energy\nkJ"),
                ("energy_ratio", "energy\nx float"),
                ("position_mean_percent", "position\n% mean"),
                ("position_under_1_percent", "position\n% < 1 %"),
                ("position_mean_mm", "position\nmm mean"),
                ("linear_within_1_percent", "linear\n% in 1 %"),
                ("unmoved_percent", "unmoved\n%"),
            ],
        );
        let percent = |share: f64| Cell::Digits(share * 100.0);
        let steps = self.float_unmoved_share.len();
        let every = steps.div_ceil(ROWS).max(1);
        let of_float = self.float_kinetic_energy_j.iter().skip(1).zip(&self.float_unmoved_share);
        for (place, (energy, unmoved)) in of_float.enumerate() {
            if place > 0 && !(place + 1).is_multiple_of(every) && place + 1 != steps {
                continue;
            }
            let mut cells = vec![Cell::Whole(place as u64 + 1), text(ORIGINAL)];
            cells.push(Cell::Digits(energy / 1e3));
            cells.extend([const { Cell::Missing }; 5]);
            cells.push(percent(*unmoved));
            table.row(cells);
            for of_build in &self.builds {
                let Some(point) = of_build.curve.get(place) else { continue };
                let state = &point.state;
                table.row([
                    Cell::Whole(point.step.into()),
                    text(&of_build.build),
                    Cell::Digits(point.kinetic_energy_j / 1e3),
                    Cell::known(point.energy_ratio, Cell::Digits),
                    percent(state.position.mean),
                    percent(state.position.under_share()),
                    Cell::Digits(state.position.mean_absolute * 1e3),
                    percent(state.linear.within_share()),
                    percent(point.unmoved_share),
                ]);
            }
        }
        table
    }

    fn of_splits(&self) -> Table {
        let mut table = Table::new("splits", "Splits of sixteen bits, on the numbers of a step");
        for split in &self.splits {
            table.row([
                ("format", "format", text(split.format)),
                ("exponent_bits", "exponent\nbits", Cell::Whole(split.exponent_bits.into())),
                ("mantissa_bits", "mantissa\nbits", Cell::Whole(split.mantissa_bits.into())),
                ("smallest", "smallest", Cell::Digits(split.smallest)),
                (
                    "below_smallest_percent",
                    "smaller\n%",
                    Cell::Digits(split.below_smallest_share * 100.0),
                ),
                ("mean_percent", "error\n% mean", Cell::Digits(split.relative_mean_percent)),
                (
                    "under_1_percent",
                    "error\n% < 1 %",
                    Cell::Digits(split.under_1_percent_share * 100.0),
                ),
            ]);
        }
        table
    }
}
