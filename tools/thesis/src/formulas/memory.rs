//! The tables of on-chip memory and logic.

use crate::estimate::thesis::recorded::Design;
use crate::estimate::{BLOCKS, MemoryUse, ShapedBlocks};
use pgs_interface::profile::Variant;

use super::scene::{Scene, mib, printed_mib, whole, yes_or_no};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![footprint(scene), arrays(scene), blocks(scene), logic(scene)]
}

fn uses(scene: &Scene, variant: &Variant) -> MemoryUse {
    MemoryUse::new(variant, scene.step.bodies, scene.step.collisions)
}

fn footprint(scene: &Scene) -> Table {
    let title = "On-chip memory, MiB (§4.4.2)";
    let mut table = scene.table("memory", title, Kind::Exact, |variant| {
        let memory = uses(scene, variant);
        let design = Design::of(variant.profile);
        let (ours, more) = (memory.block_ram(), memory.with_positions());
        let [thesis, off] = scene.beside(printed_mib(ours), design.map(|it| it.mebibytes), 2);
        let with_positions = design.map(|it| it.mebibytes_with_positions);
        let [thesis_more, off_more] = scene.beside(printed_mib(more), with_positions, 2);
        let room = MemoryUse::collisions_beside(variant, scene.step.bodies);
        [[
            ("mib", "MiB", Cell::Number(mib(ours), 2)),
            ("thesis_mib", "thesis", thesis),
            ("difference_percent", "difference", off),
            ("with_positions_mib", "with positions", Cell::Number(mib(more), 2)),
            ("thesis_with_positions_mib", "thesis", thesis_more),
            ("with_positions_difference_percent", "difference", off_more),
            ("within", "within 4.0 MiB", yes_or_no(memory.fits())),
            ("collisions_that_fit", "room for collisions", whole(room)),
        ]]
    });
    table.note(
        "Differences are of the two digits that the thesis prints. Positions would be kept in as \
         many copies as the velocities; no profile keeps them.",
    );
    table
}

fn arrays(scene: &Scene) -> Table {
    let mut table = scene.table("arrays", "On-chip memory by array", Kind::Modelled, |variant| {
        uses(scene, variant).arrays.into_iter().map(|array| {
            let ShapedBlocks { shape, blocks } = array.shaped_blocks();
            [
                ("array", "array", text(array.array.name())),
                ("row_bytes", "row", whole(array.row_bytes)),
                ("rows", "rows", whole(array.rows)),
                ("copies", "copies", whole(array.copies)),
                ("bytes", "bytes", whole(array.bytes())),
                ("ideal_blocks", "by bits", whole(array.ideal_blocks())),
                ("shaped_blocks", "by shape", whole(blocks)),
                ("shape", "shape", text(format!("{} x {}", shape.rows, shape.bits))),
            ]
        })
    });
    table.note(
        "Row: bytes. A block is a BRAM_18K of 18,432 bits. By bits: none lost. By shape: the \
         fewest blocks of one shape side by side and one after the other; 1024 x 18 and narrower \
         have two ports that read and write, 512 x 36 one to read and one to write (UG573). The \
         thesis has one shape of body and no shape indices.",
    );
    table
}

fn blocks(scene: &Scene) -> Table {
    let percent = |blocks: u64| blocks as f64 / BLOCKS as f64 * 100.0;
    let title = "BRAM_18K of 1,824 (T6.4, T6.8)";
    let mut table = scene.table("blocks", title, Kind::Modelled, |variant| {
        let thesis = Design::of(variant.profile).map(|design| f64::from(design.block_ram));
        let memory = uses(scene, variant);
        let (ideal, shaped) = (memory.ideal_blocks(), memory.shaped_blocks());
        let [ideal_off, shaped_off] = [ideal, shaped].map(|blocks| {
            let [_, off] = scene.beside(percent(blocks), thesis, 0);
            off
        });
        [[
            ("ideal_blocks", "by bits", whole(ideal)),
            ("ideal_percent", "share", Cell::Share(percent(ideal))),
            ("shaped_blocks", "by shape", whole(shaped)),
            ("shaped_percent", "share", Cell::Share(percent(shaped))),
            ("thesis_percent", "thesis", Cell::known(thesis, Cell::Share)),
            ("ideal_difference_percent", "by bits off", ideal_off),
            ("shaped_difference_percent", "by shape off", shaped_off),
            ("shaped_within", "within 1,824 by shape", yes_or_no(shaped <= BLOCKS)),
        ]]
    });
    table.note(
        "Arrays only: FIFOs of streams and cores come on top. The thesis' shares are from its \
         synthesis report.",
    );
    table
}

fn logic(scene: &Scene) -> Table {
    let mut table = Table::new("logic", "Logic, percent of the device (T6.4, T6.8)");
    for variant in &scene.variants {
        let design = Design::of(variant.profile);
        let share = |of: fn(&Design) -> u32| Cell::known(design, |it| Cell::Share(of(it).into()));
        let source = design.map_or("not known: nothing was synthesised", |design| design.results);
        let kind = if design.is_some() { Kind::Recorded } else { Kind::Open };
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("dsp", "DSP48E", share(|design| design.dsp)),
            ("lut", "LUT", share(|design| design.lookup_tables)),
            ("ff", "FF", share(|design| design.flip_flops)),
            ("source", "source", text(source)),
            ("kind", "kind", kind.cell()),
        ]);
    }
    table
}
