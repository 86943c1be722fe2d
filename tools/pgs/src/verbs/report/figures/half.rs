//! Figure 4.10: positions in sixteen bits against float, after one step and after many.

use super::super::chart::{Axis, Drawn, Series, lines};
use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::{Effort, Studied, below, percent, spread};
use crate::failure::Failure;
use crate::verbs::study::half::{OfBuild, Outcome};
use crate::verbs::study::recorded::HALF_AGAINST_FLOAT;

fn after_one_step(one: &Studied<Outcome>) -> Result<Figure, Failure> {
    let of = |build: &OfBuild| {
        let points = build.position_histogram.as_ref().map(below)?;
        Some(Series::new(build.build.clone(), Drawn::Line, points))
    };
    let series: Vec<Series> = one.outcome.builds.iter().filter_map(of).collect();
    Ok(Figure {
        id: "figure-4-10",
        thesis: "Figure 4.10",
        title: "Deviation of positions in sixteen bits from those of float".to_owned(),
        svg: spread(series, &HALF_AGAINST_FLOAT)?,
        caption: format!(
            "{}. half has 16 bits throughout, as the thesis; mixed has collisions of 16 bits relative to \
             body A, and poses in 32.",
            one.subject
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

fn energies(many: &Studied<Outcome>) -> Result<Figure, Failure> {
    let outcome = &many.outcome;
    let float = (0_u32..).zip(&outcome.float_kinetic_energy_j);
    let float = float.map(|(step, energy)| (f64::from(step), energy / 1e3)).collect();
    let mut series = vec![Series::new("float", Drawn::Line, float)];
    for build in &outcome.builds {
        let points = build.curve.iter().map(|at| (f64::from(at.step), at.kinetic_energy_j / 1e3));
        series.push(Series::new(build.build.clone(), Drawn::Line, points.collect()));
    }
    Ok(Figure {
        id: "figure-half-energy",
        thesis: "§4.6.3",
        title: "Kinetic energy of the falling pile in each format".to_owned(),
        svg: lines(Axis::linear("step"), Axis::log("kinetic energy, kJ"), &series)?,
        caption: format!(
            "{}. The thesis judges half by one step. mixed has poses in \
             32 bits.",
            many.subject
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

/// A recorded share with the two digits that the thesis prints.
fn percent_of(share: Option<f64>) -> String {
    share.map_or_else(|| "not given".to_owned(), |share| format!("{:.2} %", share * 100.0))
}

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (one, many) = (effort.half_of_one_step()?, effort.half_of_many_steps()?);
    let figures = vec![after_one_step(&one)?, energies(&many)?];
    let mut rows = Vec::new();
    let half = |outcome: &Outcome| {
        outcome.builds.iter().find(|build| build.build == "half")?.curve.last().cloned()
    };
    let row = |subject: &str, recorded: &str, ours, studied: &Studied<Outcome>, shown: &str| Row {
        thesis: "§4.6.3, Figure 4.10".to_owned(),
        subject: subject.to_owned(),
        recorded: recorded.to_owned(),
        ours,
        origin: Origin::Measured,
        command: studied.command.clone(),
        shown: shown.to_owned(),
    };
    if let Some(at) = half(&one.outcome) {
        let position = at.state.position;
        let (mean, share) = (position.mean * 100.0, percent(position.under_share()));
        rows.push(row(
            "mean deviation of half from float",
            &format!("{} %", HALF_AGAINST_FLOAT.mean_percent[0]),
            format!("{mean:.4} %"),
            &one,
            "figure-4-10",
        ));
        rows.push(row(
            "positions of half within 1 % of float's",
            &percent_of(HALF_AGAINST_FLOAT.under_1_percent_share),
            share,
            &one,
            "figure-4-10",
        ));
    }
    let ratios: Vec<String> = many
        .outcome
        .builds
        .iter()
        .filter_map(|build| {
            let last = build.curve.last()?;
            Some(format!(
                "{} {:.1} times float's after {} steps",
                build.build, last.energy_ratio?, last.step
            ))
        })
        .collect();
    if !ratios.is_empty() {
        let recorded = "not given";
        rows.push(row(
            "kinetic energy of the pile in each format",
            recorded,
            ratios.join(", "),
            &many,
            "figure-half-energy",
        ));
    }
    Ok(Part { figures, rows })
}
