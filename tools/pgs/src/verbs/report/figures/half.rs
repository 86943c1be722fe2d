//! Figure 4.10: positions in sixteen bits against float, after one step and after many.

use super::super::chart::{Axis, Drawn, Series, lines};
use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::{Effort, Studied, below, percent};
use crate::failure::Failure;
use crate::verbs::study::half::Outcome;

fn spread(one: &Studied<Outcome>) -> Result<Figure, Failure> {
    let of = |build: &crate::verbs::study::half::OfBuild| {
        let points = build.position_histogram.as_ref().map(below)?;
        Some(Series::new(build.build.clone(), Drawn::Line, points))
    };
    let mut series: Vec<Series> = one.outcome.builds.iter().filter_map(of).collect();
    series.push(Series::new("99.64 % below 1 %, recorded", Drawn::Marked, vec![(1.0, 99.64)]));
    Ok(Figure {
        id: "figure-4-10",
        thesis: "Figure 4.10",
        title: "Deviation of positions in sixteen bits from those of float".to_owned(),
        svg: lines(
            Axis::log("deviation (eq. 4.1), %"),
            Axis::linear("positions that deviate by less, %"),
            &series,
        )?,
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

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (one, many) = (effort.half_of_one_step()?, effort.half_of_many_steps()?);
    let figures = vec![spread(&one)?, energies(&many)?];
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
            "0.06 %",
            format!("{mean:.4} %"),
            &one,
            "figure-4-10",
        ));
        rows.push(row(
            "positions of half within 1 % of float's",
            "99.64 %",
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
