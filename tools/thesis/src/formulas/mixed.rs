//! Compares `mixed` with `float`: the gain of the first design beyond the thesis.

use crate::estimate::thesis::recorded::FLOAT_DESIGN;
use crate::estimate::{MIXED, MemoryUse, PortAccount, Records, StepTime};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, Variant};

use super::ports::PUMP;
use super::scene::{Scene, mib};
use crate::table::{Cell, Kind, Table, text};

/// The table, if `mixed` is among the profiles.
pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let mixed = scene.variants.iter().find(|variant| variant.profile.id == MIXED.id);
    mixed.map(|mixed| against_float(scene, mixed)).into_iter().collect()
}

fn against_float(scene: &Scene, mixed: &Variant) -> Table {
    let float = Variant { inertia: mixed.inertia, ..FLOAT.default_variant() };
    let mut table = Table::new("mixed", "mixed against float, records as streamed");
    let mut row = |name: &str, digits: usize, of: &dyn Fn(&Variant) -> f64, kind: Kind| {
        let (ours, theirs) = (of(mixed), of(&float));
        table.row([
            ("figure", "figure", text(name)),
            ("mixed", "mixed", Cell::Number(ours, digits)),
            ("float", "float", Cell::Number(theirs, digits)),
            ("mixed_of_float_percent", "mixed of float", Cell::Share(ours / theirs * 100.0)),
            ("kind", "kind", kind.cell()),
        ]);
    };
    let time = |variant: &Variant, bandwidth| {
        StepTime::new(variant, Records::Streamed, &scene.step, bandwidth)
    };
    let memory =
        |variant: &Variant| MemoryUse::new(variant, scene.step.bodies, scene.step.collisions);
    for (at, bandwidth) in
        [("unlimited", Bandwidth::Unlimited), ("12.8 GB/s", Bandwidth::ZCU102_SUSTAINED)]
    {
        row(&format!("cycles at {at}"), 0, &|v| time(v, bandwidth).cycles(v), Kind::Modelled);
        row(&format!("ms at {at}"), 3, &|v| time(v, bandwidth).seconds * 1e3, Kind::Modelled);
    }
    let bytes = |v: &Variant| time(v, Bandwidth::Unlimited).bytes as f64;
    row("bytes a step", 0, &bytes, Kind::Exact);
    row("block RAM, MiB", 2, &|v| mib(memory(v).block_ram()), Kind::Exact);
    row("BRAM_18K by shape", 0, &|v| memory(v).shaped_blocks() as f64, Kind::Modelled);
    row("cycles a collision", 0, &|v| PortAccount::new(v).claimed.into(), Kind::Exact);

    let half = 2.0 * bytes(mixed) <= bytes(&float);
    table.note(format!("Bytes: {} half of float's.", if half { "at most" } else { "more than" }));
    let account = PortAccount::new(mixed);
    table.note(format!(
        "Initiation interval {}: the ports of the on-chip arrays allow {}, the beats of a record \
         on its streams {}; {}.",
        account.claimed,
        account.by_ports(),
        account.by_streams,
        if account.claimed >= account.smallest() { "justified" } else { "not justified" },
    ));
    table.note(PUMP);
    let ours = time(mixed, Bandwidth::ZCU102_SUSTAINED).seconds * 1e3;
    if scene.is_thesis_step() {
        table.note(format!(
            "At 12.8 GB/s {ours:.3} ms, modelled; the thesis records {} ms for its float design, \
             without a wait for memory.",
            FLOAT_DESIGN.latency_ms
        ));
    }
    table
}
