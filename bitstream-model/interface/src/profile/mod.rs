//! The accelerator's builds as data: the profiles, their variants, and the sizes that follow.
//!
//! [`table`] has one entry a profile. A board reports its profile and the options of its build
//! through the capability registers ([`control`](super::control)). The driver, the emulated board
//! and the cycle and memory models all compute from the same entry.

pub mod solver;
pub mod table;

pub use table::{FLOAT, HALF, NAIVE, PROFILES};

use super::number::{Numbers, StreamFormat};
use super::record::{LANES, collision, pose, result, velocity};
use super::stripe::Stripes;

/// Depth of one kind of pass, clock cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Depth {
    /// First collision in to last write-back.
    pub fill: u32,
    /// Read of a body's velocity to its write-back.
    pub window: u32,
}

/// 32-bit words that a record takes on a stream; two sixteen-bit numbers make one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordWords {
    /// Velocity of a body.
    pub velocity: u32,
    /// Collision.
    pub collision: u32,
    /// Pose of a body.
    pub pose: u32,
    /// Result of a body.
    pub result: u32,
}

/// The records as the thesis packs them, without padding, in numbers (Tables 4.1 to 4.6).
pub const THESIS_WORDS: RecordWords =
    RecordWords { velocity: 6, collision: 27, pose: 7, result: 6 };

/// How a bitstream knows the inertia of its bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Inertia {
    /// One number a shape, the same about every axis: cubes, spheres.
    #[default]
    Isotropic,
    /// The inverse inertia of every body about world axes, six numbers that are streamed with its
    /// velocity and kept on chip: boxes, capsules, anything.
    World,
}

/// On-chip memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnChipMemory {
    /// Block RAM that bodies and collisions share, bytes (thesis: 4.0 MiB on the XCZU9EG).
    pub bytes: u32,
    /// Copies of the velocities. A read goes to one of them, a write to all.
    pub velocity_copies: u32,
    /// Clock of the block RAM as a multiple of the accelerator's: a port serves this number of
    /// accesses a cycle.
    pub pump: u32,
    /// Shape index of a body, bytes. It has a block RAM of its own, which [`bytes`](Self::bytes)
    /// does not count. The thesis has one shape and needs none.
    pub shape_index_bytes: u32,
}

/// One design of the accelerator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Identifier in the PROFILE register.
    pub id: u32,
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// Formats, unless the bitstream was built with others of the same widths on the streams.
    pub numbers: Numbers,
    /// Width of each MM2S stream, bits.
    pub mm2s_widths: &'static [u32],
    /// Width of each S2MM stream, bits.
    pub s2mm_widths: &'static [u32],
    /// How beats are dealt out to the streams.
    pub stripes: Stripes,
    /// Cycles from one issue to the next.
    pub initiation_interval: u32,
    /// Whether collisions enter in slots of the initiation interval in every pass. Where the records
    /// of a warm pass take their streams longer, slots stay empty; otherwise the interval is longer.
    pub slotted: bool,
    /// Collisions that enter the pipeline together. A last issue that is not full is filled up with
    /// padding collisions.
    pub collisions_per_issue: u32,
    /// Depth of the issue queue of an interlocked build in collisions, unless it was built with
    /// another one; 0: it has none. `None`: no build has one.
    pub queue: Option<u32>,
    /// Contact pipeline with isotropic inertia; [`Variant::contact`] has the one of a build.
    pub contact: Depth,
    /// Friction pipeline with isotropic inertia.
    pub friction: Depth,
    /// Contact and friction pipeline with world inertia; `None`: there is no such build.
    pub world: Option<[Depth; 2]>,
    /// Fill of the integration, clock cycles: from the last body in to the end of the step, the
    /// control around the pipeline included. It is the same for every step.
    pub integration_fill: u32,
    /// Whether arithmetic in f32 takes subnormal operands for zero, and makes results zero that are
    /// subnormal after rounding, with their sign, as the generated Verilog does. Arithmetic in
    /// binary16 keeps them.
    pub flushes_subnormals: bool,
    /// Clock of accelerator and streams, kHz.
    pub clock_khz: u32,
    /// On-chip memory.
    pub memory: OnChipMemory,
    /// Largest number of bodies, whatever the memory.
    pub body_capacity: u32,
    /// Entries of the shape table.
    pub shape_capacity: u32,
    /// Where the profile is described.
    pub source: &'static str,
}

impl Profile {
    /// The profile of that name.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        PROFILES.iter().copied().find(|profile| profile.name == name)
    }

    /// The profile with that identifier.
    #[must_use]
    pub fn by_id(id: u32) -> Option<&'static Self> {
        PROFILES.iter().copied().find(|profile| profile.id == id)
    }

    /// Cycles from the beginning of a pass to an issue, without stalls and waits, where the records
    /// of an issue take their streams `of_streams` cycles.
    #[must_use]
    pub const fn issue_at(&self, issue: u64, of_streams: u64) -> u64 {
        let interval = self.initiation_interval as u64;
        let longer = if of_streams > interval { of_streams } else { interval };
        match self.slotted {
            true => issue * longer / interval * interval,
            false => issue * longer,
        }
    }

    /// Cycles of a pass of some issues without its fill, stalls and waits, likewise.
    #[must_use]
    pub const fn issues_take(&self, issues: u64, of_streams: u64) -> u64 {
        match (issues, self.slotted) {
            (0, _) => 0,
            (_, true) => self.issue_at(issues - 1, of_streams) + self.initiation_interval as u64,
            (_, false) => self.issue_at(issues, of_streams),
        }
    }

    /// Whether an interlocked build can have an issue queue: collisions leave it one by one.
    #[must_use]
    pub const fn has_queue(&self) -> bool {
        self.queue.is_some() && self.collisions_per_issue == 1
    }

    /// The forms of inertia with which it can be built.
    #[must_use]
    pub const fn inertias(&self) -> &'static [Inertia] {
        match self.world {
            Some(_) => &[Inertia::Isotropic, Inertia::World],
            None => &[Inertia::Isotropic],
        }
    }

    /// The profile with the default options of a build.
    #[must_use]
    pub const fn default_variant(&'static self) -> Variant {
        Variant { profile: self, numbers: self.numbers, inertia: Inertia::Isotropic }
    }
}

/// A profile with the options of a bitstream's build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// The design.
    pub profile: &'static Profile,
    /// Its formats.
    pub numbers: Numbers,
    /// The form in which it takes the inertia of bodies.
    pub inertia: Inertia,
}

/// Numbers of a velocity, and of a world inverse inertia.
const SIX: u32 = 6;
/// Numbers of the accumulated impulses of a collision.
const FOUR: u32 = 4;

impl Variant {
    /// Whether each collision can have a friction of its own: in f32 a record has room for it above
    /// the number of its contact points.
    #[must_use]
    pub const fn has_pair_friction(&self) -> bool {
        matches!(self.numbers.collisions, StreamFormat::F32)
    }

    /// Whether velocity records can bring the inverse mass of their body: the rows of a world
    /// inertia have room for it.
    #[must_use]
    pub const fn has_streamed_masses(&self) -> bool {
        matches!(self.inertia, Inertia::World)
    }

    /// Contact pipeline.
    #[must_use]
    pub const fn contact(&self) -> Depth {
        match (self.inertia, self.profile.world) {
            (Inertia::World, Some([contact, _])) => contact,
            _ => self.profile.contact,
        }
    }

    /// Friction pipeline.
    #[must_use]
    pub const fn friction(&self) -> Depth {
        match (self.inertia, self.profile.world) {
            (Inertia::World, Some([_, friction])) => friction,
            _ => self.profile.friction,
        }
    }

    /// Rows of a velocity record.
    #[must_use]
    pub const fn velocity_rows(&self) -> usize {
        match self.inertia {
            Inertia::Isotropic => velocity::ROWS,
            Inertia::World => velocity::WORLD_ROWS,
        }
    }

    /// 32-bit words of the records on the streams.
    #[must_use]
    pub const fn words(&self) -> RecordWords {
        const fn words(rows: usize, format: StreamFormat) -> u32 {
            #[expect(clippy::cast_possible_truncation, reason = "a record has few words")]
            let numbers = (rows * LANES) as u32;
            numbers * format.bits() / u32::BITS
        }
        let (bodies, poses) = (self.numbers.bodies, self.numbers.poses);
        RecordWords {
            velocity: words(self.velocity_rows(), bodies),
            collision: words(collision::ROWS, self.numbers.collisions),
            pose: words(pose::ROWS, poses),
            result: words(result::ROWS, poses),
        }
    }

    /// On-chip bytes that a body takes: all copies of its velocity, and its inertia.
    #[must_use]
    pub const fn bytes_per_body(&self) -> u32 {
        let velocities =
            SIX * self.numbers.velocities.bytes() * self.profile.memory.velocity_copies;
        let inertia = match self.inertia {
            Inertia::Isotropic => 0,
            Inertia::World => SIX * self.numbers.velocities.bytes(),
        };
        velocities + inertia
    }

    /// On-chip bytes that a collision takes: its accumulated impulses.
    #[must_use]
    pub const fn bytes_per_collision(&self) -> u32 {
        FOUR * self.numbers.impulses.bytes()
    }

    /// Largest number of bodies: the profile's capacity, or the number that an index can name if
    /// that is smaller.
    #[must_use]
    pub fn body_capacity(&self) -> u32 {
        let by_index = self.numbers.collisions.largest_index().saturating_add(1);
        self.profile.body_capacity.min(by_index)
    }
}
