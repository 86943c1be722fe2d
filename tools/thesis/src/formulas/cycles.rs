//! The table of a step's cycles and times.

use crate::estimate::thesis::recorded::{Design, MEMORY_BANDWIDTH};
use crate::estimate::{Records, StepCycles, StepTime};
use bitstream_model::Bandwidth;

use super::scene::{Scene, whole};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let title = "Cycles of a step by formula (T6.4, T6.8)";
    let mut table = scene.table("cycles", title, Kind::Modelled, |variant| {
        let thesis = Design::of(variant.profile).map(|design| design.cycles);
        Records::ALL.map(|records| {
            let cycles = StepCycles::new(variant, records, &scene.step);
            let [_, off] = scene.beside(cycles.total as f64, thesis.map(|cycles| cycles as f64), 0);
            let ms = |bandwidth| {
                let time = StepTime::new(variant, records, &scene.step, bandwidth);
                Cell::Number(time.seconds * 1e3, 3)
            };
            [
                ("records", "records", text(records.name())),
                ("load", "load", whole(cycles.load)),
                ("pass", "one pass", whole(cycles.pass)),
                ("fill", "fill", whole(cycles.fill)),
                ("integration", "integration", whole(cycles.integration())),
                ("integration_fill", "its fill", whole(cycles.integration_fill)),
                ("total", "total", whole(cycles.total)),
                ("thesis", "thesis", Cell::known(thesis, whole)),
                ("difference_percent", "diff.", off),
                ("ms", "ms", ms(Bandwidth::Unlimited)),
                ("ms_thesis", "16 GB/s", ms(MEMORY_BANDWIDTH)),
                ("ms_sustained", "12.8 GB/s", ms(Bandwidth::ZCU102_SUSTAINED)),
            ]
        })
    });
    table.note(format!(
        "One formula for every profile: load + {} passes + fill + integration, the longer of poses \
         in and results out, + its fill, from the last body in to the end of the step. A step that \
         stalls on hazards takes longer.",
        scene.step.passes()
    ));
    table.note(
        "Packed: numbers without padding, as the thesis counts them. Streamed: beats and padding \
         as they travel; a result has position, orientation and both velocities, 13 numbers where \
         the thesis counts 6.",
    );
    table.note(
        "The thesis states 16 GB/s for its memory (§5.4.2), a pass of its float design needs 15.4, \
         and its times contain no wait for memory: its cycles at 275 MHz are 7.501 ms where it \
         prints 7.49. 12.8 GB/s is what a published measurement on a ZCU102 sustains.",
    );
    vec![table]
}
