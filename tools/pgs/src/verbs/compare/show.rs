//! Prints a comparison for people: a table row by row, then the last step in words.

use std::io::{self, Write};

use scene::Penetration;

use super::side::{Measured, Side};
use super::{CompareArgs, Row, vector};
use crate::deviation::Deviation;
use crate::numbers::{grouped, number, signed};
use crate::output::table::{Column, heading, line};
use step_folder::digest;

const COLUMNS: [Column; 17] = [
    Column { name: "step", unit: "", width: 5 },
    Column { name: "", unit: "", width: 5 },
    Column { name: "pairs", unit: "", width: 8 },
    Column { name: "kinetic", unit: "kJ", width: 9 },
    Column { name: "potential", unit: "kJ", width: 10 },
    Column { name: "momentum", unit: "N s", width: 10 },
    Column { name: "angular", unit: "N m s", width: 11 },
    Column { name: "deep", unit: "mm mean", width: 8 },
    Column { name: "deep", unit: "mm most", width: 8 },
    Column { name: "unmoved", unit: "%", width: 7 },
    Column { name: "position", unit: "% mean", width: 9 },
    Column { name: "position", unit: "% < 1 %", width: 8 },
    Column { name: "position", unit: "% most", width: 9 },
    Column { name: "linear", unit: "% in 1 %", width: 8 },
    Column { name: "linear", unit: "m/s most", width: 9 },
    Column { name: "spin", unit: "% in 1 %", width: 8 },
    Column { name: "spin", unit: "rad/s", width: 9 },
];

const NOTHING: &str = "-";

/// The two builds, the scene, and the names of the columns.
pub(super) fn head(
    args: &CompareArgs,
    sides: &(Side<'_>, Side<'_>),
    steps: u32,
    start: &Row,
    out: &mut dyn Write,
) -> io::Result<()> {
    for side in [&sides.0, &sides.1] {
        writeln!(out, "{}          {}", side.name, side.spec)?;
    }
    match &args.input {
        Some(path) => writeln!(out, "input      {}, one step", path.display())?,
        None => writeln!(out, "scene      {}, {steps} steps", args.scene.text())?,
    }
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    if let Some(measured) = &start.a {
        line(out, &COLUMNS, cells("0", "start", measured))?;
    }
    out.flush()
}

/// Rows for A, for B, and for B minus A.
pub(super) fn row(row: &Row, sides: &(Side<'_>, Side<'_>), out: &mut dyn Write) -> io::Result<()> {
    let step = row.step.to_string();
    let mut first = step.as_str();
    for (side, measured) in [(&sides.0, &row.a), (&sides.1, &row.b)] {
        match measured {
            Some(measured) => line(out, &COLUMNS, cells(first, side.name, measured))?,
            None => {
                writeln!(out, "{first:>5} {:>5} failed in step {}", side.name, failed_in(side))?;
            }
        }
        first = "";
    }
    let (Some(a), Some(b), Some(state)) = (&row.a, &row.b, &row.deviation) else { return Ok(()) };
    let percent = |share: f64| number(share * 100.0);
    let difference = [
        String::new(),
        "B-A".to_owned(),
        signed(b.collisions as f64 - a.collisions as f64),
        signed((b.kinetic.total() - a.kinetic.total()) / 1e3),
        signed((b.potential - a.potential) / 1e3),
        number(length(vector(b.momentum.linear, a.momentum.linear))),
        number(length(vector(b.momentum.angular, a.momentum.angular))),
        signed((b.penetration.mean - a.penetration.mean) * 1e3),
        signed((b.penetration.largest - a.penetration.largest) * 1e3),
        b.unmoved
            .zip(a.unmoved)
            .map_or_else(|| NOTHING.to_owned(), |(b, a)| signed((b - a) * 100.0)),
        percent(state.position.mean),
        percent(state.position.under_share()),
        percent(state.position.largest),
        percent(state.linear.within_share()),
        number(state.linear.largest_absolute),
        percent(state.angular.within_share()),
        number(state.angular.largest_absolute),
    ];
    line(out, &COLUMNS, difference)
}

fn failed_in(side: &Side<'_>) -> u32 {
    side.failed.as_ref().map_or(0, |failed| failed.step)
}

/// The cells of one board, without the deviations.
fn cells(step: &str, name: &str, measured: &Measured) -> [String; 10] {
    let Measured { kinetic, momentum, penetration, .. } = measured;
    [
        step.to_owned(),
        name.to_owned(),
        grouped(measured.collisions),
        number(kinetic.total() / 1e3),
        number(measured.potential / 1e3),
        number(length(momentum.linear)),
        number(length(momentum.angular)),
        number(penetration.mean * 1e3),
        number(penetration.largest * 1e3),
        measured.unmoved.map_or_else(|| NOTHING.to_owned(), |share| number(share * 100.0)),
    ]
}

/// The last step in words, and the end of the comparison.
pub(super) fn end(row: &Row, sides: &(Side<'_>, Side<'_>), out: &mut dyn Write) -> io::Result<()> {
    writeln!(out)?;
    if let Some(state) = &row.deviation {
        let words = |name: &str, unit: &str, deviation: &Deviation| {
            let Deviation { mean, largest, mean_absolute, largest_absolute, .. } = deviation;
            format!(
                "{name:<10} {} % under 1 %, {} % within; relative mean {} %, most {} %; absolute \
                 mean {} {unit}, most {} {unit}; of {} components A has {} zeros, {} of them not \
                 in B",
                number(deviation.under_share() * 100.0),
                number(deviation.within_share() * 100.0),
                number(mean * 100.0),
                number(largest * 100.0),
                number(*mean_absolute),
                number(*largest_absolute),
                grouped(deviation.components),
                grouped(deviation.zeros),
                grouped(deviation.zeros_moved),
            )
        };
        writeln!(out, "step {}, B against A", row.step)?;
        writeln!(out, "{}", words("position", "m", &state.position))?;
        writeln!(out, "{}", words("linear", "m/s", &state.linear))?;
        writeln!(out, "{}", words("spin", "rad/s", &state.angular))?;
    }
    for (side, measured) in [(&sides.0, &row.a), (&sides.1, &row.b)] {
        if let Some(Measured { kinetic, momentum, penetration, .. }) = measured {
            writeln!(
                out,
                "{}          {:.3} J translational, {:.3} J rotational; {} N s, {} N m s; {}",
                side.name,
                kinetic.translational,
                kinetic.rotational,
                three(momentum.linear),
                three(momentum.angular),
                depths(penetration),
            )?;
        }
    }
    for side in [&sides.0, &sides.1] {
        match &side.failed {
            None => {
                let (name, digest) = (side.name, side.digest());
                writeln!(out, "digest {name}   {} {digest}", digest::ALGORITHM)?;
            }
            Some(failed) => {
                writeln!(out, "{} ({}) failed in step {}", side.name, side.spec, failed.step)?;
                writeln!(out, "{}", failed.failure.chain())?;
            }
        }
    }
    Ok(())
}

fn depths(penetration: &Penetration) -> String {
    let Penetration { contacts, penetrating, .. } = penetration;
    format!("{} of {} contacts penetrate", grouped(*penetrating), grouped(*contacts))
}

fn three(vector: [f64; 3]) -> String {
    format!("({})", vector.map(number).join(", "))
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    ((x * x + y * y) + z * z).sqrt()
}
