//! Figures 4.2 and 4.9: how far the order of the collisions alone leads positions apart.

use super::super::chart::{Axis, Drawn, Series, lines};
use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::{Effort, Studied, below, percent, spread};
use crate::failure::Failure;
use crate::verbs::study::determinism::{Outcome, Point};
use crate::verbs::study::recorded::{FLOAT_AGAINST_GPU, TWO_GPU_RUNS};

/// The share of positions below 1 % in Figure 4.9, percent.
fn recorded_share() -> f64 {
    FLOAT_AGAINST_GPU.under_1_percent_share.unwrap_or_default() * 100.0
}

/// The mean deviation after each step, percent.
fn means(outcome: &Outcome) -> Vec<(f64, f64)> {
    let step = |step: u32| f64::from(step);
    outcome.over_pairs.iter().map(|at| (step(at.step), at.position_mean_percent.mean)).collect()
}

/// The first step after which the share of positions within 1 % of the GPU's is at most the thesis'.
fn step_of_recorded_share(outcome: &Outcome) -> Option<u32> {
    let below = |at: &&Point| at.state.position.under_share() * 100.0 <= recorded_share();
    outcome.gpu.curve.iter().find(below).map(|at| at.step)
}

fn over_steps(many: &Studied<Outcome>) -> Result<Figure, Failure> {
    let outcome = &many.outcome;
    let gpu = outcome.gpu.curve.iter();
    let gpu = gpu.map(|at| (f64::from(at.step), at.state.position.mean * 100.0)).collect();
    let last = outcome.over_pairs.last().map_or(1.0, |at| f64::from(at.step));
    let band = |percent: f64| vec![(1.0, percent), (last, percent)];
    let [low, high] = TWO_GPU_RUNS.mean_percent;
    let series = [
        Series::new("two random orders", Drawn::Line, means(outcome)),
        Series::new("as given against the GPU's", Drawn::Line, gpu),
        Series::new(format!("{low} %, recorded"), Drawn::Dashes, band(low)),
        Series::new(format!("{high} %, recorded"), Drawn::Dashes, band(high)),
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
    Ok(Figure {
        id: "figure-4-9",
        thesis: "Figure 4.9",
        title: "Deviation of positions between the accelerator's order and the GPU's".to_owned(),
        svg: spread(series, &FLOAT_AGAINST_GPU)?,
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
            &format!("{} % to {} %", TWO_GPU_RUNS.mean_percent[0], TWO_GPU_RUNS.mean_percent[1]),
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
            Some(step) => format!("{:.2} % is passed in step {step}", recorded_share()),
            None => format!("{} after {} steps", percent(steps.under_share()), last.step),
        };
        row(
            "§4.6.3, Figure 4.9",
            "positions of the accelerator that deviate from the GPU's by less than 1 %",
            &format!("{:.2} %", recorded_share()),
            format!("{} after one step; of our pile {reached}", percent(one_step.under_share())),
            &one,
            "figure-4-9",
        );
        row(
            "§4.6.3, Figure 4.9",
            "mean deviation of the accelerator's positions from the GPU's",
            &format!("{} %", FLOAT_AGAINST_GPU.mean_percent[0]),
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
