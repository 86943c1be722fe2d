//! Shows both scenes, a table each.

use std::io::{self, Write};

use super::{Flight, Outcome, Row};
use crate::numbers::{grouped, number};
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const FLIGHT: [Column; 4] = [
    Column { name: "dt", unit: "s", width: 6 },
    Column { name: "explicit", unit: "mm off", width: 10 },
    Column { name: "symplectic", unit: "mm off", width: 10 },
    Column { name: "board", unit: "mm off", width: 10 },
];

const PILE: [Column; 8] = [
    Column { name: "dt", unit: "s", width: 6 },
    Column { name: "steps", unit: "", width: 6 },
    Column { name: "deepest", unit: "mm", width: 9 },
    Column { name: "at end", unit: "mm", width: 9 },
    Column { name: "kinetic", unit: "J at end", width: 10 },
    Column { name: "distance", unit: "m", width: 9 },
    Column { name: "cycles", unit: "a second", width: 13 },
    Column { name: "board", unit: "ms/second", width: 10 },
];

/// Shows the outcome.
pub(in super::super) fn show(outcome: &Outcome, out: &mut dyn Write) -> io::Result<()> {
    let Outcome { grid, drop_m, seconds, iterations, rows, .. } = outcome;
    let millimetres = |metres: f64| number(metres * 1e3);
    let dt = |row: &Row| format!("1/{}", row.steps_per_second);
    fact(out, "flight", &format!("{seconds} s, thrown at 3 m/s sideways and 8 m/s up"))?;
    writeln!(out)?;
    heading(out, &FLIGHT)?;
    for row in rows {
        let Flight { explicit_m, symplectic_m, board_m } = row.flight;
        let off = [explicit_m, symplectic_m, board_m].map(millimetres);
        line(out, &FLIGHT, [dt(row)].into_iter().chain(off))?;
    }
    writeln!(out)?;
    let text = format!(
        "{grid} cubes dropped from {drop_m} m, {seconds} s, {iterations} + {iterations} iterations"
    );
    fact(out, "pile", &text)?;
    writeln!(out)?;
    heading(out, &PILE)?;
    for row in rows {
        let pile = &row.pile;
        let cells = [
            dt(row),
            grouped(pile.steps.into()),
            format!("{:.1}", pile.deepest_m * 1e3),
            format!("{:.1}", pile.deepest_at_end_m * 1e3),
            number(pile.kinetic_at_end_j),
            number(pile.distance_from_shortest_m),
            format!("{:.3e}", pile.cycles_per_second),
            format!("{:.2}", pile.board_ms_per_second),
        ];
        line(out, &PILE, cells)?;
    }
    Ok(())
}
