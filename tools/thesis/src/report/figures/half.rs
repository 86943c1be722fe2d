//! Figure 4.10: positions in sixteen bits against float, after one step and after many.

use super::super::studies::{Effort, Studied, below, percent, spread};
use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::{Axis, Drawn, Series, lines};
use crate::index::{Origin, Row};
use crate::study::half::{OfBuild, Outcome};
use crate::study::recorded::{HALF_AGAINST_FLOAT, SIXTEEN_BITS, SIXTEEN_BITS_RANGE};
use pgs_command::failure::Failure;
use pgs_command::numbers::number;

/// The meaning of a build's name.
fn meaning(build: &str) -> Option<&'static str> {
    Some(match build {
        "half" => "half has binary16 throughout, rounded to nearest",
        "half,thesis16" => {
            "half,thesis16 has the thesis' own sixteen bits (§4.6.4): the top bit and the four low bits of \
             the exponent, ten of the mantissa by truncation, and no zero; smaller numbers become the \
             smallest"
        }
        "half,thesis16-literal" => {
            "half,thesis16-literal takes the thesis' encoder literally, which cuts three bits out of the \
             exponent whatever they are, so that small numbers read as large ones"
        }
        _ => return None,
    })
}

/// The meanings of all builds of a study.
fn explained(outcome: &Outcome) -> String {
    let meanings = outcome.builds.iter().filter_map(|build| meaning(&build.build));
    let failed = outcome.builds.iter().filter_map(|build| {
        let failed = build.failed.as_ref()?;
        Some(format!("{} ends in step {}: {}", build.build, failed.step, failed.error))
    });
    let sentences: Vec<String> = meanings.map(str::to_owned).chain(failed).collect();
    sentences.join(". ") + "."
}

fn after_one_step(one: &Studied<Outcome>) -> Result<Figure, Failure> {
    let of = |build: &OfBuild| {
        let points = build.position_histogram.as_ref().map(below)?;
        Some(Series::new(build.build.clone(), Drawn::Line, points))
    };
    let series: Vec<Series> = one.outcome.builds.iter().filter_map(of).collect();
    Ok(Figure {
        id: "figure-4-10",
        thesis: HALF_AGAINST_FLOAT.thesis,
        title: "Deviation of positions in sixteen bits from those of float".to_owned(),
        svg: spread(series, &HALF_AGAINST_FLOAT),
        caption: format!("{}. {}", one.subject, explained(&one.outcome)),
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
        svg: lines(Axis::linear("step"), Axis::log("kinetic energy, kJ"), &series),
        caption: format!(
            "{}. The thesis judges half by one step. {}",
            many.subject,
            explained(&many.outcome)
        ),
        origin: Origin::Measured,
        playback: None,
    })
}

/// The thesis' comparison, for a build that it describes.
fn recorded(build: &str) -> String {
    if !build.starts_with("half") {
        return "not in the thesis".to_owned();
    }
    let share = HALF_AGAINST_FLOAT.under_1_percent_share.unwrap_or_default();
    format!("{} %, {:.2} %", HALF_AGAINST_FLOAT.mean_percent[0], share * 100.0)
}

/// A row for each build, after one step.
fn deviations(one: &Studied<Outcome>) -> impl Iterator<Item = Row> {
    one.outcome.builds.iter().map(|build| {
        let ours = match (build.curve.last(), &build.failed) {
            (Some(at), _) => {
                let position = at.state.position;
                let share = percent(position.under_share());
                format!("{:.4} %, {share}", position.mean * 100.0)
            }
            (None, Some(failed)) => format!("step {} fails on the board", failed.step),
            (None, None) => "no step".to_owned(),
        };
        Row {
            thesis: HALF_AGAINST_FLOAT.thesis.to_owned(),
            subject: format!(
                "{} against float: mean deviation of positions, positions within 1 %",
                build.build
            ),
            recorded: recorded(&build.build),
            ours,
            origin: Origin::Measured,
            command: one.command.clone(),
            shown: "figure-4-10".to_owned(),
        }
    })
}

/// The kinetic energies after many steps.
fn energy(many: &Studied<Outcome>) -> Option<Row> {
    let ratio = |build: &OfBuild| {
        let last = build.curve.last()?;
        let (ratio, step) = (last.energy_ratio?, last.step);
        Some(format!("{} {ratio:.1} times float's after {step} steps", build.build))
    };
    let ratios: Vec<String> = many.outcome.builds.iter().filter_map(ratio).collect();
    (!ratios.is_empty()).then(|| Row {
        thesis: "§4.6.3".to_owned(),
        subject: "kinetic energy of the pile in each format".to_owned(),
        recorded: "not given".to_owned(),
        ours: ratios.join(", "),
        origin: Origin::Measured,
        command: many.command.clone(),
        shown: "figure-half-energy".to_owned(),
    })
}

/// The forms of sixteen bits on the numbers of the step: their layout, and their range.
fn layouts(one: &Studied<Outcome>) -> Vec<Row> {
    let row = |thesis: &str, subject: String, recorded: String, ours: String| Row {
        thesis: thesis.to_owned(),
        subject,
        recorded,
        ours,
        origin: Origin::Measured,
        command: one.command.clone(),
        shown: "figure-4-10".to_owned(),
    };
    let mut rows: Vec<Row> = Vec::new();
    for split in &one.outcome.splits {
        let (layout, range) = match split.format {
            "binary16" => ("§4.6.1, Figures 4.3 and 4.4", None),
            "thesis16" | "thesis16-literal" => {
                ("§4.6.4, Figures 4.11 and 4.12", Some(SIXTEEN_BITS_RANGE))
            }
            _ => continue,
        };
        let [exponent, mantissa] = SIXTEEN_BITS;
        rows.push(Row {
            origin: Origin::Modelled,
            ..row(
                layout,
                format!("bits of exponent and mantissa: {}", split.format),
                format!("{exponent} and {mantissa}"),
                format!("{} and {}", split.exponent_bits, split.mantissa_bits),
            )
        });
        if let Some([smallest, largest]) = range {
            rows.push(row(
                layout,
                format!("range of {}, and its errors on the numbers of the step", split.format),
                format!("{smallest:e} to {largest}, no errors given"),
                format!(
                    "from {:.5e}; {:.3} % of the numbers are smaller, mean error {} %, {} below 1 %",
                    split.smallest,
                    split.below_smallest_share * 100.0,
                    number(split.relative_mean_percent),
                    percent(split.under_1_percent_share)
                ),
            ));
        }
    }
    rows
}

pub(crate) fn part(effort: &Effort<'_>) -> Result<Part, Failure> {
    let (one, many) = (effort.half_of_one_step()?, effort.half_of_many_steps()?);
    let figures = vec![after_one_step(&one)?, energies(&many)?];
    let mut rows: Vec<Row> = deviations(&one).chain(energy(&many)).collect();
    rows.extend(layouts(&one));
    Ok(Part { figures, rows, ..Part::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_figure_stands_beside_its_own_builds_alone() {
        for build in ["half", "half,thesis16", "half,thesis16-literal"] {
            assert_eq!(recorded(build), "0.06 %, 99.64 %");
            assert!(meaning(build).is_some_and(|text| text.starts_with(build)), "{build}");
        }
        assert_eq!(recorded("naive"), "not in the thesis");
    }
}
