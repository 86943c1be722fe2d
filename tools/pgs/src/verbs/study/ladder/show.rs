//! Shows the ladder: a table, and the formula of each design.

use std::io::{self, Write};

use super::{Outcome, Rung};
use crate::numbers::grouped;
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const COLUMNS: [Column; 11] = [
    Column { name: "design", unit: "", width: 22 },
    Column { name: "streams", unit: "cycles", width: 7 },
    Column { name: "ports", unit: "cycles", width: 6 },
    Column { name: "each", unit: "coll.", width: 5 },
    Column { name: "cycles", unit: "modelled", width: 13 },
    Column { name: "thesis", unit: "recorded", width: 9 },
    Column { name: "time", unit: "ms", width: 9 },
    Column { name: "12.8 GB/s", unit: "ms", width: 9 },
    Column { name: "factor", unit: "", width: 6 },
    Column { name: "in all", unit: "", width: 7 },
    Column { name: "bound by", unit: "", width: 8 },
];

/// Shows the ladder.
pub(in super::super) fn show(outcome: &Outcome, out: &mut dyn Write) -> io::Result<()> {
    let step = format!(
        "{} bodies, {} collisions, {} passes; numbers as the thesis packs them",
        grouped(outcome.bodies),
        grouped(outcome.collisions),
        outcome.passes
    );
    fact(out, "step", &step)?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    for rung in &outcome.rungs {
        line(out, &COLUMNS, cells(rung))?;
    }
    writeln!(out)?;
    for rung in &outcome.rungs {
        let range = match rung.cycles_most > rung.cycles {
            true => format!("; up to {} cycles", grouped(rung.cycles_most)),
            false => String::new(),
        };
        let text =
            format!("{} ({}): {} = {}{range}", rung.design, rung.thesis, rung.change, rung.formula);
        fact(out, "", &text)?;
    }
    Ok(())
}

fn cells(rung: &Rung) -> [String; COLUMNS.len()] {
    let interval = |cycles: Option<u32>| cycles.map_or_else(|| "-".to_owned(), |c| c.to_string());
    let factor = |factor: f64| format!("{factor:.2}");
    [
        format!("{:<22}", rung.design),
        interval(rung.interval_by_streams),
        interval(rung.interval_by_ports),
        rung.collisions_per_issue.to_string(),
        grouped(rung.cycles),
        rung.recorded_cycles.map_or_else(|| "-".to_owned(), grouped),
        format!("{:.3}", rung.milliseconds),
        format!("{:.3}", rung.milliseconds_sustained),
        rung.factor.map_or_else(|| "-".to_owned(), factor),
        format!("{:.1}", rung.factor_in_all),
        rung.bound_by.to_owned(),
    ]
}
