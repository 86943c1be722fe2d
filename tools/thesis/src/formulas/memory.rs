//! The tables of on-chip memory, logic and streams.

use crate::estimate::thesis::recorded::Design;
use crate::estimate::{BLOCKS, HP_PORTS, MemoryUse, StreamDemand};
use bitstream_model::Bandwidth;

use super::scene::{Scene, mib, printed_mib, yes_or_no};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![footprint(scene), arrays(scene), blocks(scene), logic(scene)]
}

fn uses(scene: &Scene) -> impl Iterator<Item = (&pgs_interface::profile::Variant, MemoryUse)> {
    scene
        .variants
        .iter()
        .map(|variant| (variant, MemoryUse::new(variant, scene.step.bodies, scene.step.collisions)))
}

fn footprint(scene: &Scene) -> Table {
    let mut table = Table::new(
        "memory",
        "On-chip memory, MiB (§4.4.2)",
        &[
            ("profile", "profile"),
            ("mib", "MiB"),
            ("thesis_mib", "thesis"),
            ("difference_percent", "difference"),
            ("with_positions_mib", "with positions"),
            ("thesis_with_positions_mib", "thesis"),
            ("with_positions_difference_percent", "difference"),
            ("fits", "of 4.0 MiB"),
            ("collisions_that_fit", "room for collisions"),
            ("kind", "kind"),
        ],
    );
    for (variant, memory) in uses(scene) {
        let design = Design::of(variant.profile);
        let beside = |bytes: u64, theirs: fn(&Design) -> f64| {
            let thesis = design.map_or(Cell::Missing, |design| Cell::Number(theirs(design), 2));
            let off = design.map_or(Cell::Missing, |design| {
                scene.difference(printed_mib(bytes), theirs(design))
            });
            [Cell::Number(mib(bytes), 2), thesis, off]
        };
        let [ours, thesis, off] = beside(memory.block_ram(), |design| design.mebibytes);
        let [more, thesis_more, off_more] =
            beside(memory.with_positions(), |design| design.mebibytes_with_positions);
        table.row([
            text(variant.profile.name),
            ours,
            thesis,
            off,
            more,
            thesis_more,
            off_more,
            text(if memory.fits() { "fits" } else { "does not fit" }),
            Cell::Whole(MemoryUse::collisions_beside(variant, scene.step.bodies)),
            Kind::Exact.cell(),
        ]);
    }
    table.note(
        "Differences are of the two digits that the thesis prints. Positions would be kept in as many \
         copies as the velocities; no profile keeps them.",
    );
    table
}

fn arrays(scene: &Scene) -> Table {
    let mut table = Table::new(
        "arrays",
        "On-chip memory by array",
        &[
            ("profile", "profile"),
            ("array", "array"),
            ("row_bytes", "row"),
            ("rows", "rows"),
            ("copies", "copies"),
            ("bytes", "bytes"),
            ("ideal_blocks", "by bits"),
            ("shaped_blocks", "by shape"),
            ("shape", "shape"),
            ("kind", "kind"),
        ],
    );
    for (variant, memory) in uses(scene) {
        for array in &memory.arrays {
            let shaped = array.shaped_blocks();
            table.row([
                text(variant.profile.name),
                text(array.array.name()),
                Cell::Whole(array.row_bytes.into()),
                Cell::Whole(array.rows),
                Cell::Whole(array.copies.into()),
                Cell::Whole(array.bytes()),
                Cell::Whole(array.ideal_blocks()),
                Cell::Whole(shaped.blocks),
                text(format!("{} x {}", shaped.shape.rows, shaped.shape.bits)),
                Kind::Modelled.cell(),
            ]);
        }
    }
    table.note(
        "Row: bytes. A block is a BRAM_18K of 18,432 bits. By bits: none lost. By shape: the fewest blocks of one \
         shape side by side and one after the other; 1024 x 18 and narrower have two ports that read \
         and write, 512 x 36 one to read and one to write (UG573). The thesis has one shape of body \
         and no shape indices.",
    );
    table
}

fn blocks(scene: &Scene) -> Table {
    let mut table = Table::new(
        "blocks",
        "BRAM_18K of 1,824 (T6.4, T6.8)",
        &[
            ("profile", "profile"),
            ("ideal_blocks", "by bits"),
            ("ideal_percent", "share"),
            ("shaped_blocks", "by shape"),
            ("shaped_percent", "share"),
            ("thesis_percent", "thesis"),
            ("ideal_difference_percent", "by bits off"),
            ("shaped_difference_percent", "by shape off"),
            ("shaped_fit", "fits by shape"),
            ("kind", "kind"),
        ],
    );
    let percent = |blocks: u64| blocks as f64 / BLOCKS as f64 * 100.0;
    let share = |blocks: u64| Cell::Share(percent(blocks));
    for (variant, memory) in uses(scene) {
        let thesis = Design::of(variant.profile).map(|design| f64::from(design.block_ram));
        let off = |blocks: u64| {
            thesis.map_or(Cell::Missing, |thesis| scene.difference(percent(blocks), thesis))
        };
        let (ideal, shaped) = (memory.ideal_blocks(), memory.shaped_blocks());
        table.row([
            text(variant.profile.name),
            Cell::Whole(ideal),
            share(ideal),
            Cell::Whole(shaped),
            share(shaped),
            thesis.map_or(Cell::Missing, Cell::Share),
            off(ideal),
            off(shaped),
            text(yes_or_no(shaped <= BLOCKS)),
            Kind::Modelled.cell(),
        ]);
    }
    table.note(
        "Arrays only: FIFOs of streams and cores come on top. The thesis' shares are from its \
         synthesis report.",
    );
    table
}

fn logic(scene: &Scene) -> Table {
    let mut table = Table::new(
        "logic",
        "Logic, percent of the device (T6.4, T6.8)",
        &[
            ("profile", "profile"),
            ("dsp", "DSP48E"),
            ("lut", "LUT"),
            ("ff", "FF"),
            ("source", "source"),
            ("kind", "kind"),
        ],
    );
    for variant in &scene.variants {
        match Design::of(variant.profile) {
            Some(design) => table.row([
                text(variant.profile.name),
                Cell::Share(design.dsp.into()),
                Cell::Share(design.lookup_tables.into()),
                Cell::Share(design.flip_flops.into()),
                text(design.results),
                Kind::Recorded.cell(),
            ]),
            None => table.row([
                text(variant.profile.name),
                Cell::Missing,
                Cell::Missing,
                Cell::Missing,
                text("not known: nothing was synthesised"),
                Kind::Open.cell(),
            ]),
        }
    }
    table
}

/// Stream widths against the ports, and required bandwidth against the memory's.
pub(super) fn streams(scene: &Scene) -> Vec<Table> {
    let mut table = Table::new(
        "streams",
        "Streams against ports and memory while a pass runs",
        &[
            ("profile", "profile"),
            ("widths", "widths, bits"),
            ("ports", "HP ports of 4"),
            ("fits", "fits"),
            ("gb_per_second", "GB/s"),
            ("of_peak_percent", "of 17.07"),
            ("of_sustained_percent", "of 12.8"),
            ("kind", "kind"),
        ],
    );
    for variant in &scene.variants {
        let demand = StreamDemand::new(variant);
        let share = |bandwidth| match bandwidth {
            Bandwidth::Unlimited => Cell::Missing,
            Bandwidth::BytesPerSecond(rate) => Cell::Share(demand.rate / rate as f64 * 100.0),
        };
        let widths: Vec<String> =
            variant.profile.mm2s_widths.iter().map(ToString::to_string).collect();
        table.row([
            text(variant.profile.name),
            text(widths.join(" + ")),
            Cell::Whole(demand.ports as u64),
            text(yes_or_no(demand.fits)),
            Cell::Number(demand.rate / 1e9, 2),
            share(Bandwidth::ZCU102_PEAK),
            share(Bandwidth::ZCU102_SUSTAINED),
            Kind::Modelled.cell(),
        ]);
    }
    table.note(format!(
        "Each stream takes one of the {HP_PORTS} high-performance ports of 128 bits (UG1085). HP1 and \
         HP2 share a port of the memory controller. Above 100 % a pass waits for the memory.",
    ));
    vec![table]
}
