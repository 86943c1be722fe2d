//! The tables of a step's cycles and times.

use crate::estimate::thesis::recorded::{Design, MEMORY_BANDWIDTH};
use crate::estimate::{MemoryUse, Records, StepCycles, StepTime, Window};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{Inertia, Variant};

use super::scene::{Scene, difference, mib, whole, yes_or_no};
use crate::table::{Cell, Kind, Table, text};
use pgs_command::options::bandwidth::bandwidth_text;

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![cycles(scene), times(scene), world_inertia(scene)]
}

fn cycles(scene: &Scene) -> Table {
    let title = "Cycles of a step by formula (T6.4, T6.8)";
    let mut table = scene.table("cycles", title, Kind::Modelled, |variant| {
        let thesis = Design::of(variant.profile).map(|design| design.cycles);
        Records::ALL.map(|records| {
            let cycles = StepCycles::new(variant, records, &scene.step);
            let [_, off] = scene.beside(cycles.total as f64, thesis.map(|cycles| cycles as f64), 0);
            [
                ("records", "records", text(records.name())),
                ("load", "load", whole(cycles.load)),
                ("pass", "one pass", whole(cycles.pass)),
                ("fill", "fill", whole(cycles.fill)),
                ("integration", "integration", whole(cycles.integration())),
                ("integration_fill", "its fill", whole(cycles.integration_fill)),
                ("total", "total", whole(cycles.total)),
                ("thesis", "thesis", Cell::known(thesis, whole)),
                ("difference_percent", "difference", off),
            ]
        })
    });
    table.note(format!(
        "One formula for every profile that runs one pass after the other: load + {} passes + fill \
         + integration, the longer of poses in and results out, + its fill, from the last body in \
         to the end of the step. A step that stalls on hazards takes longer.",
        scene.step.passes()
    ));
    if scene.variants.iter().any(|variant| Window::of(variant.profile).is_some()) {
        table.note(
            "Where the collisions stream once, all passes run in parallel: \"one pass\" has the \
             cycles of all passes, and \"fill\" is the lag of the last pass behind the first. Load \
             and integration run in parallel, too.",
        );
    }
    table.note(
        "Packed: numbers without padding, as the thesis counts them. Streamed: beats and padding \
         as they travel; a result has position, orientation and both velocities, 13 numbers where \
         the thesis counts 6.",
    );
    table
}

fn times(scene: &Scene) -> Table {
    let title = "Time of a step by memory bandwidth";
    let mut table = scene.table("time", title, Kind::Modelled, |variant| {
        let row = |records, bandwidth| {
            let time = StepTime::new(variant, records, &scene.step, bandwidth);
            // The thesis' cycles contain no memory waits, and it states a bandwidth.
            let stated = [Bandwidth::Unlimited, MEMORY_BANDWIDTH].contains(&bandwidth);
            let design = Design::of(variant.profile).filter(|_| stated);
            let ms = time.seconds * 1e3;
            let [thesis, off] = scene.beside(ms, design.map(|design| design.latency_ms), 2);
            [
                ("records", "records", text(records.name())),
                ("bandwidth", "bandwidth", text(bandwidth_text(bandwidth))),
                ("bytes", "bytes moved", whole(time.bytes)),
                ("ms", "ms", Cell::Number(ms, 3)),
                ("load_limit", "load by", text(time.load.limit.name())),
                ("pass_limit", "passes by", text(time.pass.limit.name())),
                ("integration_limit", "integration by", text(time.integration.limit.name())),
                ("thesis_ms", "thesis ms", thesis),
                ("difference_percent", "difference", off),
            ]
        };
        let all = |records| scene.bandwidths.iter().map(move |bandwidth| row(records, *bandwidth));
        Records::ALL.into_iter().flat_map(all).collect::<Vec<_>>()
    });
    table.note(
        "17.07 GB/s is the peak of the ZCU102 preset, 12.8 GB/s what a published measurement \
         sustains. The thesis states 16 GB/s for its memory (§5.4.2), a pass of its float design \
         needs 15.4, and its times contain no wait for memory. The 2,062,697 cycles of its float \
         design at 275 MHz are 7.501 ms where it prints 7.49.",
    );
    table
}

fn world_inertia(scene: &Scene) -> Table {
    let title = "What the world inertia of every body costs, records as streamed";
    scene.table("inertia", title, Kind::Modelled, |variant| {
        let [(without, memory_without), (with, memory_with)] = [Inertia::Isotropic, Inertia::World]
            .map(|inertia| {
                let variant = Variant { inertia, ..*variant };
                let cycles = StepCycles::new(&variant, Records::Streamed, &scene.step).total;
                (cycles, MemoryUse::new(&variant, scene.step.bodies, scene.step.collisions))
            });
        [[
            ("cycles_without", "cycles", whole(without)),
            ("cycles_with", "with it", whole(with)),
            ("difference_percent", "difference", difference(with as f64, without as f64)),
            ("mib_without", "MiB on chip", Cell::Number(mib(memory_without.block_ram()), 2)),
            ("mib_with", "with it", Cell::Number(mib(memory_with.block_ram()), 2)),
            ("within", "within 4.0 MiB", yes_or_no(memory_with.fits())),
        ]]
    })
}
