//! The tables of the block RAM ports: the initiation interval that they allow, and the schedule of
//! each port.

use crate::estimate::{Access, AccessKind, PortAccount, PortUse, Schedule, Slot};

use super::scene::{Scene, yes_or_no};
use crate::table::{Cell, Kind, Table, text};

/// The pump's demands on the device, and what is known of them.
pub(super) const PUMP: &str = "The pump, block RAM at twice the accelerator's clock (500 or 550 \
    MHz), is a design assumption and was not synthesised. A global clock tree may run at 775 MHz \
    (DS925 1.29, clock buffers, speed grade -2, 0.85 V); the limit of the block RAM itself in \
    DS925 was not verified.";

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![arrays(scene), intervals(scene), schedule(scene), alternatives(scene), load(scene)]
}

fn arrays(scene: &Scene) -> Table {
    let mut table =
        Table::new("ports", "On-chip accesses of one issue, and the limit of the ports");
    for variant in &scene.variants {
        for ports in PortAccount::new(variant).arrays {
            table.row([
                ("profile", "profile", text(variant.profile.name)),
                ("array", "array", text(ports.array.name())),
                ("collisions", "collisions", Cell::Whole(ports.collisions.into())),
                ("reads", "reads", Cell::Whole((ports.reads * ports.collisions).into())),
                ("writes", "writes", Cell::Whole((ports.writes * ports.collisions).into())),
                ("copies", "copies", Cell::Whole(ports.copies.into())),
                ("accesses", "busiest copy", Cell::Whole(ports.accesses().into())),
                ("pump", "pump", Cell::Whole(ports.pump.into())),
                ("interval", "cycles", Cell::Whole(ports.interval().into())),
                ("kind", "kind", Kind::Exact.cell()),
            ]);
        }
    }
    table.note(
        "A copy has two ports; each takes one row a clock, twice that many with a pump of 2. A \
         read goes to one copy, a write to all: cycles = ceil(busiest copy / (2 x pump)).",
    );
    table
}

fn intervals(scene: &Scene) -> Table {
    let mut table = Table::new("interval", "Initiation interval, cycles an issue");
    for variant in &scene.variants {
        let account = PortAccount::new(variant);
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("by_ports", "by ports", Cell::Whole(account.by_ports().into())),
            ("by_streams", "by streams", Cell::Whole(account.by_streams.into())),
            ("claimed", "claimed", Cell::Whole(account.claimed.into())),
            (
                "collisions",
                "collisions an issue",
                Cell::Whole(variant.profile.collisions_per_issue.into()),
            ),
            ("justified", "justified", text(yes_or_no(account.claimed >= account.smallest()))),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    table
}

/// An access, as `read A`, with the number of its collision if several are issued together.
fn access(ports: &PortUse, access: &Access) -> String {
    let verb = match (access.kind, access.row) {
        (AccessKind::Read, _) => "read",
        (AccessKind::Write, 0 | 1) => "write",
        // Forwarded from the unit before.
        (AccessKind::Write, _) => "take",
    };
    let body = match (ports.array, access.row % 2) {
        (array, _) if !array.is_of_bodies() => "",
        (_, 0) => " A",
        (_, _) => " B",
    };
    if ports.collisions > 1 {
        format!("{verb}{body} of {}", access.collision + 1)
    } else {
        format!("{verb}{body}")
    }
}

fn schedule(scene: &Scene) -> Table {
    let mut table = Table::new("schedule", "Schedule of the ports, by cycle of the interval");
    for variant in &scene.variants {
        for ports in PortAccount::new(variant).arrays {
            let mut slots = Schedule::new(&ports).slots;
            slots.sort_by_key(|slot| (slot.copy, slot.cycle, slot.phase, slot.port));
            for pair in slots.chunks(2) {
                let [first, ..] = pair else { continue };
                let port = |number: u32| {
                    let slot = pair.iter().find(|slot: &&Slot| slot.port == number);
                    let found = slot.and_then(|slot| slot.access);
                    text(found.map_or("idle".to_owned(), |found| access(&ports, &found)))
                };
                table.row([
                    ("profile", "profile", text(variant.profile.name)),
                    ("array", "array", text(ports.array.name())),
                    ("copy", "copy", Cell::Whole((first.copy + 1).into())),
                    ("cycle", "cycle", Cell::Whole((first.cycle + 1).into())),
                    ("clock", "clock", Cell::Whole((first.phase + 1).into())),
                    ("port_a", "port A", port(0)),
                    ("port_b", "port B", port(1)),
                    ("kind", "kind", Kind::Exact.cell()),
                ]);
            }
        }
    }
    table.note(
        "Clock counts the block RAM's clocks within a cycle. Writes belong to an issue that \
         entered the pipeline earlier. Take: the last use of a body in the pass before, written \
         into the memory of the next unit; at most two happen at once.",
    );
    table
}

fn alternatives(scene: &Scene) -> Table {
    let mut table = Table::new(
        "copies",
        "Cycles an issue by the velocities' ports, with other copies and clocks",
    );
    for variant in &scene.variants {
        let account = PortAccount::new(variant);
        let Some(velocities) = account.velocities() else { continue };
        for pump in [1, 2] {
            let cycles = |copies| Cell::Whole(velocities.with(copies, pump).interval().into());
            table.row([
                ("profile", "profile", text(variant.profile.name)),
                ("pump", "pump", Cell::Whole(pump.into())),
                ("one", "1 copy", cycles(1)),
                ("two", "2 copies", cycles(2)),
                ("three", "3 copies", cycles(3)),
                ("many", "1,000 copies", cycles(1_000)),
                ("kind", "kind", Kind::Exact.cell()),
            ]);
        }
    }
    table.note(
        "Both writes of a collision go to every copy, so that without a pump no number of copies \
         brings one collision below 2 cycles, or two below 3 (§5.5.3).",
    );
    table.note(PUMP);
    table.note(
        "Considered instead: banks by body colour, one read and one write a cycle each, without \
         copy or pump. The order of the collisions must then keep the two bodies of a collision in \
         different banks.",
    );
    table
}

fn load(scene: &Scene) -> Table {
    let mut table = Table::new("load", "Loading the velocities: cycles by streams and by ports");
    for variant in &scene.variants {
        for load in PortAccount::new(variant).load(variant, scene.step.bodies) {
            table.row([
                ("profile", "profile", text(variant.profile.name)),
                ("array", "array", text(load.array.name())),
                ("by_streams", "by streams", Cell::Whole(load.by_streams)),
                ("by_ports", "by ports of one bank", Cell::Whole(load.by_ports)),
                ("banks", "banks needed", Cell::Whole(load.banks)),
                ("kind", "kind", Kind::Exact.cell()),
            ]);
        }
    }
    table.note(
        "The cycle formula takes the streams. Where the ports of one bank are slower the bodies \
         need \
         banks by number: no more bits, by shape a few blocks more, and the passes lose nothing.",
    );
    table
}
