//! The rules that stop an iterative solver (§2.2.3), and the shares of a step (§4.4).

use crate::estimate::thesis;

use super::super::studies::{Effort, Studied};
use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::{Axis, Drawn, Series, bars, lines};
use crate::index::{Origin, Row};
use crate::study::split;
use crate::study::stopping::Pass;
use pgs_command::failure::Failure;

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (stopping, split) = (effort.stopping()?, effort.split()?);
    let outcome = &stopping.outcome;
    let residuals = |passes: &[Pass], of: fn(&Pass) -> f64| -> Vec<(f64, f64)> {
        passes.iter().map(|pass| (f64::from(pass.passes), of(pass))).collect()
    };
    let contact = |pass: &Pass| pass.residuals.contact.rms;
    let friction = |pass: &Pass| pass.residuals.friction.rms;
    let series = [
        Series::new("contact passes", Drawn::Line, residuals(&outcome.contact, contact)),
        Series::new(
            format!("friction passes behind {} contact passes", outcome.contact_iterations),
            Drawn::Line,
            residuals(&outcome.friction, friction),
        ),
    ];
    let figure = Figure {
        id: "figure-stopping",
        thesis: "§2.2.3",
        title: "Residual of the contact problem after each pass".to_owned(),
        svg: lines(Axis::linear("passes"), Axis::log("residual (root mean square), m/s"), &series),
        caption: format!("{}. The thesis stops after {}.", outcome.step, fixed()),
        origin: Origin::Measured,
        playback: None,
    };
    let passes = |passes: Option<u32>, all: &[Pass]| {
        let most = all.last().map_or(0, |pass| pass.passes);
        passes.map_or_else(|| format!("more than {most}"), |passes| passes.to_string())
    };
    let ours = outcome.tolerances.iter().map(|at| {
        format!(
            "{:.0e}: {} contact, {} friction",
            at.tolerance,
            passes(at.contact.residual, &outcome.contact),
            passes(at.friction.residual, &outcome.friction)
        )
    });
    let mut rows = vec![Row {
        thesis: "§2.2.3".to_owned(),
        subject: "passes until the residual has fallen to a share of its first value".to_owned(),
        recorded: fixed(),
        ours: ours.collect::<Vec<_>>().join("; "),
        origin: Origin::Measured,
        command: stopping.command,
        shown: figure.id.to_owned(),
    }];
    let mut figures = vec![figure];
    if let Some((figure, row)) = shares(split)? {
        figures.push(figure);
        rows.push(row);
    }
    Ok(Part { figures, rows, ..Part::default() })
}

/// The thesis' stopping rule; its number of passes is inferred.
fn fixed() -> String {
    let passes = thesis::step().passes();
    format!("a fixed number of passes, not printed; {passes} by its cycles (inferred)")
}

/// Search and response of a step, percent.
fn both(response: f64) -> [f64; 2] {
    [100.0 - 100.0 * response, 100.0 * response]
}

/// The shares of search and response; none without a measured step.
fn shares(split: Studied<split::Outcome>) -> Result<Option<(Figure, Row)>, Failure> {
    let outcome = &split.outcome;
    let Some(share) = outcome.response_share else { return Ok(None) };
    let (recorded, ours) = (both(outcome.recorded_share), both(share));
    let figure = Figure {
        id: "figure-shares",
        thesis: "§4.4",
        title: "Shares of collision search and collision response".to_owned(),
        svg: bars(
            "% of both",
            &["search", "response"].map(str::to_owned),
            &["recorded", "measured"].map(str::to_owned),
            &[0, 1].map(|part| vec![Some(recorded[part]), Some(ours[part])]),
        ),
        caption: format!(
            "{}, in processor time of one thread of this host. The thesis names neither its processor nor \
             its program for the shares.",
            split.subject
        ),
        origin: Origin::Measured,
        playback: None,
    };
    let shown = |[search, response]: [f64; 2], digits: usize| {
        format!("{search:.digits$} % search, {response:.digits$} % response")
    };
    let row = Row {
        thesis: figure.thesis.to_owned(),
        subject: "shares of a step".to_owned(),
        recorded: shown(recorded, 0),
        ours: format!("{}, on one core of this host", shown(ours, 1)),
        origin: Origin::Measured,
        command: split.command,
        shown: figure.id.to_owned(),
    };
    Ok(Some((figure, row)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_stops_after_a_number_that_it_does_not_print() {
        let text = fixed();
        assert!(text.contains("not printed; 8 by its cycles (inferred)"), "{text}");
        assert!(!text.contains('4'), "{text}");
    }

    #[test]
    fn search_is_what_the_response_leaves() {
        let [search, response] = both(0.6);
        assert!((search - 40.0).abs() < 1e-9 && (response - 60.0).abs() < 1e-9);
    }
}
