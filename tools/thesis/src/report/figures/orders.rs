//! Figures 4.2 and 4.9: how far the order of the collisions alone leads positions apart.

use super::super::studies::{Effort, Studied, below, percent, spread};
use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::{Axis, Drawn, Series, lines};
use crate::index::{Origin, Row};
use crate::study::determinism::{Outcome, Point};
use crate::study::recorded::{FLOAT_AGAINST_GPU, TWO_GPU_RUNS};
use pgs_command::failure::Failure;

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
        thesis: "§4.5, Figure 4.2",
        title: "Deviation of positions between two executions, step by step".to_owned(),
        svg: lines(Axis::linear("step"), Axis::log("mean deviation (eq. 4.1), %"), &series),
        caption: format!(
            "{}: the runs differ by the order of their collisions alone, and the GPU's order is {}. The \
             thesis does not say after how many steps its snapshots were taken.",
            many.subject,
            source(&many.outcome)
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
        thesis: "§4.6.3, Figure 4.9",
        title: "Deviation of positions between the order as given and the GPU's".to_owned(),
        svg: spread(series, &FLOAT_AGAINST_GPU),
        caption: format!(
            "Both orders are solved on the emulated board: no GPU takes part. One step: {}, the GPU's order \
             {}. Many: {}, the GPU's order {}; {}. A step moves a body by centimetres, its position is \
             metres: one step leads to less than the thesis' figures.",
            one.subject,
            source(&one.outcome),
            many.subject,
            source(&many.outcome),
            match step_of_recorded_share(&many.outcome) {
                Some(step) =>
                    format!("in step {step} the share below 1 % first falls to the thesis'"),
                None => "the share below 1 % stays above the thesis'".to_owned(),
            }
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

/// The source of the order that stands for the GPU's.
fn source(outcome: &Outcome) -> String {
    match outcome.gpu_order {
        "cells" => "reconstructed by Bullet's cells and batches (cells)".to_owned(),
        file => format!("as Bullet recorded it ({file})"),
    }
}

/// The steps after which a study compares.
fn after(studied: &Studied<Outcome>) -> String {
    match studied.outcome.gpu.curve.last().map_or(0, |at| at.step) {
        1 => "after one step".to_owned(),
        steps => format!("after {steps} steps"),
    }
}

/// The rows of one study; its command prints their figures.
fn rows(studied: &Studied<Outcome>) -> Vec<Row> {
    let after = after(studied);
    let row = |figure: &str, shown: &str, subject: String, recorded: String, ours| Row {
        thesis: figure.to_owned(),
        subject: format!("{subject}, {after}"),
        recorded,
        ours,
        origin: Origin::Measured,
        command: studied.command.clone(),
        shown: shown.to_owned(),
    };
    let mut rows = Vec::new();
    if let Some(last) = studied.outcome.over_pairs.last() {
        let [low, high] = TWO_GPU_RUNS.mean_percent;
        let of = last.position_mean_percent;
        rows.push(row(
            TWO_GPU_RUNS.thesis,
            "figure-4-2",
            "mean deviation of positions between two random orders; the thesis compares two executions on the GPU"
                .to_owned(),
            format!("{low} % to {high} %"),
            match studied.outcome.pairs.len() {
                1 => format!("{:.4} %", of.mean),
                pairs => {
                    format!("{:.4} ± {:.4} % ({pairs} pairs)", of.mean, of.standard_deviation)
                }
            },
        ));
    }
    if let Some(last) = studied.outcome.gpu.curve.last() {
        let position = last.state.position;
        let orders = format!(
            "the order as given against the GPU's order ({}), both on the emulated board",
            studied.outcome.gpu_order
        );
        for (what, recorded, ours) in [
            (
                "positions that deviate by less than 1 %",
                format!("{:.2} %", recorded_share()),
                percent(position.under_share()),
            ),
            (
                "mean deviation of positions",
                format!("{} %", FLOAT_AGAINST_GPU.mean_percent[0]),
                format!("{:.4} %", position.mean * 100.0),
            ),
        ] {
            let subject = format!("{what}: {orders}");
            rows.push(row(FLOAT_AGAINST_GPU.thesis, "figure-4-9", subject, recorded, ours));
        }
    }
    rows
}

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (one, many) = (effort.orders_of_one_step()?, effort.orders_of_many_steps()?);
    let figures = vec![over_steps(&many)?, after_steps(&one, &many)?];
    Ok(Part { figures, rows: [rows(&one), rows(&many)].concat(), ..Part::default() })
}
