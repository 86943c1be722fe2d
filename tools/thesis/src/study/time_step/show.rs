//! The tables of both scenes.

use super::{Flight, Options, Row};
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::index::Row as RowOfIndex;
use crate::table::{Cell, Table, text};

/// The facts, the tables and the figure of all time steps.
pub(super) fn part(options: &Options, rows: &[Row]) -> Part {
    let Options { grid, drop, seconds, iterations } = options;
    let mut flights =
        Table::new("flight", "A body in free flight: distance from its exact position at the end");
    let mut piles = Table::new("pile", "A pile of cubes");
    for row in rows {
        let dt = || text(format!("1/{}", row.steps_per_second));
        let Flight { explicit_m, symplectic_m, board_m } = row.flight;
        let [explicit, symplectic, board] =
            [explicit_m, symplectic_m, board_m].map(|metres| Cell::Digits(metres * 1e3));
        flights.row([
            ("time_step", "dt\ns", dt()),
            ("explicit_mm", "explicit\nmm off", explicit),
            ("symplectic_mm", "symplectic\nmm off", symplectic),
            ("board_mm", "board\nmm off", board),
        ]);
        let pile = &row.pile;
        piles.row([
            ("time_step", "dt\ns", dt()),
            ("steps", "steps", Cell::Whole(pile.steps.into())),
            ("deepest_mm", "deepest\nmm", Cell::Number(pile.deepest_m * 1e3, 1)),
            ("deepest_at_end_mm", "at end\nmm", Cell::Number(pile.deepest_at_end_m * 1e3, 1)),
            ("kinetic_at_end_j", "kinetic\nJ at end", Cell::Digits(pile.kinetic_at_end_j)),
            ("kinetic_most_j", "kinetic\nJ most", Cell::Digits(pile.kinetic_most_j)),
            (
                "distance_from_shortest_m",
                "distance\nm",
                Cell::Digits(pile.distance_from_shortest_m),
            ),
            ("cycles_per_second", "cycles\na second", Cell::Number(pile.cycles_per_second, 0)),
            ("board_ms_per_second", "board\nms/second", Cell::Number(pile.board_ms_per_second, 2)),
        ]);
    }
    let mut part = Part::of(vec![flights, piles]);
    part.fact("flight", format!("{seconds} s, thrown at 3 m/s sideways and 8 m/s up"));
    part.fact(
        "pile",
        format!(
            "{grid} cubes dropped from {drop} m, {seconds} s, {iterations} + {iterations} \
             iterations"
        ),
    );
    let (figure, row) = figure(options, rows);
    part.figure(figure, [row]);
    part
}

/// Figure 2.2: accuracy and cost against the time step.
fn figure(options: &Options, rows: &[Row]) -> (Figure, RowOfIndex) {
    let against = |name: &str, of: &dyn Fn(&Row) -> f64| {
        let points = rows.iter().map(|row| (row.time_step_s * 1e3, of(row)));
        Series::new(name, Drawn::Marked, points.collect())
    };
    let series = [
        against("body in flight, error in mm", &|row| row.flight.board_m * 1e3),
        against("pile, deepest penetration in mm", &|row| row.pile.deepest_m * 1e3),
        against("board time of a simulated second, ms", &|row| row.pile.board_ms_per_second),
    ];
    let figure = Figure::new(
        ("figure-2-2", "§2.1.1, Figure 2.2"),
        "Speed and accuracy against the time step",
        lines(Axis::linear("time step, ms"), Axis::log("error in mm, cost in ms"), &series),
        format!(
            "{} s of a pile of {} cubes. A shorter step costs more board time (modelled) a \
             simulated second, and leaves smaller errors (measured).",
            options.seconds, options.grid
        ),
    );
    let at = |rate: u16| rows.iter().find(|row| row.steps_per_second == rate);
    let ours = [480, 60, 15].into_iter().filter_map(at).map(|row| {
        let (rate, off) = (row.steps_per_second, row.flight.board_m * 1e3);
        format!("1/{rate} s: {off:.0} mm off, {:.1} ms a second", row.pile.board_ms_per_second)
    });
    let row = figure.row(
        "accuracy against the time step",
        "a smaller step is more accurate and slower (no numbers)",
        ours.collect::<Vec<_>>().join("; "),
    );
    (figure, row)
}
