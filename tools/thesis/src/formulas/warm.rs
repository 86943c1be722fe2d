//! The cost of a warm start, in the way that the specification has chosen and in the other one.

use crate::estimate::{WarmCost, WarmStart};

use super::scene::{Scene, whole};
use crate::table::{Cell, Kind, Table, text};

/// The table.
pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let title = "Warm start: impulses in and out";
    let mut table = scene.table("warm", title, Kind::Modelled, |variant| {
        let ways = [
            (WarmStart::OwnPass, "in a pass in front of each kind"),
            (WarmStart::FirstPass, "in the first pass (not built)"),
        ];
        ways.into_iter().filter_map(|(way, name)| {
            let cost = WarmCost::new(variant, way, &scene.step)?;
            let percent = |part: u64, of: u64| Cell::Share(part as f64 / of.max(1) as f64 * 100.0);
            let more_bytes = percent(cost.more_in + cost.more_out, cost.bytes);
            Some([
                ("applied", "impulses are applied", text(name)),
                ("cycles", "cycles without", whole(cost.cycles)),
                ("more_cycles_percent", "cycles more", percent(cost.more_cycles, cost.cycles)),
                ("bytes", "bytes without", whole(cost.bytes)),
                ("more_bytes_percent", "bytes more", more_bytes),
                ("out_percent", "out of it", percent(cost.more_out, cost.bytes)),
            ])
        })
    });
    table.note(
        "Applied at each collision's own turn in the first pass, impulses cost next to nothing and \
         do not hold a pile: a row is solved before its neighbours' impulses are in, and takes its \
         own back.",
    );
    vec![table]
}
