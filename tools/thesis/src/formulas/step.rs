//! The tables of a step's cycles and times.

use crate::estimate::thesis::recorded::{Design, MEMORY_BANDWIDTH};
use crate::estimate::{MemoryUse, Records, StepCycles, StepTime, Window};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{Inertia, Variant};

use super::scene::{Scene, difference, mib, yes_or_no};
use crate::table::{Cell, Kind, Table, text};
use pgs_command::options::bandwidth::bandwidth_text;

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![cycles(scene), times(scene), world_inertia(scene)]
}

fn cycles(scene: &Scene) -> Table {
    let mut table = Table::new("cycles", "Cycles of a step by formula (T6.4, T6.8)");
    for variant in &scene.variants {
        let design = Design::of(variant.profile);
        for records in Records::ALL {
            let cycles = StepCycles::new(variant, records, &scene.step);
            table.row([
                ("profile", "profile", text(variant.profile.name)),
                ("records", "records", text(records.name())),
                ("load", "load", Cell::Whole(cycles.load)),
                ("pass", "one pass", Cell::Whole(cycles.pass)),
                ("fill", "fill", Cell::Whole(cycles.fill)),
                ("integration", "integration", Cell::Whole(cycles.integration())),
                ("integration_fill", "its fill", Cell::Whole(cycles.integration_fill)),
                ("total", "total", Cell::Whole(cycles.total)),
                ("thesis", "thesis", Cell::known(design, |design| Cell::Whole(design.cycles))),
                (
                    "difference_percent",
                    "difference",
                    Cell::known(design, |design| {
                        scene.difference(cycles.total as f64, design.cycles as f64)
                    }),
                ),
                ("kind", "kind", Kind::Modelled.cell()),
            ]);
        }
    }
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
    let mut table = Table::new("time", "Time of a step by memory bandwidth");
    for variant in &scene.variants {
        let design = Design::of(variant.profile);
        for records in Records::ALL {
            for bandwidth in &scene.bandwidths {
                let time = StepTime::new(variant, records, &scene.step, *bandwidth);
                // The thesis' cycles contain no memory waits, and it states a bandwidth.
                let stated = [Bandwidth::Unlimited, MEMORY_BANDWIDTH];
                let design = design.filter(|_| stated.contains(bandwidth));
                table.row([
                    ("profile", "profile", text(variant.profile.name)),
                    ("records", "records", text(records.name())),
                    ("bandwidth", "bandwidth", text(bandwidth_text(*bandwidth))),
                    ("bytes", "bytes moved", Cell::Whole(time.bytes)),
                    ("ms", "ms", Cell::Number(time.seconds * 1e3, 3)),
                    ("load_limit", "load by", text(time.load.limit.name())),
                    ("pass_limit", "passes by", text(time.pass.limit.name())),
                    ("integration_limit", "integration by", text(time.integration.limit.name())),
                    (
                        "thesis_ms",
                        "thesis ms",
                        Cell::known(design, |design| Cell::Number(design.latency_ms, 2)),
                    ),
                    (
                        "difference_percent",
                        "difference",
                        Cell::known(design, |design| {
                            scene.difference(time.seconds * 1e3, design.latency_ms)
                        }),
                    ),
                    ("kind", "kind", Kind::Modelled.cell()),
                ]);
            }
        }
    }
    table.note(
        "17.07 GB/s is the peak of the ZCU102 preset, 12.8 GB/s what a published measurement \
         sustains. The thesis states 16 GB/s for its memory (§5.4.2), a pass of its float design \
         needs 15.4, and its times contain no wait for memory. The 2,062,697 cycles of its float \
         design at 275 MHz are 7.501 ms where it prints 7.49.",
    );
    table
}

fn world_inertia(scene: &Scene) -> Table {
    let mut table =
        Table::new("inertia", "What the world inertia of every body costs, records as streamed");
    for variant in &scene.variants {
        let both = [Inertia::Isotropic, Inertia::World].map(|inertia| {
            let variant = Variant { inertia, ..*variant };
            let cycles = StepCycles::new(&variant, Records::Streamed, &scene.step).total;
            let memory = MemoryUse::new(&variant, scene.step.bodies, scene.step.collisions);
            (cycles, memory)
        });
        let [(without, memory_without), (with, memory_with)] = both;
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("cycles_without", "cycles", Cell::Whole(without)),
            ("cycles_with", "with it", Cell::Whole(with)),
            ("difference_percent", "difference", difference(with as f64, without as f64)),
            ("mib_without", "MiB on chip", Cell::Number(mib(memory_without.block_ram()), 2)),
            ("mib_with", "with it", Cell::Number(mib(memory_with.block_ram()), 2)),
            ("fit", "fits", text(yes_or_no(memory_with.fits()))),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
    }
    table
}
