//! Figure 4.10: positions in sixteen bits against float, after one step; and energies after many.

use super::splits::{BITS, Split};
use crate::deviation::Deviations;
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::index::{Origin, Row};
use crate::study::course::Side;
use crate::study::recorded::{HALF_AGAINST_FLOAT, SIXTEEN_BITS, SIXTEEN_BITS_RANGE, percent};
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

/// All sides for the figures; float is the first.
pub(super) struct Shown<'a> {
    pub(super) subject: String,
    pub(super) sides: &'a [Side],
}

impl Shown<'_> {
    /// The builds beside float.
    fn builds(&self) -> &[Side] {
        &self.sides[1..]
    }

    /// The meanings of the builds.
    fn explained(&self) -> String {
        let meanings = self.builds().iter().filter_map(|side| meaning(&side.name));
        let failed = self.builds().iter().filter_map(|side| {
            let (step, failure) = side.failed.as_ref()?;
            Some(format!("{} ends in step {step}: {}", side.name, failure.chain()))
        });
        let sentences: Vec<String> = meanings.map(str::to_owned).chain(failed).collect();
        sentences.join(". ") + "."
    }

    /// Adds the figure of one step.
    pub(super) fn add_positions(
        &self,
        part: &mut Part,
        positions: &[(&str, Deviations)],
        splits: &[Split],
    ) {
        let series = positions.iter();
        let series = series.map(|(name, of)| Series::new(*name, Drawn::Line, of.below()));
        let figure = Figure::new(
            ("figure-4-10", HALF_AGAINST_FLOAT.thesis),
            "Deviation of positions in sixteen bits from those of float",
            HALF_AGAINST_FLOAT.spread(series.collect()),
            format!("{}. {}", self.subject, self.explained()),
        );
        let deviation = |side: &Side| {
            let position = side.points.last().and_then(|at| Some(at.away?.state.position));
            let ours = match (position, &side.failed) {
                (Some(position), _) => {
                    format!("{:.4} %, {}", position.mean * 100.0, percent(position.under_share()))
                }
                (None, Some((step, _))) => format!("step {step} fails on the board"),
                (None, None) => "no step".to_owned(),
            };
            let what = "against float: mean deviation of positions, positions within 1 %";
            figure.row(format!("{} {what}", side.name), recorded(&side.name), ours)
        };
        let rows = self.builds().iter().map(deviation);
        let rows: Vec<Row> = rows.chain(layouts(&figure, splits)).collect();
        part.figure(figure, rows);
    }

    /// Adds the figure of many steps.
    pub(super) fn add_energies(&self, part: &mut Part) {
        let curve = |side: &Side| {
            let points = (0_u32..).zip(&side.points);
            let points = points.map(|(step, at)| (f64::from(step), at.kinetic.total() / 1e3));
            // The builds begin where float does.
            points.skip(usize::from(side.name != self.sides[0].name)).collect()
        };
        let series = self.sides.iter();
        let series = series.map(|side| Series::new(side.name.clone(), Drawn::Line, curve(side)));
        let figure = Figure::new(
            ("figure-half-energy", "§4.6.3"),
            "Kinetic energy of the falling pile in each format",
            lines(
                Axis::linear("step"),
                Axis::log("kinetic energy, kJ"),
                &series.collect::<Vec<_>>(),
            ),
            format!("{}. The thesis judges half by one step. {}", self.subject, self.explained()),
        );
        let ratio = |side: &Side| {
            let (ratio, step) = (side.points.last()?.energy_ratio()?, side.points.len() - 1);
            Some(format!("{} {ratio:.1} times float's after {step} steps", side.name))
        };
        let ratios: Vec<String> = self.builds().iter().filter_map(ratio).collect();
        let subject = "kinetic energy of the pile in each format";
        let row = (!ratios.is_empty()).then(|| figure.row(subject, "not given", ratios.join(", ")));
        part.figure(figure, row);
    }
}

/// The forms of sixteen bits on the numbers of the step: their layout, and their range.
fn layouts(figure: &Figure, splits: &[Split]) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for split in splits {
        let (layout, range) = match split.format {
            "binary16" => ("§4.6.1, Figures 4.3 and 4.4", None),
            _ => ("§4.6.4, Figures 4.11 and 4.12", Some(SIXTEEN_BITS_RANGE)),
        };
        let [exponent, mantissa] = SIXTEEN_BITS;
        rows.push(Row {
            thesis: layout.to_owned(),
            origin: Origin::Modelled,
            ..figure.row(
                format!("bits of exponent and mantissa: {}", split.format),
                format!("{exponent} and {mantissa}"),
                format!("{} and {}", BITS[0], BITS[1]),
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
