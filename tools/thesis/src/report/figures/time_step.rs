//! Figure 2.2: accuracy and cost against the time step.

use super::super::studies::Effort;
use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::{Axis, Drawn, Series, lines};
use crate::index::{Origin, Row};
use pgs_command::failure::Failure;

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let studied = effort.time_steps()?;
    let rows = &studied.outcome.rows;
    let against = |of: &dyn Fn(&crate::study::time_step::Row) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|row| (row.time_step_s * 1e3, of(row))).collect()
    };
    let series = [
        Series::new(
            "body in flight, error in mm",
            Drawn::Marked,
            against(&|row| row.flight.board_m * 1e3),
        ),
        Series::new(
            "pile, deepest penetration in mm",
            Drawn::Marked,
            against(&|row| row.pile.deepest_m * 1e3),
        ),
        Series::new(
            "board time of a simulated second, ms",
            Drawn::Marked,
            against(&|row| row.pile.board_ms_per_second),
        ),
    ];
    let figure = Figure {
        id: "figure-2-2",
        thesis: "§2.1.1, Figure 2.2",
        title: "Speed and accuracy against the time step".to_owned(),
        svg: lines(Axis::linear("time step, ms"), Axis::log("error in mm, cost in ms"), &series),
        caption: format!(
            "{}. A shorter step costs more board time (modelled) a simulated second, and leaves smaller \
             errors (measured).",
            studied.subject
        ),
        origin: Origin::Measured,
        playback: None,
    };
    let at = |rate: u16| rows.iter().find(|row| row.steps_per_second == rate);
    let ours = [480, 60, 15].into_iter().filter_map(at).map(|row| {
        format!(
            "1/{} s: {:.0} mm off, {:.1} ms a second",
            row.steps_per_second,
            row.flight.board_m * 1e3,
            row.pile.board_ms_per_second
        )
    });
    let row = Row {
        thesis: figure.thesis.to_owned(),
        subject: "accuracy against the time step".to_owned(),
        recorded: "a smaller step is more accurate and slower (no numbers)".to_owned(),
        ours: ours.collect::<Vec<_>>().join("; "),
        origin: Origin::Measured,
        command: studied.command,
        shown: figure.id.to_owned(),
    };
    Ok(Part { figures: vec![figure], rows: vec![row], ..Part::default() })
}
