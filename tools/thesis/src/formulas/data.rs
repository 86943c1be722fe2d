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
        &[
            ("state", ""),
            ("each", "each"),
            ("each_bytes", "B"),
            ("each_beats", "beats"),
            ("formula", "in total"),
            ("words", "words"),
            ("thesis_words", "thesis"),
            ("difference_percent", "diff."),
            ("mib", "MiB"),
            ("thesis_mib", "thesis"),
            ("mib_difference_percent", "diff."),
            ("beats", "beats"),
            ("thesis_beats", "thesis"),
            ("beats_difference_percent", "diff."),
            ("kind", "kind"),
        ],
    );
    let (bodies, collisions) = (scene.step.bodies, scene.step.collisions);
    for row in data.rows {
        let (words, printed) = (row.words(bodies, collisions), row.printed);
        let (bytes, beats) = (row.bytes(bodies, collisions), row.beats(bodies, collisions));
        let thesis_mib = printed.centi_mebibytes as f64 / 100.0;
        table.row([
            text(row.name),
            Cell::Whole(printed.each.into()),
            Cell::Whole(u64::from(printed.each) * 4),
            Cell::Number(f64::from(printed.each) / 4.0, 2),
            text(formula(row.per_collision, row.per_body)),
            Cell::Whole(words),
            Cell::Whole(printed.words),
            scene.difference(words as f64, printed.words as f64),
            Cell::Number(mib(bytes), 2),
            Cell::Number(thesis_mib, 2),
            scene.difference(printed_mib(bytes), thesis_mib),
            Cell::Whole(beats),
            Cell::Whole(printed.beats),
            scene.difference(beats as f64, printed.beats as f64),
            Kind::Exact.cell(),
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
        &[
            ("profile", "profile"),
            ("velocity", "velocity"),
            ("collision", "collision"),
            ("pose", "pose"),
            ("result", "result"),
            ("input", "words in"),
            ("thesis_input", "thesis"),
            ("input_difference_percent", "difference"),
            ("output", "words out"),
            ("thesis_output", "thesis"),
            ("output_difference_percent", "difference"),
            ("kind", "kind"),
        ],
    );
    let (input, output) = (TABLES[4].rows[1].printed.words, TABLES[5].rows[1].printed.words);
    for variant in &scene.variants {
        let words = words(variant);
        let traffic = StepTraffic::new(variant, Records::Streamed, &scene.step);
        let arrays = [traffic.velocities, traffic.collisions, traffic.poses];
        let bytes = arrays.iter().fold(0_u64, |sum, array| sum.saturating_add(array.bytes));
        let (ours, results) = (bytes / 4, traffic.results.bytes / 4);
        table.row([
            text(variant.profile.name),
            Cell::Whole(words.velocity.into()),
            Cell::Whole(words.collision.into()),
            Cell::Whole(words.pose.into()),
            Cell::Whole(words.result.into()),
            Cell::Whole(ours),
            Cell::Whole(input),
            scene.difference(ours as f64, input as f64),
            Cell::Whole(results),
            Cell::Whole(output),
            scene.difference(results as f64, output as f64),
            Kind::Exact.cell(),
        ]);
    }
    table
}
