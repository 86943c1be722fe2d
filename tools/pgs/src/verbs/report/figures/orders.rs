//! Figures 4.2 and 4.9: how far the order of the collisions alone leads positions apart.

use super::super::chart::{Axis, Drawn, Series, lines};
use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::{Effort, Studied, below, percent};
use crate::failure::Failure;
use crate::verbs::study::determinism::{Outcome, Point};

/// The band of Figure 4.2, percent.
const RECORDED_BAND: [f64; 2] = [1.0, 3.0];
/// The point of Figure 4.9: share of positions below 1 %.
const RECORDED_SHARE: f64 = 84.29;

/// The mean deviation after each step, percent.
fn means(outcome: &Outcome) -> Vec<(f64, f64)> {
    let step = |step: u32| f64::from(step);
    outcome.over_pairs.iter().map(|at| (step(at.step), at.position_mean_percent.mean)).collect()
}

/// The first step after which the share of positions within 1 % of the GPU's is at most the thesis'.
fn step_of_recorded_share(outcome: &Outcome) -> Option<u32> {
    let below = |at: &&Point| at.state.position.under_share() * 100.0 <= RECORDED_SHARE;
    outcome.gpu.curve.iter().find(below).map(|at| at.step)
}

fn over_steps(many: &Studied<Outcome>) -> Result<Figure, Failure> {
    let outcome = &many.outcome;
    let gpu = outcome.gpu.curve.iter();
    let gpu = gpu.map(|at| (f64::from(at.step), at.state.position.mean * 100.0)).collect();
    let last = outcome.over_pairs.last().map_or(1.0, |at| f64::from(at.step));
    let band = |share: f64| vec![(1.0, share), (last, share)];
    let series = [
        Series::new("two random orders", Drawn::Line, means(outcome)),
        Series::new("as given against the GPU's", Drawn::Line, gpu),
        Series::new("1 %, recorded", Drawn::Dashes, band(RECORDED_BAND[0])),
        Series::new("3 %, recorded", Drawn::Dashes, band(RECORDED_BAND[1])),
    ];
    Ok(Figure {
        id: "figure-4-2",
        thesis: "Figure 4.2",
        title: "Deviation of positions between two executions, step by step".to_owned(),
        svg: lines(Axis::linear("step"), Axis::log("mean deviation (eq. 4.1), %"), &series)?,
        caption: format!(
            "{}: the runs differ by the order of their collisions alone. The thesis does not say how \
             many steps lie between its two executions.",
            many.subject
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

fn after_steps(one: &Studied<Outcome>, many: &Studied<Outcome>) -> Result<Figure, Failure> {
    let mut series = Vec::new();
    let gpu = |outcome: &Outcome| outcome.gpu.position_histogram.as_ref().map(below);
    let pairs = |outcome: &Outcome| outcome.pairs_position_histogram.as_ref().map(below);
    let steps = many.outcome.over_pairs.last().map_or(0, |at| at.step);
    for (name, points) in [
        ("as given against the GPU's, one step".to_owned(), gpu(&one.outcome)),
        ("random orders, one step".to_owned(), pairs(&one.outcome)),
        (format!("as given against the GPU's, {steps} steps"), gpu(&many.outcome)),
        (format!("random orders, {steps} steps"), pairs(&many.outcome)),
    ] {
        series.extend(points.map(|points| Series::new(name, Drawn::Line, points)));
    }
    series.push(Series::new(
        "84.29 % below 1 %, recorded",
        Drawn::Marked,
        vec![(1.0, RECORDED_SHARE)],
    ));
    Ok(Figure {
        id: "figure-4-9",
        thesis: "Figure 4.9",
        title: "Deviation of positions between the accelerator's order and the GPU's".to_owned(),
        svg: lines(
            Axis::log("deviation (eq. 4.1), %"),
            Axis::linear("positions that deviate by less, %"),
            &series,
        )?,
        caption: format!(
            "One step: {}, the GPU's order from {}. Many: {}. A step moves a body by \
             centimetres, its position is metres: one step leads to less than the thesis' figures.",
            one.subject, one.outcome.gpu_order, many.subject
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (one, many) = (effort.orders_of_one_step()?, effort.orders_of_many_steps()?);
    let figures = vec![over_steps(&many)?, after_steps(&one, &many)?];
    let mut rows = Vec::new();
    let mut row = |thesis: &str,
                   subject: &str,
                   recorded: &str,
                   ours,
                   studied: &Studied<Outcome>,
                   shown: &str| {
        rows.push(Row {
            thesis: thesis.to_owned(),
            subject: subject.to_owned(),
            recorded: recorded.to_owned(),
            ours,
            origin: Origin::Measured,
            command: studied.command.clone(),
            shown: shown.to_owned(),
        });
    };
    let (first, last) = (one.outcome.over_pairs.last(), many.outcome.over_pairs.last());
    if let (Some(first), Some(last)) = (first, last) {
        row(
            "§4.5, Figure 4.2",
            "mean deviation of two executions",
            "1 % to 3 %",
            format!(
                "{:.4} ± {:.4} % after one step, {:.2} % after {}",
                first.position_mean_percent.mean,
                first.position_mean_percent.standard_deviation,
                last.position_mean_percent.mean,
                last.step
            ),
            &many,
            "figure-4-2",
        );
    }
    let ends = (one.outcome.gpu.curve.last(), many.outcome.gpu.curve.last());
    if let (Some(first), Some(last)) = ends {
        let [one_step, steps] = [first, last].map(|at| at.state.position);
        let reached = match step_of_recorded_share(&many.outcome) {
            Some(step) => format!("{RECORDED_SHARE} % is passed in step {step}"),
            None => format!("{} after {} steps", percent(steps.under_share()), last.step),
        };
        row(
            "§4.6.3, Figure 4.9",
            "positions of the accelerator that deviate from the GPU's by less than 1 %",
            "84.29 %",
            format!("{} after one step; of our pile {reached}", percent(one_step.under_share())),
            &one,
            "figure-4-9",
        );
        row(
            "§4.6.3, Figure 4.9",
            "mean deviation of the accelerator's positions from the GPU's",
            "2.97 %",
            format!(
                "{:.4} % after one step; of our pile {:.2} % after {}",
                one_step.mean * 100.0,
                steps.mean * 100.0,
                last.step
            ),
            &one,
            "figure-4-9",
        );
    }
    Ok(Part { figures, rows })
}
