//! The tables of a comparison.

use scene::{Scene, penetration};

use super::cause::{NormalCause, PointCause};
use super::comparison::{Comparison, OneSided, Pair, Tally};
use crate::experiment::Part;
use crate::table::{Cell, Table, text};
use pgs_command::numbers::{grouped, number};

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

/// The facts and tables of a comparison with the last detection of the scene.
pub(super) fn part(comparison: &Comparison, scene: &Scene) -> Part {
    let mut normals: Vec<_> = NormalCause::ALL
        .iter()
        .zip(comparison.normals)
        .map(|(cause, tally)| (cause.text(), tally, 1.0))
        .collect();
    normals.push(("all of pairs deeper than 1 mm on both sides", comparison.deep_normals, 1.0));
    let mut points: Vec<_> = PointCause::ALL
        .iter()
        .zip(comparison.points)
        .map(|(cause, tally)| (cause.text(), tally, 1e3))
        .collect();
    points.push(("depth of the same points", comparison.depths, 1e3));
    let mut part = Part::of(vec![
        pairs(comparison),
        tallies("normals", "Angles between normals, degrees", &normals),
        tallies("points", "Distances of the folder's points from the nearest of ours, mm", &points),
    ]);
    part.agrees = comparison.agrees();
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
    part.fact("collisions", collisions);
    let unmatched = format!(
        "{} of our {} points, {} of them in a collision without a point of the cause \"first\"",
        grouped(comparison.unmatched),
        grouped(comparison.our_points),
        grouped(comparison.unmatched_otherwise),
    );
    part.fact("unmatched", unmatched);
    part
}

/// The pairs of each side.
fn pairs(comparison: &Comparison) -> Table {
    let mut table = Table::with_columns(
        "pairs",
        "Pairs of bodies in contact",
        &[
            ("side", ""),
            ("collisions", "number"),
            ("deep", "deeper\nthan 1 mm"),
            ("deepest_mm", "deepest\nmm"),
            ("pair", "of bodies"),
        ],
    );
    for (name, count) in [("the folder's", comparison.theirs), ("ours", comparison.ours)] {
        let missing = [const { Cell::Missing }; 3];
        table.row([text(name), Cell::Whole(count)].into_iter().chain(missing));
    }
    for (name, side) in [("missing", &comparison.missing), ("extra", &comparison.extra)] {
        let OneSided { count, deep, deepest } = side;
        table.row([
            text(name),
            Cell::Whole(*count),
            Cell::Whole(*deep),
            Cell::known(*deepest, |(distance, _)| Cell::Digits(-distance * 1e3)),
            Cell::known(*deepest, |(_, pair)| text(pair_text(pair))),
        ]);
    }
    table
}

/// A table of the differences of each cause, with their scales.
fn tallies(id: &'static str, title: &str, rows: &[(&str, Tally, f64)]) -> Table {
    let columns = [
        ("cause", ""),
        ("number", "number"),
        ("mean", "mean"),
        ("largest", "largest"),
        ("pair", "of bodies"),
    ];
    let mut table = Table::with_columns(id, title, &columns);
    for (name, tally, scale) in rows {
        let mean = tally.largest.map(|_| tally.mean() * scale);
        table.row([
            text(*name),
            Cell::Whole(tally.count),
            Cell::known(mean, Cell::Digits),
            Cell::known(tally.largest, |(largest, _)| Cell::Digits(largest * scale)),
            Cell::known(tally.largest, |(_, pair)| text(pair_text(pair))),
        ]);
    }
    table
}

fn pair_text((a, b): Pair) -> String {
    format!("{a} and {b}")
}
