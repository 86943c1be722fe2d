//! The designs of the formulas: the profiles, and three of this project that are no boards.
//!
//! `mixed`, `windowed` and `windowed16` were left as boards: no hardware has them, and no processor
//! of this class can order collisions for the last two, whose order keeps few bodies alive.
//! Ordering one heavy step takes 28 to 50 ms on x86, for 2.1 ms of board.
//!
//! Their collision records are relative to body A, six rows:
//!
//! ```text
//! 0       n           bodyA
//! 1       pB - pA     bodyB
//! 2 to 5  c - pA      distance     +infinity where there is no point
//! ```

use super::step::StepShape;
use pgs_interface::number::{Numbers, StreamFormat};
use pgs_interface::profile::{
    Depth, FLOAT, HALF, NAIVE, OnChipMemory, Profile, RecordWords, Variant,
};
use pgs_interface::record::{LANES, collision};
use pgs_interface::stripe::{Stripe, Stripes};

/// Rows of a collision record relative to body A.
const RELATIVE_ROWS: usize = 6;
/// The same in a warm pass: impulses, and a row of zeros, for two sixteen-bit rows are a beat.
const RELATIVE_WARM_ROWS: usize = 8;

/// Depths without a Verilog, with either form of inertia: assumptions.
const CONTACT: Depth = Depth { fill: 364, window: 316 };
const FRICTION: Depth = Depth { fill: 306, window: 182 };

/// Three 128-bit streams, collisions relative to body A in binary16, everything else in f32, one
/// collision a cycle at 250 MHz with block RAM at twice that clock.
pub const MIXED: Profile = Profile {
    id: 4,
    name: "mixed",
    numbers: Numbers { collisions: StreamFormat::Binary16, ..Numbers::F32 },
    mm2s_widths: &[128; 3],
    s2mm_widths: &[128; 3],
    stripes: Stripes::new(
        Stripe { streams: &[0, 1, 2], padded: false },
        Stripe { streams: &[0, 1, 2], padded: false },
    )
    .with_warm_collisions(Stripe { streams: &[0, 1, 2, 2], padded: false }),
    initiation_interval: 1,
    contact: CONTACT,
    friction: FRICTION,
    world: None,
    clock_khz: 250_000,
    memory: OnChipMemory { pump: 2, ..FLOAT.memory },
    source: "this project",
    ..FLOAT
};

/// Collisions stream once while eight passes run one behind the other, f32, relative coordinates
/// (thesis §4.7 and §7.3 propose it). Two streams of collisions, one of velocities, one of poses,
/// four of results.
pub const WINDOWED: Profile = Profile {
    id: 5,
    name: "windowed",
    stripes: Stripes {
        collisions: Stripe { streams: &[0, 1], padded: false },
        warm_collisions: None,
        velocities: Stripe { streams: &[2], padded: false },
        poses: Stripe { streams: &[3], padded: false },
        results: Stripe { streams: &[0, 1, 2, 3], padded: false },
    },
    contact: CONTACT,
    friction: FRICTION,
    world: None,
    memory: OnChipMemory { pump: 2, ..FLOAT.memory },
    body_capacity: 1 << 20,
    source: "this project, after thesis §4.7",
    ..FLOAT
};

/// `windowed` with sixteen-bit arithmetic, collisions and velocities in binary16, poses in f32.
pub const WINDOWED16: Profile = Profile {
    id: 6,
    name: "windowed16",
    numbers: Numbers { poses: StreamFormat::F32, ..Numbers::BINARY16 },
    initiation_interval: 3,
    collisions_per_issue: 2,
    ..WINDOWED
};

/// Every design of the formulas: the profiles first.
pub const DESIGNS: &[&Profile] = &[&NAIVE, &FLOAT, &HALF, &MIXED, &WINDOWED, &WINDOWED16];

/// Units, places and delay lines of a design that streams the collisions once.
///
/// A unit takes an issue every initiation interval, from its passes in turn, and passes over a pass
/// that cannot issue. When all of them can, every pass gets one entry in
/// [`slot_cycles`](Self::slot_cycles). Pass k of a kind runs on unit k modulo the number of units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Window {
    /// Units that run contact passes.
    pub contact_units: u32,
    /// Units that run friction passes.
    pub friction_units: u32,
    /// Places for live bodies over all units. Each unit keeps the bodies in its passes in a memory
    /// of its share.
    pub slots: u32,
    /// Most collisions that wait between one pass and the next: a body's first and last use must
    /// be less than this number apart.
    pub lag: u32,
}

/// Two contact and two friction units, each with half of the passes.
const TWO_OF_A_KIND: Window =
    Window { contact_units: 2, friction_units: 2, slots: 8192, lag: 2816 };

impl Window {
    /// Most collisions of a step, empty entries included: what the counters of the passes hold.
    pub const COLLISIONS_MAX: u32 = 1 << 20;

    /// The window of a design; none where the passes run one after the other, each streams all
    /// collisions, and the velocities of all bodies are on chip.
    #[must_use]
    pub fn of(profile: &Profile) -> Option<&'static Self> {
        let streams_once = [WINDOWED.id, WINDOWED16.id].contains(&profile.id);
        streams_once.then_some(&TWO_OF_A_KIND)
    }

    /// Cycles in which every pass issues one entry.
    #[must_use]
    pub const fn slot_cycles(
        &self,
        contact_passes: u32,
        friction_passes: u32,
        initiation_interval: u32,
        collisions_per_issue: u32,
    ) -> u32 {
        let contact = contact_passes.div_ceil(self.contact_units);
        let friction = friction_passes.div_ceil(self.friction_units);
        let most = if contact > friction { contact } else { friction };
        (most * initiation_interval).div_ceil(collisions_per_issue)
    }

    /// Issues of a unit for each streamed entry, with four passes of each kind.
    pub(crate) fn issues_per_entry(&self) -> u32 {
        let StepShape { contact_iterations, friction_iterations, .. } = StepShape::new(0, 0);
        let of = |passes: u64, units: u32| {
            u32::try_from(passes).unwrap_or(u32::MAX).div_ceil(units.max(1))
        };
        of(contact_iterations, self.contact_units).max(of(friction_iterations, self.friction_units))
    }
}

/// An array that stays on chip while a step runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnChipArray {
    /// Linear and angular velocity of each body.
    Velocities,
    /// World inverse inertia of each body.
    Inertia,
    /// Accumulated impulses of each collision.
    Impulses,
    /// Shape index of each body.
    ShapeIndices,
    /// Records with their impulses on the way to a contact pass.
    ContactLines,
    /// Records without distances, with their impulses, on the way to a friction pass.
    FrictionLines,
}

impl OnChipArray {
    /// Whether the array has a row for each body, and not for each collision.
    #[must_use]
    pub const fn is_of_bodies(self) -> bool {
        matches!(self, Self::Velocities | Self::Inertia | Self::ShapeIndices)
    }

    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocities => "velocities",
            Self::Inertia => "world inertia",
            Self::Impulses => "impulses",
            Self::ShapeIndices => "shape indices",
            Self::ContactLines => "contact lines",
            Self::FrictionLines => "friction lines",
        }
    }
}

/// Whether a design's collision records are relative to body A.
pub(crate) fn is_relative(profile: &Profile) -> bool {
    [MIXED.id, WINDOWED.id, WINDOWED16.id].contains(&profile.id)
}

/// Rows of a design's collision record.
pub(crate) fn collision_rows(profile: &Profile) -> usize {
    if is_relative(profile) { RELATIVE_ROWS } else { collision::ROWS }
}

/// Rows of a design's collision record of a warm pass.
pub(crate) fn warm_collision_rows(profile: &Profile) -> usize {
    if is_relative(profile) { RELATIVE_WARM_ROWS } else { collision::WARM_ROWS }
}

/// 32-bit words of a design's records on the streams.
#[must_use]
pub fn words(variant: &Variant) -> RecordWords {
    let bits = variant.numbers.collisions.bits();
    #[expect(clippy::cast_possible_truncation, reason = "a record has few words")]
    let numbers = (collision_rows(variant.profile) * LANES) as u32;
    RecordWords { collision: numbers * bits / u32::BITS, ..variant.words() }
}
