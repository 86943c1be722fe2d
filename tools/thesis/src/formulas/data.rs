//! Tables 4.1 to 4.6: words in and out, before and after each reduction.

use crate::estimate::thesis::data::{DataTable, TABLES};
use crate::estimate::{Records, StepTraffic};

use super::scene::{Scene, mib, printed_mib, whole};
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
        let (words, bytes) = (row.words(bodies, collisions), row.bytes(bodies, collisions));
        let beats = row.beats(bodies, collisions);
        let (each, theirs) = (row.each, row.centi_mebibytes as f64 / 100.0);
        let [_, words_off] = scene.beside(words as f64, Some(row.total as f64), 0);
        let [thesis_mib, mib_off] = scene.beside(printed_mib(bytes), Some(theirs), 2);
        let [_, beats_off] = scene.beside(beats as f64, Some(row.accesses as f64), 0);
        table.row([
            ("state", "", text(row.name)),
            ("each", "each", whole(each)),
            ("each_bytes", "B", whole(each * 4)),
            ("each_beats", "beats", Cell::Number(f64::from(each) / 4.0, 2)),
            ("formula", "in total", text(formula(row.per_collision, row.per_body))),
            ("words", "words", whole(words)),
            ("thesis_words", "thesis", whole(row.total)),
            ("difference_percent", "diff.", words_off),
            ("mib", "MiB", Cell::Number(mib(bytes), 2)),
            ("thesis_mib", "thesis", thesis_mib),
            ("mib_difference_percent", "diff.", mib_off),
            ("beats", "beats", whole(beats)),
            ("thesis_beats", "thesis", whole(row.accesses)),
            ("beats_difference_percent", "diff.", beats_off),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    for remark in data.remarks {
        table.note(*remark);
    }
    table
}

fn streamed(scene: &Scene) -> Table {
    let title =
        "The same as streamed, collisions once: 32-bit words with padding, beside T4.5 and T4.6";
    let (input, output) = (TABLES[4].rows[1].total, TABLES[5].rows[1].total);
    scene.table("records", title, Kind::Exact, |variant| {
        let each = variant.words();
        let traffic = StepTraffic::new(variant, Records::Streamed, &scene.step);
        let arrays = [traffic.velocities, traffic.collisions, traffic.poses];
        let ours = arrays.iter().map(|array| array.bytes).sum::<u64>() / 4;
        let results = traffic.results.bytes / 4;
        let [input_off, output_off] = [(ours, input), (results, output)]
            .map(|(ours, thesis)| scene.difference(ours as f64, thesis as f64));
        [[
            ("velocity", "velocity", whole(each.velocity)),
            ("collision", "collision", whole(each.collision)),
            ("pose", "pose", whole(each.pose)),
            ("result", "result", whole(each.result)),
            ("input", "words in", whole(ours)),
            ("thesis_input", "thesis", whole(input)),
            ("input_difference_percent", "difference", input_off),
            ("output", "words out", whole(results)),
            ("thesis_output", "thesis", whole(output)),
            ("output_difference_percent", "difference", output_off),
        ]]
    })
}
