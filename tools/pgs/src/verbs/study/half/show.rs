//! Shows sixteen bits beside float.

use std::io::Write;

use super::splits::Split;
use super::{ORIGINAL, Outcome, Point};
use crate::failure::Failure;
use crate::numbers::number;
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const COLUMNS: [Column; 9] = [
    Column { name: "step", unit: "", width: 5 },
    Column { name: "build", unit: "", width: 22 },
    Column { name: "energy", unit: "kJ", width: 9 },
    Column { name: "energy", unit: "x float", width: 9 },
    Column { name: "position", unit: "% mean", width: 9 },
    Column { name: "position", unit: "% < 1 %", width: 8 },
    Column { name: "position", unit: "mm mean", width: 8 },
    Column { name: "linear", unit: "% in 1 %", width: 8 },
    Column { name: "unmoved", unit: "%", width: 8 },
];

const SPLITS: [Column; 7] = [
    Column { name: "format", unit: "", width: 17 },
    Column { name: "exponent", unit: "bits", width: 9 },
    Column { name: "mantissa", unit: "bits", width: 9 },
    Column { name: "smallest", unit: "", width: 9 },
    Column { name: "smaller", unit: "%", width: 9 },
    Column { name: "error", unit: "% mean", width: 9 },
    Column { name: "error", unit: "% < 1 %", width: 9 },
];

/// Rows of steps.
const ROWS: usize = 8;

/// Shows the outcome.
pub(in super::super) fn show(outcome: &Outcome, out: &mut dyn Write) -> Result<(), Failure> {
    fact(out, "start", &outcome.start_text)?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    let steps = outcome.float_unmoved_share.len();
    let every = steps.div_ceil(ROWS).max(1);
    let of_float = outcome.float_kinetic_energy_j.iter().skip(1).zip(&outcome.float_unmoved_share);
    for (place, (energy, unmoved)) in of_float.enumerate() {
        if place > 0 && !(place + 1).is_multiple_of(every) && place + 1 != steps {
            continue;
        }
        let step = (place + 1).to_string();
        line(out, &COLUMNS, float_cells(step, *energy, *unmoved))?;
        for of_build in &outcome.builds {
            if let Some(point) = of_build.curve.get(place) {
                line(out, &COLUMNS, cells(&of_build.build, point))?;
            }
        }
    }
    writeln!(out)?;
    for of_build in &outcome.builds {
        if let Some(failed) = &of_build.failed {
            writeln!(out, "{} failed in step {}\n{}", of_build.build, failed.step, failed.error)?;
        }
    }
    for recorded in &outcome.recorded {
        let [mean, _] = recorded.mean_percent;
        let under = recorded.under_1_percent_share.unwrap_or_default() * 100.0;
        let text = format!(
            "{}, {}: mean {} %, {} % under 1 %",
            recorded.thesis,
            recorded.subject,
            number(mean),
            number(under)
        );
        fact(out, "recorded", &text)?;
    }
    writeln!(out)?;
    writeln!(out, "splits of sixteen bits, on the numbers of a step")?;
    heading(out, &SPLITS)?;
    outcome.splits.iter().try_for_each(|split| line(out, &SPLITS, split_cells(split)))?;
    Ok(())
}

fn float_cells(step: String, energy: f64, unmoved: f64) -> Vec<String> {
    let mut cells = vec![step, ORIGINAL.to_owned(), number(energy / 1e3)];
    cells.resize(COLUMNS.len() - 1, String::new());
    cells.push(number(unmoved * 100.0));
    cells
}

fn cells(build: &str, point: &Point) -> [String; COLUMNS.len()] {
    let Point { state, kinetic_energy_j, energy_ratio, unmoved_share, .. } = point;
    [
        String::new(),
        build.to_owned(),
        number(kinetic_energy_j / 1e3),
        energy_ratio.map_or_else(|| "-".to_owned(), number),
        number(state.position.mean * 100.0),
        number(state.position.under_share() * 100.0),
        number(state.position.mean_absolute * 1e3),
        number(state.linear.within_share() * 100.0),
        number(unmoved_share * 100.0),
    ]
}

fn split_cells(split: &Split) -> [String; SPLITS.len()] {
    [
        split.format.to_owned(),
        split.exponent_bits.to_string(),
        split.mantissa_bits.to_string(),
        number(split.smallest),
        number(split.below_smallest_share * 100.0),
        number(split.relative_mean_percent),
        number(split.under_1_percent_share * 100.0),
    ]
}
