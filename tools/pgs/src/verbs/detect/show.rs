//! Shows a detection and its comparison: facts and tables for people, a document for programs.

use std::io::{self, Write};

use scene::{Scene, penetration};
use serde_json::{Value, json};

use super::DetectArgs;
use super::cause::{NormalCause, PointCause};
use super::comparison::{Comparison, OneSided, Pair, Tally};
use super::timing::{Phases, Timing};
use crate::numbers::{grouped, number};
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};
use crate::output::{SCHEMA, milliseconds};

/// Everything that the verb prints.
pub(super) struct Shown<'a> {
    pub(super) args: &'a DetectArgs,
    pub(super) scene: &'a Scene,
    pub(super) time_step: f32,
    pub(super) timing: &'a Timing,
    pub(super) comparison: Option<&'a Comparison>,
}

const COLUMNS: [Column; 5] = [
    Column { name: "", unit: "", width: 46 },
    Column { name: "number", unit: "", width: 9 },
    Column { name: "mean", unit: "", width: 9 },
    Column { name: "largest", unit: "", width: 9 },
    Column { name: "of bodies", unit: "", width: 14 },
];

impl NormalCause {
    const fn text(self) -> &'static str {
        match self {
            Self::Same => "same: within 0.01 degrees",
            Self::Apart => "apart: by a face of B alone, theirs by edges",
            Self::Equal => "equal: equal overlap along both axes",
            Self::Unknown => "unknown",
        }
    }
}

impl PointCause {
    const fn text(self) -> &'static str {
        match self {
            Self::Same => "same: within 1 mm",
            Self::Choice => "choice: one of ours before four are chosen",
            Self::Clip => "clip: cut by the sides of A's face",
            Self::First => "first: the first point, no corner of the area",
            Self::Normal => "normal: the normals differ, too",
            Self::Unknown => "unknown",
        }
    }
}

impl Shown<'_> {
    /// Writes text.
    pub(super) fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let scene = self.scene;
        match &self.args.input {
            Some(path) => fact(out, "input", &path.display().to_string())?,
            None => fact(out, "scene", &self.args.scene.text())?,
        }
        let depth = penetration(scene.collisions());
        let collisions = format!(
            "{} of {} bodies, {} of them with the ground; {} points, {} of them penetrating, {} mm \
             deep at most",
            grouped(scene.collisions().len() as u64),
            grouped(scene.bodies().len() as u64),
            grouped(scene.ground_pairs() as u64),
            grouped(depth.contacts),
            grouped(depth.penetrating),
            number(depth.largest * 1e3),
        );
        fact(out, "collisions", &collisions)?;
        let Timing { first, next } = self.timing;
        let later = format!("{} s later", number(self.time_step.into()));
        for (name, phases) in [("from nothing", first), (&*later, next)] {
            let times = format!(
                "{name}: broad phase {:.3} ms, narrow phase {:.3} ms, {} with near bounding boxes",
                milliseconds(phases.broad),
                milliseconds(phases.narrow),
                grouped(phases.pairs as u64),
            );
            fact(out, "detection", &times)?;
        }
        match self.comparison {
            Some(comparison) => print_comparison(comparison, out),
            None => Ok(()),
        }
    }

    /// The document for programs.
    pub(super) fn to_json(&self) -> Value {
        let scene = self.scene;
        let depth = penetration(scene.collisions());
        let config = match &self.args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => self.args.scene.to_json(),
        };
        let phases = |phases: &Phases| {
            json!({
                "pairs": phases.pairs,
                "broad_ms": milliseconds(phases.broad),
                "narrow_ms": milliseconds(phases.narrow),
            })
        };
        json!({
            "schema": SCHEMA,
            "verb": "detect",
            "config": config,
            "threads": self.args.threads,
            "runs": self.args.runs,
            "time_step_s": self.time_step,
            "bodies": scene.bodies().len(),
            "collisions": scene.collisions().len(),
            "ground_collisions": scene.ground_pairs(),
            "points": depth.contacts,
            "penetrating_points": depth.penetrating,
            "deepest_m": depth.largest,
            "first": phases(&self.timing.first),
            "next": phases(&self.timing.next),
            "comparison": self.comparison.map(comparison_json),
        })
    }
}

fn print_comparison(comparison: &Comparison, out: &mut dyn Write) -> io::Result<()> {
    let one_sided = |side: &OneSided| {
        let deepest = side.deepest.map(|(distance, pair)| {
            let size = number(distance.abs() * 1e3);
            let words = if distance < 0.0 { ["deepest", "deep"] } else { ["nearest", "apart"] };
            let [which, word] = words;
            format!("; the {which} is {size} mm {word}: {}", pair_text(pair))
        });
        format!(
            "{}, {} of them deeper than 1 mm{}",
            grouped(side.count),
            grouped(side.deep),
            deepest.unwrap_or_default()
        )
    };
    let Comparison { theirs, ours, .. } = comparison;
    fact(
        out,
        "compare",
        &format!("{} collisions of the folder, {} of ours", grouped(*theirs), grouped(*ours)),
    )?;
    fact(out, "missing", &one_sided(&comparison.missing))?;
    fact(out, "extra", &one_sided(&comparison.extra))?;

    let table =
        |out: &mut dyn Write, title: &str, unit: &'static str, rows: &[(&str, Tally, f64)]| {
            let mut columns = COLUMNS;
            (columns[2].unit, columns[3].unit) = (unit, unit);
            writeln!(out)?;
            writeln!(out, "{title}")?;
            heading(out, &columns)?;
            rows.iter()
                .try_for_each(|(name, tally, scale)| line(out, &columns, row(name, tally, *scale)))
        };
    let mut rows: Vec<_> = NormalCause::ALL
        .iter()
        .zip(comparison.normals)
        .map(|(cause, tally)| (cause.text(), tally, 1.0))
        .collect();
    rows.push(("all of pairs deeper than 1 mm on both sides", comparison.deep_normals, 1.0));
    table(out, "angles between normals", "degrees", &rows)?;
    let mut rows: Vec<_> = PointCause::ALL
        .iter()
        .zip(comparison.points)
        .map(|(cause, tally)| (cause.text(), tally, 1e3))
        .collect();
    rows.push(("depth of the same points", comparison.depths, 1e3));
    table(out, "distances of the folder's points from the nearest of ours", "mm", &rows)?;
    writeln!(out)?;
    let unmatched = format!(
        "{} of our {} points, {} of them in a collision without a point of the cause \"first\"",
        grouped(comparison.unmatched),
        grouped(comparison.our_points),
        grouped(comparison.unmatched_otherwise),
    );
    fact(out, "unmatched", &unmatched)
}

fn row(name: &str, tally: &Tally, scale: f64) -> [String; 5] {
    let (mean, largest, place) = match tally.largest {
        Some((largest, pair)) => {
            (number(tally.mean() * scale), number(largest * scale), pair_text(pair))
        }
        None => ["-"; 3].map(str::to_owned).into(),
    };
    [format!("{name:<46}"), grouped(tally.count), mean, largest, place]
}

fn pair_text((a, b): Pair) -> String {
    format!("{a} and {b}")
}

fn comparison_json(comparison: &Comparison) -> Value {
    let one_sided = |side: &OneSided| {
        json!({
            "collisions": side.count,
            "deep": side.deep,
            "deepest_m": side.deepest.map(|(distance, _)| distance),
            "deepest_pair": side.deepest.map(|(_, (a, b))| [a, b]),
        })
    };
    let tally = |tally: &Tally| {
        json!({
            "number": tally.count,
            "mean": tally.mean(),
            "largest": tally.largest.map(|(largest, _)| largest),
            "pair": tally.largest.map(|(_, (a, b))| [a, b]),
        })
    };
    let mut normals = json!({ "deep": tally(&comparison.deep_normals) });
    for (cause, found) in NormalCause::ALL.iter().zip(&comparison.normals) {
        normals[cause.name()] = tally(found);
    }
    let mut points = json!({});
    for (cause, found) in PointCause::ALL.iter().zip(&comparison.points) {
        points[cause.name()] = tally(found);
    }
    json!({
        "folder_collisions": comparison.theirs,
        "our_collisions": comparison.ours,
        "missing": one_sided(&comparison.missing),
        "extra": one_sided(&comparison.extra),
        "normals_degrees": normals,
        "points_m": points,
        "depths_m": tally(&comparison.depths),
        "our_points": comparison.our_points,
        "unmatched_points": comparison.unmatched,
        "unmatched_without_first": comparison.unmatched_otherwise,
        "agrees": comparison.agrees(),
    })
}
