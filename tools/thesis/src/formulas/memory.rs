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
    let mut table = Table::new("memory", "On-chip memory, MiB (§4.4.2)");
    for (variant, memory) in uses(scene) {
        let design = Design::of(variant.profile);
        let beside = |bytes: u64, theirs: fn(&Design) -> f64| {
            let thesis = Cell::known(design, |design| Cell::Number(theirs(design), 2));
            let off =
                Cell::known(design, |design| scene.difference(printed_mib(bytes), theirs(design)));
            [Cell::Number(mib(bytes), 2), thesis, off]
        };
        let [ours, thesis, off] = beside(memory.block_ram(), |design| design.mebibytes);
        let [more, thesis_more, off_more] =
            beside(memory.with_positions(), |design| design.mebibytes_with_positions);
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("mib", "MiB", ours),
            ("thesis_mib", "thesis", thesis),
            ("difference_percent", "difference", off),
            ("with_positions_mib", "with positions", more),
            ("thesis_with_positions_mib", "thesis", thesis_more),
            ("with_positions_difference_percent", "difference", off_more),
            ("fits", "of 4.0 MiB", text(if memory.fits() { "fits" } else { "does not fit" })),
            (
                "collisions_that_fit",
                "room for collisions",
                Cell::Whole(MemoryUse::collisions_beside(variant, scene.step.bodies)),
            ),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    table.note(
        "Differences are of the two digits that the thesis prints. Positions would be kept in as \
         many copies as the velocities; no profile keeps them.",
    );
    table
}

fn arrays(scene: &Scene) -> Table {
    let mut table = Table::new("arrays", "On-chip memory by array");
    for (variant, memory) in uses(scene) {
        for array in &memory.arrays {
            let shaped = array.shaped_blocks();
            table.row([
                ("profile", "profile", text(variant.profile.name)),
                ("array", "array", text(array.array.name())),
                ("row_bytes", "row", Cell::Whole(array.row_bytes.into())),
                ("rows", "rows", Cell::Whole(array.rows)),
                ("copies", "copies", Cell::Whole(array.copies.into())),
                ("bytes", "bytes", Cell::Whole(array.bytes())),
                ("ideal_blocks", "by bits", Cell::Whole(array.ideal_blocks())),
                ("shaped_blocks", "by shape", Cell::Whole(shaped.blocks)),
                ("shape", "shape", text(format!("{} x {}", shaped.shape.rows, shaped.shape.bits))),
                ("kind", "kind", Kind::Modelled.cell()),
            ]);
        }
    }
    table.note(
        "Row: bytes. A block is a BRAM_18K of 18,432 bits. By bits: none lost. By shape: the \
         fewest blocks of one shape side by side and one after the other; 1024 x 18 and narrower \
         have two ports that read and write, 512 x 36 one to read and one to write (UG573). The \
         thesis has one shape of body and no shape indices.",
    );
    table
}

fn blocks(scene: &Scene) -> Table {
    let mut table = Table::new("blocks", "BRAM_18K of 1,824 (T6.4, T6.8)");
    let percent = |blocks: u64| blocks as f64 / BLOCKS as f64 * 100.0;
    let share = |blocks: u64| Cell::Share(percent(blocks));
    for (variant, memory) in uses(scene) {
        let thesis = Design::of(variant.profile).map(|design| f64::from(design.block_ram));
        let off =
            |blocks: u64| Cell::known(thesis, |thesis| scene.difference(percent(blocks), thesis));
        let (ideal, shaped) = (memory.ideal_blocks(), memory.shaped_blocks());
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("ideal_blocks", "by bits", Cell::Whole(ideal)),
            ("ideal_percent", "share", share(ideal)),
            ("shaped_blocks", "by shape", Cell::Whole(shaped)),
            ("shaped_percent", "share", share(shaped)),
            ("thesis_percent", "thesis", Cell::known(thesis, Cell::Share)),
            ("ideal_difference_percent", "by bits off", off(ideal)),
            ("shaped_difference_percent", "by shape off", off(shaped)),
            ("shaped_fit", "fits by shape", text(yes_or_no(shaped <= BLOCKS))),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
    }
    table.note(
        "Arrays only: FIFOs of streams and cores come on top. The thesis' shares are from its \
         synthesis report.",
    );
    table
}

fn logic(scene: &Scene) -> Table {
    let mut table = Table::with_columns(
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
    let mut table = Table::new("streams", "Streams against ports and memory while a pass runs");
    for variant in &scene.variants {
        let demand = StreamDemand::new(variant);
        let share = |bandwidth| match bandwidth {
            Bandwidth::Unlimited => Cell::Missing,
            Bandwidth::BytesPerSecond(rate) => Cell::Share(demand.rate / rate as f64 * 100.0),
        };
        let widths: Vec<String> =
            variant.profile.mm2s_widths.iter().map(ToString::to_string).collect();
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("widths", "widths, bits", text(widths.join(" + "))),
            ("ports", "HP ports of 4", Cell::Whole(demand.ports as u64)),
            ("fits", "fits", text(yes_or_no(demand.fits))),
            ("gb_per_second", "GB/s", Cell::Number(demand.rate / 1e9, 2)),
            ("of_peak_percent", "of 17.07", share(Bandwidth::ZCU102_PEAK)),
            ("of_sustained_percent", "of 12.8", share(Bandwidth::ZCU102_SUSTAINED)),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
    }
    table.note(format!(
        "Each stream takes one of the {HP_PORTS} high-performance ports of 128 bits (UG1085). HP1 \
         and HP2 share a port of the memory controller. Above 100 % a pass waits for the memory.",
    ));
    vec![table]
}
