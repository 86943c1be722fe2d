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
use super::thesis::recorded::{Design, FLOAT_DESIGN, HALF_DESIGN};
use pgs_interface::number::{Numbers, Precision, StreamFormat};
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
    slotted: false,
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
/// Each pass is behind the one before by the [lag](Self::lag): with a body's longest span +
/// ceil(window / slot) + 1, every rule holds when the passes take turns. Load and integration run
/// beside the passes. Pass k of a kind runs on unit k modulo the number of units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Units that run contact passes; friction passes have the same number.
    pub units: u32,
    /// Places for live bodies over all units. Each unit keeps the bodies in its passes in a memory
    /// of its share.
    pub slots: u32,
    /// Most collisions that wait between one pass and the next: a body's first and last use must
    /// be less than this number apart.
    pub lag: u32,
}

/// Two contact and two friction units, each with half of the passes.
const TWO_OF_A_KIND: Window = Window { units: 2, slots: 8192, lag: 2816 };

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

    /// Issues of a unit for each streamed entry.
    #[must_use]
    pub fn issues_per_entry(&self, step: &StepShape) -> u64 {
        step.contact_iterations.max(step.friction_iterations).div_ceil(self.units.into())
    }

    /// Cycles in which every pass issues one entry.
    #[must_use]
    pub fn slot(&self, profile: &Profile, step: &StepShape) -> u64 {
        let cycles = self.issues_per_entry(step) * u64::from(profile.initiation_interval);
        cycles.div_ceil(profile.collisions_per_issue.into())
    }

    /// Cycles by which the last pass is behind the first, if the order needs all of the delay lines.
    #[must_use]
    pub fn behind(&self, profile: &Profile, step: &StepShape) -> u64 {
        step.passes().saturating_sub(1) * u64::from(self.lag) * self.slot(profile, step)
    }

    /// DSPs, flip-flops and lookup tables, percent of the device, without places, scoreboard and
    /// delay lines: an extrapolation from the thesis' design in the same arithmetic, which has one
    /// unit of each kind.
    #[must_use]
    pub fn logic(&self, variant: &Variant) -> (&'static Design, [u32; 3]) {
        let from = match variant.numbers.updates {
            Precision::F32 => &FLOAT_DESIGN,
            Precision::Binary16 => &HALF_DESIGN,
        };
        (from, [from.dsp, from.flip_flops, from.lookup_tables].map(|each| each * self.units))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{MemoryUse, PortAccount, Records, StepCycles, StepTraffic};

    /// By hand: (127,000 + 7 x 2,816) x 4 + 306, then the fill of the integration.
    #[test]
    fn the_formula_is_entries_and_lags_by_slots() {
        let shape = StepShape::new(38_880, 127_000);
        for (profile, slot) in [(&WINDOWED, 4), (&WINDOWED16, 3)] {
            let design = Window::of(profile).expect("it has a window");
            assert_eq!(design.slot(profile, &shape), slot);
            assert_eq!(design.behind(profile, &shape), 7 * 2_816 * slot);
            let step = StepCycles::new(&profile.default_variant(), Records::Streamed, &shape);
            assert_eq!((step.load, step.integration()), (0, 0), "both are beside the passes");
            assert_eq!(step.total, (127_000 + 7 * 2_816) * slot + 306 + 264);
        }
        assert_eq!(Window::of(&FLOAT), None);
    }

    /// 3 lines of 28 words, 4 of 24, 2,816 entries long, and 8,192 velocities.
    #[test]
    fn on_chip_are_seven_delay_lines_and_the_places() {
        for (profile, bytes, most) in [(&WINDOWED, 4, 2.2), (&WINDOWED16, 2, 1.2)] {
            let memory = MemoryUse::new(&profile.default_variant(), 38_880, 127_746);
            let lines = 2_816 * (3 * 28 + 4 * 24) * bytes;
            assert_eq!(memory.block_ram(), lines + 8_192 * 6 * bytes, "{}", profile.name);
            let mib = memory.block_ram() as f64 / f64::from(1 << 20);
            assert!(mib <= most, "{mib} MiB");
            // The memory does not depend on the scene.
            assert_eq!(memory, MemoryUse::new(&profile.default_variant(), 7, 7));
            assert!(memory.fits());
        }
    }

    #[test]
    fn a_step_moves_a_sixth_and_an_eleventh_of_floats_bytes() {
        let shape = StepShape::new(38_880, 127_746);
        let bytes = |profile: &'static Profile| {
            StepTraffic::new(&profile.default_variant(), Records::Streamed, &shape).bytes()
        };
        let float = bytes(&FLOAT);
        assert!(6 * bytes(&WINDOWED) <= float, "{} of {float}", bytes(&WINDOWED));
        assert!(11 * bytes(&WINDOWED16) <= float, "{} of {float}", bytes(&WINDOWED16));
    }

    /// A unit memory takes two reads and two writes of its own, and two writes from the unit before
    /// it, on two ports of a pumped block RAM.
    #[test]
    fn the_ports_of_a_unit_memory_allow_the_interval() {
        for (profile, accesses, interval) in [(&WINDOWED, 6, 2), (&WINDOWED16, 12, 3)] {
            let account = PortAccount::new(&profile.default_variant());
            let velocities = account.velocities();
            assert_eq!((velocities.accesses(), velocities.interval()), (accesses, interval));
            assert_eq!(account.smallest(), profile.initiation_interval);
            // Without the pump it would take twice as long.
            assert_eq!(velocities.with(1, 1).interval(), accesses / 2);
        }
    }

    #[test]
    fn by_the_thesis_two_units_of_a_kind_take_nearly_all_lookup_tables_and_three_more() {
        let logic =
            |design: Window, profile: &'static Profile| design.logic(&profile.default_variant()).1;
        assert_eq!(logic(TWO_OF_A_KIND, &WINDOWED), [84, 64, 94]);
        assert_eq!(logic(TWO_OF_A_KIND, &WINDOWED16), [84, 58, 98]);
        let three = Window { units: 3, ..TWO_OF_A_KIND };
        assert!(logic(three, &WINDOWED).into_iter().any(|percent| percent > 100));
    }
}
