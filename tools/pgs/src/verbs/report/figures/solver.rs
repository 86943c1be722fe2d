//! The rules that stop an iterative solver (§2.2.3), and the shares of a step (§4.4).

use super::super::chart::{Axis, Drawn, Series, lines};
use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::{Effort, percent};
use crate::failure::Failure;
use crate::verbs::study::stopping::Pass;

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
            "friction passes behind 4 contact passes",
            Drawn::Line,
            residuals(&outcome.friction, friction),
        ),
    ];
    let figure = Figure {
        id: "figure-stopping",
        thesis: "§2.2.3",
        title: "Residual of the contact problem after each pass".to_owned(),
        svg: lines(Axis::linear("passes"), Axis::log("residual (root mean square), m/s"), &series)?,
        caption: format!(
            "{}. The thesis stops after a fixed number of passes, 4 and 4.",
            outcome.step
        ),
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
        recorded: "a fixed number, 4 and 4".to_owned(),
        ours: ours.collect::<Vec<_>>().join("; "),
        origin: Origin::Measured,
        command: stopping.command,
        shown: figure.id.to_owned(),
    }];
    let shares = &split.outcome;
    if let Some(share) = shares.response_share {
        rows.push(Row {
            thesis: "§4.4".to_owned(),
            subject: "share of collision response in a step, the rest is the search".to_owned(),
            recorded: format!(
                "{:.0} % response, the rest is the search",
                shares.recorded_share * 100.0
            ),
            ours: format!("{} response on one core of this host", percent(share)),
            origin: Origin::Measured,
            command: split.command,
            shown: "table-comparison".to_owned(),
        });
    }
    Ok(Part { figures: vec![figure], rows })
}
