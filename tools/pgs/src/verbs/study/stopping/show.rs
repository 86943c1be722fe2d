//! Shows the residuals after each number of passes, and the passes of each rule.

use std::io::{self, Write};

use super::residual::Residuals;
use super::{Outcome, Pass, Tolerance};
use crate::numbers::{grouped, number};
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const CONTACT: [Column; 6] = [
    Column { name: "contact", unit: "passes", width: 8 },
    Column { name: "residual", unit: "rms m/s", width: 10 },
    Column { name: "largest", unit: "m/s", width: 10 },
    Column { name: "Fischer-B.", unit: "rms m/s", width: 10 },
    Column { name: "change", unit: "N s", width: 10 },
    Column { name: "share", unit: "", width: 10 },
];

const FRICTION: [Column; 6] = [
    Column { name: "friction", unit: "passes", width: 8 },
    Column { name: "residual", unit: "rms m/s", width: 10 },
    Column { name: "largest", unit: "m/s", width: 10 },
    Column { name: "contacts", unit: "rms m/s", width: 10 },
    Column { name: "change", unit: "N s", width: 10 },
    Column { name: "share", unit: "", width: 10 },
];

const RULES: [Column; 7] = [
    Column { name: "tolerance", unit: "", width: 9 },
    Column { name: "contact", unit: "residual", width: 9 },
    Column { name: "passes", unit: "change", width: 7 },
    Column { name: "until", unit: "each", width: 7 },
    Column { name: "friction", unit: "residual", width: 9 },
    Column { name: "passes", unit: "change", width: 7 },
    Column { name: "until", unit: "each", width: 7 },
];

/// A table of the residuals after some passes.
fn residuals(
    out: &mut dyn Write,
    columns: &[Column],
    passes: &[Pass],
    of: impl Fn(&Residuals) -> [f64; 3],
) -> io::Result<()> {
    heading(out, columns)?;
    shown(passes).try_for_each(|pass| line(out, columns, cells(pass, of(&pass.residuals))))
}

/// Shows the outcome.
pub(in super::super) fn show(outcome: &Outcome, out: &mut dyn Write) -> io::Result<()> {
    let step = format!(
        "{}: {} bodies, {} collisions, spin damping {}",
        outcome.step,
        grouped(outcome.bodies as u64),
        grouped(outcome.collisions as u64),
        outcome.spin_damping,
    );
    fact(out, "step", &step)?;
    writeln!(out)?;
    let Outcome { contact, friction, .. } = outcome;
    residuals(out, &CONTACT, contact, |Residuals { contact, fischer_burmeister, .. }| {
        [contact.rms, contact.largest, fischer_burmeister.rms]
    })?;
    writeln!(out)?;
    residuals(out, &FRICTION, friction, |Residuals { friction, contact, .. }| {
        [friction.rms, friction.largest, contact.rms]
    })?;
    writeln!(out)?;
    heading(out, &RULES)?;
    for tolerance in &outcome.tolerances {
        line(out, &RULES, rule_cells(tolerance, outcome))?;
    }
    if let Some(fixed) = &outcome.fixed {
        writeln!(out)?;
        let text = format!(
            "{} + {} passes leave {} m/s at the contacts and {} m/s at the tangents (root mean square), \
             {} and {} m/s at most",
            outcome.contact_iterations,
            outcome.friction_iterations,
            number(fixed.residuals.contact.rms),
            number(fixed.residuals.friction.rms),
            number(fixed.residuals.contact.largest),
            number(fixed.residuals.friction.largest),
        );
        fact(out, "fixed", &text)?;
    }
    Ok(())
}

/// The first passes, and later ones ever further apart.
fn shown(passes: &[Pass]) -> impl Iterator<Item = &Pass> {
    let last = passes.last().map_or(0, |pass| pass.passes);
    passes.iter().filter(move |pass| {
        let number = pass.passes;
        number <= 8
            || number == last
            || number.is_power_of_two()
            || number % 3 == 0 && (number / 3).is_power_of_two()
    })
}

fn cells(pass: &Pass, residuals: [f64; 3]) -> Vec<String> {
    let known = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
    let mut cells = vec![pass.passes.to_string()];
    cells.extend(residuals.map(number));
    cells.extend([known(pass.largest_change_n_s), known(pass.largest_share)]);
    cells
}

fn rule_cells(tolerance: &Tolerance, outcome: &Outcome) -> Vec<String> {
    let most = |passes: &[Pass]| passes.last().map_or(0, |pass| pass.passes);
    let mut cells = vec![format!("{:.0e}", tolerance.tolerance)];
    for (rules, most) in
        [(tolerance.contact, most(&outcome.contact)), (tolerance.friction, most(&outcome.friction))]
    {
        let passes =
            |found: Option<u32>| found.map_or_else(|| format!("> {most}"), |n| n.to_string());
        cells.extend([rules.residual, rules.largest_change, rules.each_change].map(passes));
    }
    cells
}
