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

/// A port in one clock of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// Cycle of the accelerator, from the start of the interval.
    pub cycle: u32,
    /// Clock of the memory within that cycle.
    pub phase: u32,
    /// Copy of the array.
    pub copy: u32,
    /// Port of that copy.
    pub port: u32,
    /// The access on the port, if any.
    pub access: Option<Access>,
}

/// Accesses of one issue on the ports of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schedule {
    /// Cycles of the accelerator.
    pub interval: u32,
    /// Every slot, by cycle, phase, copy and port.
    pub slots: Vec<Slot>,
}

/// Rows that the collisions of an issue access, in order.
fn accesses(kind: AccessKind, collisions: u32, rows: u32) -> impl Iterator<Item = Access> {
    (0..collisions)
        .flat_map(move |collision| (0..rows).map(move |row| Access { kind, collision, row }))
}

impl Schedule {
    /// Reads first, one after the other to the next copy, then all writes to every copy.
    pub(crate) fn new(ports: &PortUse) -> Self {
        let (copies, pump) = (ports.copies.max(1), ports.pump.max(1));
        let queue = |copy: u32| {
            let reads = accesses(AccessKind::Read, ports.collisions, ports.reads)
                .skip(copy as usize)
                .step_by(copies as usize);
            reads.chain(accesses(AccessKind::Write, ports.collisions, ports.writes))
        };
        let mut queues: Vec<_> = (0..copies).map(queue).collect();
        let interval = ports.interval();
        let mut slots = Vec::new();
        for cycle in 0..interval {
            for phase in 0..pump {
                for (copy, queue) in (0..).zip(&mut queues) {
                    for port in 0..PORTS {
                        slots.push(Slot { cycle, phase, copy, port, access: queue.next() });
                    }
                }
            }
        }
        Self { interval, slots }
    }
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
                let schedule = Schedule::new(&ports);
                assert!(schedule.interval <= profile.initiation_interval);
                let places = |kind, collision, row| {
                    let access = Some(Access { kind, collision, row });
                    schedule.slots.iter().filter(|slot| slot.access == access).collect::<Vec<_>>()
                };
                for collision in 0..ports.collisions {
                    for row in 0..ports.reads {
                        let reads = places(AccessKind::Read, collision, row);
                        assert_eq!(reads.len(), 1, "{ports:?}");
                    }
                    for row in 0..ports.writes {
                        let writes = places(AccessKind::Write, collision, row);
                        let mut copies: Vec<u32> = writes.iter().map(|slot| slot.copy).collect();
                        copies.sort_unstable();
                        assert_eq!(copies, (0..ports.copies).collect::<Vec<_>>(), "{ports:?}");
                    }
                }
                let used = schedule.slots.iter().filter(|slot| slot.access.is_some()).count();
                let rows = ports.reads + ports.copies * ports.writes;
                assert_eq!(used, (ports.collisions * rows) as usize, "{ports:?}");
                for (k, slot) in schedule.slots.iter().enumerate() {
                    let place = |s: &Slot| (s.cycle, s.phase, s.copy, s.port);
                    assert!(slot.cycle < schedule.interval && slot.phase < ports.pump);
                    assert!(schedule.slots[..k].iter().all(|other| place(other) != place(slot)));
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
                    let schedule = Schedule::new(&ports);
                    for kind in [AccessKind::Read, AccessKind::Write] {
                        let of_kind = |slot: &&Slot| slot.access.is_some_and(|a| a.kind == kind);
                        let moment = |slot: &Slot| (slot.cycle, slot.phase, slot.copy);
                        let mut moments: Vec<_> =
                            schedule.slots.iter().filter(of_kind).map(moment).collect();
                        let accesses = moments.len();
                        moments.dedup();
                        assert_eq!(moments.len(), accesses, "{} {ports:?}", profile.name);
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
        let schedule = Schedule::new(account.velocities().expect("they are on chip"));
        for slot in &schedule.slots {
            match slot.access {
                Some(Access { kind: AccessKind::Read, row, .. }) => {
                    assert_eq!((slot.copy, slot.cycle), (row, 0));
                }
                access => assert!(access.is_some(), "no port of the three cycles is idle"),
            }
        }
    }
}
