//! The tables of the block RAM ports: the initiation interval that they allow, and the schedule of
//! each port.

use crate::estimate::{Access, AccessKind, PortAccount, PortUse, Slot, schedule as schedule_of};

use super::scene::{Scene, whole, yes_or_no};
use crate::table::{Kind, Table, text};

/// The pump's demands on the device, and what is known of them.
pub(super) const PUMP: &str = "The pump, block RAM at twice the accelerator's clock (500 or 550 \
    MHz), is a design assumption and was not synthesised. A global clock tree may run at 775 MHz \
    (DS925 1.29, clock buffers, speed grade -2, 0.85 V); the limit of the block RAM itself in \
    DS925 was not verified.";

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![arrays(scene), intervals(scene), schedule(scene), alternatives(scene), load(scene)]
}

fn arrays(scene: &Scene) -> Table {
    let title = "On-chip accesses of one issue, and the limit of the ports";
    let mut table = scene.table("ports", title, Kind::Exact, |variant| {
        PortAccount::new(variant).arrays.into_iter().map(|ports| {
            [
                ("array", "array", text(ports.array.name())),
                ("collisions", "collisions", whole(ports.collisions)),
                ("reads", "reads", whole(ports.reads * ports.collisions)),
                ("writes", "writes", whole(ports.writes * ports.collisions)),
                ("copies", "copies", whole(ports.copies)),
                ("accesses", "busiest copy", whole(ports.accesses())),
                ("pump", "pump", whole(ports.pump)),
                ("interval", "cycles", whole(ports.interval())),
            ]
        })
    });
    table.note(
        "A copy has two ports; each takes one row a clock, twice that many with a pump of 2. A \
         read goes to one copy, a write to all: cycles = ceil(busiest copy / (2 x pump)).",
    );
    table
}

fn intervals(scene: &Scene) -> Table {
    let title = "Initiation interval, cycles an issue";
    scene.table("interval", title, Kind::Exact, |variant| {
        let account = PortAccount::new(variant);
        let collisions = whole(variant.profile.collisions_per_issue);
        [[
            ("by_ports", "by ports", whole(account.by_ports())),
            ("by_streams", "by streams", whole(account.by_streams)),
            ("claimed", "claimed", whole(account.claimed)),
            ("collisions", "collisions an issue", collisions),
            ("justified", "justified", yes_or_no(account.claimed >= account.smallest())),
        ]]
    })
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
    let title = "Schedule of the ports, by cycle of the interval";
    let mut table = scene.table("schedule", title, Kind::Exact, |variant| {
        let row = |ports: PortUse, slot: Slot| {
            let [a, b] = slot.ports.map(|found| match found {
                Some(found) => text(access(&ports, &found)),
                None => text("idle"),
            });
            [
                ("array", "array", text(ports.array.name())),
                ("copy", "copy", whole(slot.copy + 1)),
                ("cycle", "cycle", whole(slot.cycle + 1)),
                ("clock", "clock", whole(slot.phase + 1)),
                ("port_a", "port A", a),
                ("port_b", "port B", b),
            ]
        };
        let arrays = PortAccount::new(variant).arrays.into_iter();
        arrays.flat_map(move |ports| {
            schedule_of(&ports).into_iter().map(move |slot| row(ports, slot))
        })
    });
    table.note(
        "Clock counts the block RAM's clocks within a cycle. Writes belong to an issue that \
         entered the pipeline earlier. Take: the last use of a body in the pass before, written \
         into the memory of the next unit; at most two happen at once.",
    );
    table
}

fn alternatives(scene: &Scene) -> Table {
    let title = "Cycles an issue by the velocities' ports, with other copies and clocks";
    let mut table = scene.table("copies", title, Kind::Exact, |variant| {
        let velocities = *PortAccount::new(variant).velocities();
        [1, 2].map(|pump| {
            let cycles = |copies| whole(velocities.with(copies, pump).interval());
            [
                ("pump", "pump", whole(pump)),
                ("one", "1 copy", cycles(1)),
                ("two", "2 copies", cycles(2)),
                ("three", "3 copies", cycles(3)),
                ("many", "1,000 copies", cycles(1_000)),
            ]
        })
    });
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
    let title = "Loading the velocities: cycles by streams and by ports";
    let mut table = scene.table("load", title, Kind::Exact, |variant| {
        PortAccount::new(variant).load(variant, scene.step.bodies).into_iter().map(|load| {
            [
                ("array", "array", text(load.array.name())),
                ("by_streams", "by streams", whole(load.by_streams)),
                ("by_ports", "by ports of one bank", whole(load.by_ports)),
                ("banks", "banks needed", whole(load.banks)),
            ]
        })
    });
    table.note(
        "The cycle formula takes the streams. Where the ports of one bank are slower the bodies \
         need \
         banks by number: no more bits, by shape a few blocks more, and the passes lose nothing.",
    );
    table
}
