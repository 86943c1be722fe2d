//! Block RAM ports: the initiation interval that the on-chip arrays allow.
//!
//! A block RAM has two ports; each reads or writes one row a clock. A collision reads the
//! velocities of two bodies and writes both back; its accumulated impulses are read and written
//! once. A read goes to one copy of an array, a write to every copy, so that copies help reads
//! alone; a block RAM clock that is a multiple of the accelerator's (a *pump*) helps both.
//!
//! ```text
//! II by ports = ceil((reads / copies + writes) x collisions per issue / (2 x pump))
//!   float  (2 / 1 + 2) x 1 / 2 = 2        half   (2 / 2 + 2) x 2 / 2 = 3
//!   naive  (2 / 1 + 2) x 1 / 2 = 2, its stream needs 28
//! ```

use super::arrays::OnChipArray;
use super::step::StepShape;
use super::traffic::{Records, StepTraffic};
use pgs_interface::profile::{Inertia, Variant};

/// Ports of a block RAM.
pub const PORTS: u32 = 2;

/// Use of the ports of one array during a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortUse {
    /// The array.
    pub array: OnChipArray,
    /// Rows that a collision reads.
    pub reads: u32,
    /// Rows that a collision writes.
    pub writes: u32,
    /// Collisions that are issued together.
    pub collisions: u32,
    /// Copies of the array.
    pub copies: u32,
    /// Accesses of a port in one cycle of the accelerator.
    pub pump: u32,
}

impl PortUse {
    /// Accesses of one issue to the busiest copy.
    #[must_use]
    pub fn accesses(&self) -> u32 {
        let reads = self.reads * self.collisions;
        reads.div_ceil(self.copies) + self.writes * self.collisions
    }

    /// Cycles that one issue occupies the ports of the busiest copy.
    #[must_use]
    pub fn interval(&self) -> u32 {
        self.accesses().div_ceil(PORTS * self.pump).max(1)
    }

    /// Whether an issue reads no more than one row and writes no more than one: a port for each is
    /// then enough, and the block takes its wide shape.
    #[must_use]
    pub const fn simple(&self) -> bool {
        self.reads * self.collisions <= 1 && self.writes * self.collisions <= 1
    }

    /// The same array with other copies and another pump.
    #[must_use]
    pub const fn with(self, copies: u32, pump: u32) -> Self {
        Self { copies, pump, ..self }
    }
}

/// The ports of a variant of a profile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortAccount {
    /// Each array, the velocities first.
    pub arrays: Vec<PortUse>,
    /// Interval that the streams allow: cycles of the busiest stream for one issue.
    pub by_streams: u32,
}

impl PortAccount {
    /// The account of a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant) -> Self {
        let profile = variant.profile;
        let memory = profile.memory;
        let velocities = PortUse {
            array: OnChipArray::Velocities,
            reads: 2,
            writes: 2,
            collisions: profile.collisions_per_issue,
            copies: memory.velocity_copies,
            pump: memory.pump,
        };
        // No other array needs copies or a pump.
        let plain = velocities.with(1, 1);
        let once = |array| PortUse { array, reads: 1, writes: 1, ..plain };
        let mut arrays = vec![velocities, once(OnChipArray::Impulses)];
        if variant.inertia == Inertia::World {
            arrays.push(PortUse { array: OnChipArray::Inertia, writes: 0, ..plain });
        }
        if memory.shape_index_bytes > 0 {
            arrays.push(PortUse { array: OnChipArray::ShapeIndices, writes: 0, ..plain });
        }
        Self { arrays, by_streams: stream_interval(variant) }
    }

    /// Interval that the ports of all arrays allow.
    #[must_use]
    pub fn by_ports(&self) -> u32 {
        self.arrays.iter().map(PortUse::interval).max().unwrap_or(1)
    }

    /// Use of the velocities' ports; they decide.
    #[must_use]
    pub fn velocities(&self) -> &PortUse {
        &self.arrays[0]
    }
}

/// Cycles of the busiest stream for one issue, averaged over whole groups of beats.
fn stream_interval(variant: &Variant) -> u32 {
    let profile = variant.profile;
    let issues = profile.stripes.collisions.streams.len() as u64;
    let step = StepShape::new(0, issues * u64::from(profile.collisions_per_issue));
    let cycles = StepTraffic::new(variant, Records::Streamed, &step).collisions.cycles;
    u32::try_from(cycles.div_ceil(issues)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, PROFILES, Profile};

    fn account(profile: &'static Profile) -> PortAccount {
        PortAccount::new(&profile.default_variant())
    }

    #[test]
    fn the_tables_intervals_are_what_ports_and_streams_allow() {
        let both = |profile| {
            let account = account(profile);
            (account.by_ports(), account.by_streams)
        };
        assert_eq!(both(&FLOAT), (2, 2));
        assert_eq!(both(&HALF), (3, 3));
        assert_eq!(both(&NAIVE), (2, 28));
        for profile in PROFILES {
            for inertia in [Inertia::Isotropic, Inertia::World] {
                let variant = Variant { inertia, ..profile.default_variant() };
                let account = PortAccount::new(&variant);
                let smallest = account.by_ports().max(account.by_streams);
                assert_eq!(smallest, profile.initiation_interval, "{}", profile.name);
            }
        }
    }

    /// Thesis §5.5.3: one copy 4, two copies 3, more copies still 3.
    #[test]
    fn two_copies_bring_half_from_four_to_three_and_no_lower() {
        let account = account(&HALF);
        let velocities = account.velocities();
        let interval = |copies| velocities.with(copies, 1).interval();
        assert_eq!([interval(1), interval(2), interval(3), interval(1000)], [4, 3, 3, 3]);
    }
}
