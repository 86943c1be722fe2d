//! This file describes the accelerator's builds as data: one table entry a profile.
//!
//! A board reports its profile through the capability registers
//! ([`control`](super::control)); these tables are what the emulated board reports from and what
//! the cycle and memory models compute with.

/// How numbers are carried on the streams and computed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NumberFormat {
    /// IEEE 754 binary32, every operation rounded on its own to nearest even.
    F32,
}

/// Depth of one kind of pass, clock cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Depth {
    /// First collision in to last write-back.
    pub fill: u32,
    /// Read of a body's velocity to its write-back.
    pub window: u32,
}

/// 32-bit words that a record takes.
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

/// The records as the thesis packs them, without padding (Tables 4.1 to 4.6).
pub const THESIS_WORDS: RecordWords =
    RecordWords { velocity: 6, collision: 27, pose: 7, result: 6 };

/// On-chip memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnChipMemory {
    /// Block RAM that bodies and collisions share, bytes (thesis: 4.0 MiB on the XCZU9EG).
    pub bytes: u32,
    /// Velocities of a body, all copies, bytes.
    pub bytes_per_body: u32,
    /// Accumulated impulses of a collision, bytes.
    pub bytes_per_collision: u32,
    /// Shape index of a body, bytes; kept in distributed RAM, not in the block RAM above. The
    /// thesis has one shape and needs none.
    pub shape_index_bytes: u32,
}

/// One build of the accelerator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Identifier in the PROFILE register.
    pub id: u32,
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// Numbers on the streams and in the pipeline.
    pub numbers: NumberFormat,
    /// Width of each MM2S stream, bits.
    pub mm2s_widths: &'static [u32],
    /// Width of each S2MM stream, bits.
    pub s2mm_widths: &'static [u32],
    /// Cycles from one issue to the next.
    pub initiation_interval: u32,
    /// Collisions that enter the pipeline together.
    pub collisions_per_issue: u32,
    /// Contact pipeline.
    pub contact: Depth,
    /// Friction pipeline.
    pub friction: Depth,
    /// Clock of accelerator and streams, kHz.
    pub clock_khz: u32,
    /// Records as they are streamed, padding included.
    pub words: RecordWords,
    /// On-chip memory.
    pub memory: OnChipMemory,
    /// Largest number of bodies, whatever the memory.
    pub body_capacity: u32,
    /// Entries of the shape table.
    pub shape_capacity: u32,
    /// Where the profile is described.
    pub source: &'static str,
}

/// Four 128-bit streams, f32, one collision every two cycles at 275 MHz (thesis §5.4).
///
/// The depths are those of a pipeline generated for this purpose at the same interval and bit-exact
/// with the vectors; the thesis gives none.
pub const FLOAT: Profile = Profile {
    id: 1,
    name: "float",
    numbers: NumberFormat::F32,
    mm2s_widths: &[128; 4],
    s2mm_widths: &[128; 4],
    initiation_interval: 2,
    collisions_per_issue: 1,
    contact: Depth { fill: 364, window: 316 },
    friction: Depth { fill: 306, window: 182 },
    clock_khz: 275_000,
    words: RecordWords { velocity: 8, collision: 28, pose: 8, result: 16 },
    memory: OnChipMemory {
        bytes: 4 << 20,
        bytes_per_body: 24,
        bytes_per_collision: 16,
        shape_index_bytes: 1,
    },
    body_capacity: 131_072,
    shape_capacity: 64,
    source: "thesis §5.4, §4.4.2",
};

/// Every profile.
pub const PROFILES: &[&Profile] = &[&FLOAT];

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
}

/// Constants of the solver that are wired into the pipeline, as f32.
pub mod solver {
    /// A normal with a larger |z| takes its first tangent in the yz plane (Bullet).
    pub const TANGENT_Z: f32 = std::f32::consts::FRAC_1_SQRT_2;
    /// Cosine between B - A and contact centre - A above which the spin is damped (Bullet).
    pub const SPIN_COSINE: f32 = 0.95;
    /// Share of the spin about the normal that one friction pass takes away (Bullet).
    pub const SPIN_DAMPING: f32 = 0.1;
    /// Largest rotation in one step, rad: a quarter of f32 pi (Bullet).
    pub const ROTATION_LIMIT: f32 = 0.25 * 3.141_592_5;
    /// Angular speed below which the sine is replaced by its series, rad/s (Bullet).
    pub const SERIES_BELOW: f32 = 0.001;
    /// Coefficient of the series' second term (Bullet).
    pub const SERIES_TERM: f32 = 0.020_833_334;
}
