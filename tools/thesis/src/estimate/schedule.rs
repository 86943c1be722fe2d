//! Lays the accesses of one issue out on the ports, cycle by cycle.
//!
//! Once the pipeline is full, the reads of an issue and the write-backs of an earlier issue share
//! an interval; the table repeats every interval.

use super::ports::{PORTS, PortUse};

/// The kind of an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccessKind {
    /// A row is read, from one copy.
    Read,
    /// A row is written, to every copy.
    Write,
}

/// One access to a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Read or write.
    pub kind: AccessKind,
    /// Collision of the issue.
    pub collision: u32,
    /// Row of that collision: 0 for body A, 1 for body B.
    pub row: u32,
}

/// Both ports of a copy in one clock of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// Cycle of the accelerator, from the start of the interval.
    pub cycle: u32,
    /// Clock of the memory within that cycle.
    pub phase: u32,
    /// Copy of the array.
    pub copy: u32,
    /// The access on each port, if any.
    pub ports: [Option<Access>; PORTS as usize],
}

/// Rows that the collisions of an issue access, in order.
fn accesses(kind: AccessKind, collisions: u32, rows: u32) -> impl Iterator<Item = Access> {
    (0..collisions)
        .flat_map(move |collision| (0..rows).map(move |row| Access { kind, collision, row }))
}

/// The accesses of one issue on the ports of an array, copy by copy: reads first, one after the
/// other to the next copy, then all writes to every copy.
#[must_use]
pub fn schedule(ports: &PortUse) -> Vec<Slot> {
    let mut slots = Vec::new();
    for copy in 0..ports.copies {
        let reads = accesses(AccessKind::Read, ports.collisions, ports.reads);
        let writes = accesses(AccessKind::Write, ports.collisions, ports.writes);
        let mut queue = reads.skip(copy as usize).step_by(ports.copies as usize).chain(writes);
        for cycle in 0..ports.interval() {
            for phase in 0..ports.pump {
                let ports = [(); PORTS as usize].map(|()| queue.next());
                slots.push(Slot { cycle, phase, copy, ports });
            }
        }
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::DESIGNS;
    use crate::estimate::PortAccount;
    use pgs_interface::profile::{HALF, Inertia, Variant};

    /// Counts from the slots alone, independently of the code that fills them.
    #[test]
    fn every_read_has_one_port_and_every_write_one_in_each_copy() {
        for profile in DESIGNS {
            let variant = Variant { inertia: Inertia::World, ..profile.default_variant() };
            for ports in PortAccount::new(&variant).arrays {
                let slots = schedule(&ports);
                let found: Vec<(u32, Access)> = slots
                    .iter()
                    .flat_map(|slot| slot.ports.into_iter().flatten().map(|it| (slot.copy, it)))
                    .collect();
                for collision in 0..ports.collisions {
                    let copies = |kind, row| -> Vec<u32> {
                        let access = Access { kind, collision, row };
                        found
                            .iter()
                            .filter(|(_, it)| *it == access)
                            .map(|(copy, _)| *copy)
                            .collect()
                    };
                    for row in 0..ports.reads {
                        assert_eq!(copies(AccessKind::Read, row).len(), 1, "{ports:?}");
                    }
                    for row in 0..ports.writes {
                        let all: Vec<_> = (0..ports.copies).collect();
                        assert_eq!(copies(AccessKind::Write, row), all, "{ports:?}");
                    }
                }
                let rows = ports.reads + ports.copies * ports.writes;
                assert_eq!(found.len(), (ports.collisions * rows) as usize, "{ports:?}");
                for (k, slot) in slots.iter().enumerate() {
                    let place = |s: &Slot| (s.cycle, s.phase, s.copy);
                    assert!(slot.cycle < profile.initiation_interval && slot.phase < ports.pump);
                    assert!(slots[..k].iter().all(|other| place(other) != place(slot)));
                }
            }
        }
    }

    /// Otherwise the wide shape of a block, one port each way, could not serve the array.
    #[test]
    fn a_simple_array_never_has_two_accesses_of_a_kind_at_once() {
        let mut simple = 0;
        for profile in DESIGNS {
            for inertia in [Inertia::Isotropic, Inertia::World] {
                let account = PortAccount::new(&Variant { inertia, ..profile.default_variant() });
                for ports in account.arrays.into_iter().filter(PortUse::simple) {
                    simple += 1;
                    for slot in schedule(&ports) {
                        for kind in [AccessKind::Read, AccessKind::Write] {
                            let of_kind = slot.ports.iter().flatten().filter(|it| it.kind == kind);
                            assert!(of_kind.count() <= 1, "{} {ports:?}", profile.name);
                        }
                    }
                }
            }
        }
        assert!(simple > 0, "some array is simple");
    }

    /// Thesis §5.5.3: body A from the first copy, body B from the second, both to both.
    #[test]
    fn half_reads_body_a_from_one_copy_and_body_b_from_the_other() {
        let account = PortAccount::new(&HALF.default_variant());
        for slot in schedule(account.velocities()) {
            for access in slot.ports {
                match access {
                    Some(Access { kind: AccessKind::Read, row, .. }) => {
                        assert_eq!((slot.copy, slot.cycle), (row, 0));
                    }
                    access => assert!(access.is_some(), "no port of the three cycles is idle"),
                }
            }
        }
    }
}
