//! Tables 4.1 to 4.6: words in and out, before and after each reduction.

use crate::estimate::thesis::data::{DataTable, TABLES};
use crate::estimate::{Records, StepTraffic, words};

use super::scene::{Scene, mib, printed_mib};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let mut tables: Vec<Table> = TABLES.iter().map(|table| accounted(scene, table)).collect();
    tables.push(streamed(scene));
    tables
}

/// A count of words, as `27 C + 6 B`.
fn formula(per_collision: u32, per_body: u32) -> String {
    match (per_collision, per_body) {
        (0, bodies) => format!("{bodies} B"),
        (collisions, 0) => format!("{collisions} C"),
        (collisions, bodies) => format!("{collisions} C + {bodies} B"),
    }
}

fn accounted(scene: &Scene, data: &DataTable) -> Table {
    let mut table = Table::new(
        data.id,
        format!("{} {}: words of each record, and of all together", data.id, data.title),
    );
    let (bodies, collisions) = (scene.step.bodies, scene.step.collisions);
    for row in data.rows {
        let (words, printed) = (row.words(bodies, collisions), row.printed);
        let (bytes, beats) = (row.bytes(bodies, collisions), row.beats(bodies, collisions));
        let thesis_mib = printed.centi_mebibytes as f64 / 100.0;
        table.row([
            ("state", "", text(row.name)),
            ("each", "each", Cell::Whole(printed.each.into())),
            ("each_bytes", "B", Cell::Whole(u64::from(printed.each) * 4)),
            ("each_beats", "beats", Cell::Number(f64::from(printed.each) / 4.0, 2)),
            ("formula", "in total", text(formula(row.per_collision, row.per_body))),
            ("words", "words", Cell::Whole(words)),
            ("thesis_words", "thesis", Cell::Whole(printed.words)),
            ("difference_percent", "diff.", scene.difference(words as f64, printed.words as f64)),
            ("mib", "MiB", Cell::Number(mib(bytes), 2)),
            ("thesis_mib", "thesis", Cell::Number(thesis_mib, 2)),
            ("mib_difference_percent", "diff.", scene.difference(printed_mib(bytes), thesis_mib)),
            ("beats", "beats", Cell::Whole(beats)),
            ("thesis_beats", "thesis", Cell::Whole(printed.beats)),
            (
                "beats_difference_percent",
                "diff.",
                scene.difference(beats as f64, printed.beats as f64),
            ),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    for remark in data.remarks {
        table.note(*remark);
    }
    table
}

fn streamed(scene: &Scene) -> Table {
    let mut table = Table::new(
        "records",
        "The same as streamed, collisions once: 32-bit words with padding, beside T4.5 and T4.6",
    );
    let (input, output) = (TABLES[4].rows[1].printed.words, TABLES[5].rows[1].printed.words);
    for variant in &scene.variants {
        let words = words(variant);
        let traffic = StepTraffic::new(variant, Records::Streamed, &scene.step);
        let arrays = [traffic.velocities, traffic.collisions, traffic.poses];
        let bytes = arrays.iter().fold(0_u64, |sum, array| sum.saturating_add(array.bytes));
        let (ours, results) = (bytes / 4, traffic.results.bytes / 4);
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("velocity", "velocity", Cell::Whole(words.velocity.into())),
            ("collision", "collision", Cell::Whole(words.collision.into())),
            ("pose", "pose", Cell::Whole(words.pose.into())),
            ("result", "result", Cell::Whole(words.result.into())),
            ("input", "words in", Cell::Whole(ours)),
            ("thesis_input", "thesis", Cell::Whole(input)),
            ("input_difference_percent", "difference", scene.difference(ours as f64, input as f64)),
            ("output", "words out", Cell::Whole(results)),
            ("thesis_output", "thesis", Cell::Whole(output)),
            (
                "output_difference_percent",
                "difference",
                scene.difference(results as f64, output as f64),
            ),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    table
}
