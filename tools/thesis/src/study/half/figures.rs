//! Figure 4.10: positions in sixteen bits against float, after one step; and energies after many.

use super::super::recorded::{HALF_AGAINST_FLOAT, SIXTEEN_BITS, SIXTEEN_BITS_RANGE, percent};
use super::{OfBuild, Outcome};
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::histogram::Histogram;
use crate::index::{Origin, Row};
use pgs_command::numbers::number;

/// The meaning of a build's name.
fn meaning(build: &str) -> Option<&'static str> {
    Some(match build {
        "half" => "half has binary16 throughout, rounded to nearest",
        "half,thesis16" => {
            "half,thesis16 has the thesis' own sixteen bits (§4.6.4): the top bit and the four low \
             bits of the exponent, ten of the mantissa by truncation, and no zero; smaller numbers \
             become the smallest"
        }
        "half,thesis16-literal" => {
            "half,thesis16-literal takes the thesis' encoder literally, which cuts three bits out \
             of the exponent whatever they are, so that small numbers read as large ones"
        }
        _ => return None,
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

impl OfBuild {
    /// The deviation of its positions, for the index.
    fn deviation(&self, figure: &Figure) -> Row {
        let ours = match (self.curve.last(), &self.failed) {
            (Some(at), _) => {
                let position = at.state.position;
                format!("{:.4} %, {}", position.mean * 100.0, percent(position.under_share()))
            }
            (None, Some(failed)) => format!("step {} fails on the board", failed.step),
            (None, None) => "no step".to_owned(),
        };
        let what = "against float: mean deviation of positions, positions within 1 %";
        figure.row(format!("{} {what}", self.build), recorded(&self.build), ours)
    }
}

impl Outcome {
    /// Adds the figure of one step, or of many.
    pub(super) fn add_figure(&self, part: &mut Part) {
        if self.float_unmoved_share.len() > 1 {
            let figure = self.energies();
            let row = self.energy(&figure);
            part.figure(figure, row);
            return;
        }
        let figure = self.positions();
        let rows = self.builds.iter().map(|build| build.deviation(&figure));
        let rows: Vec<Row> = rows.chain(self.layouts(&figure)).collect();
        part.figure(figure, rows);
    }

    /// The meanings of the builds.
    fn explained(&self) -> String {
        let meanings = self.builds.iter().filter_map(|build| meaning(&build.build));
        let failed = self.builds.iter().filter_map(|build| {
            let failed = build.failed.as_ref()?;
            Some(format!("{} ends in step {}: {}", build.build, failed.step, failed.error))
        });
        let sentences: Vec<String> = meanings.map(str::to_owned).chain(failed).collect();
        sentences.join(". ") + "."
    }

    fn positions(&self) -> Figure {
        let of = |build: &OfBuild| {
            let points = build.position_histogram.as_ref().map(Histogram::below)?;
            Some(Series::new(build.build.clone(), Drawn::Line, points))
        };
        Figure::new(
            ("figure-4-10", HALF_AGAINST_FLOAT.thesis),
            "Deviation of positions in sixteen bits from those of float",
            HALF_AGAINST_FLOAT.spread(self.builds.iter().filter_map(of).collect()),
            format!("{}. {}", self.subject, self.explained()),
        )
    }

    fn energies(&self) -> Figure {
        let float = (0_u32..).zip(&self.float_kinetic_energy_j);
        let float = float.map(|(step, energy)| (f64::from(step), energy / 1e3)).collect();
        let mut series = vec![Series::new("float", Drawn::Line, float)];
        for build in &self.builds {
            let points =
                build.curve.iter().map(|at| (f64::from(at.step), at.kinetic_energy_j / 1e3));
            series.push(Series::new(build.build.clone(), Drawn::Line, points.collect()));
        }
        Figure::new(
            ("figure-half-energy", "§4.6.3"),
            "Kinetic energy of the falling pile in each format",
            lines(Axis::linear("step"), Axis::log("kinetic energy, kJ"), &series),
            format!("{}. The thesis judges half by one step. {}", self.subject, self.explained()),
        )
    }

    /// The kinetic energies after many steps.
    fn energy(&self, figure: &Figure) -> Option<Row> {
        let ratio = |build: &OfBuild| {
            let last = build.curve.last()?;
            let (ratio, step) = (last.energy_ratio?, last.step);
            Some(format!("{} {ratio:.1} times float's after {step} steps", build.build))
        };
        let ratios: Vec<String> = self.builds.iter().filter_map(ratio).collect();
        let subject = "kinetic energy of the pile in each format";
        (!ratios.is_empty()).then(|| figure.row(subject, "not given", ratios.join(", ")))
    }

    /// The forms of sixteen bits on the numbers of the step: their layout, and their range.
    fn layouts(&self, figure: &Figure) -> Vec<Row> {
        let mut rows: Vec<Row> = Vec::new();
        for split in &self.splits {
            let (layout, range) = match split.format {
                "binary16" => ("§4.6.1, Figures 4.3 and 4.4", None),
                "thesis16" | "thesis16-literal" => {
                    ("§4.6.4, Figures 4.11 and 4.12", Some(SIXTEEN_BITS_RANGE))
                }
                _ => continue,
            };
            let [exponent, mantissa] = SIXTEEN_BITS;
            rows.push(Row {
                thesis: layout.to_owned(),
                origin: Origin::Modelled,
                ..figure.row(
                    format!("bits of exponent and mantissa: {}", split.format),
                    format!("{exponent} and {mantissa}"),
                    format!("{} and {}", split.exponent_bits, split.mantissa_bits),
                )
            });
            let Some([smallest, largest]) = range else { continue };
            let ours = format!(
                "from {:.5e}; {:.3} % of the numbers are smaller, mean error {} %, {} below 1 %",
                split.smallest,
                split.below_smallest_share * 100.0,
                number(split.relative_mean_percent),
                percent(split.under_1_percent_share)
            );
            let subject =
                format!("range of {}, and its errors on the numbers of the step", split.format);
            let recorded = format!("{smallest:e} to {largest}, no errors given");
            rows.push(Row { thesis: layout.to_owned(), ..figure.row(subject, recorded, ours) });
        }
        rows
    }
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
