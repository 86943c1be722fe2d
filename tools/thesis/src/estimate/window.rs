//! Cycles, units and on-chip memory of a design that streams the collisions once.
//!
//! ```text
//! cycles = (C + (P - 1) x lag) x T + fill of the last pass + 2 x bodies without a collision
//!        + integration fill
//! ```
//!
//! C counts empty entries too. T is the [cycles of a slot](Window::slot_cycles). The lag is the
//! number of entries by which each pass is behind the previous one. With a constant lag of the
//! longest span of a body + ceil(window / T) + 1, every rule holds when the passes take turns. The
//! emulated board counts the cycles of its scoreboard, usually fewer: when a pass cannot go on, its
//! unit takes another one. Load and integration run beside the passes; only the bodies in no
//! collision come after them.
//!
//! DSPs and lookup tables are extrapolated from the thesis' designs, which have one unit of each
//! kind.

use super::designs::{OnChipArray, Window};
use super::step::StepShape;
use super::thesis::recorded::{Design, FLOAT_DESIGN, HALF_DESIGN};
use super::traffic::{Records, StepTraffic};
use pgs_interface::number::Precision;
use pgs_interface::profile::{Depth, Variant};

/// Words of a relative collision record, of its distances, and of its accumulated impulses.
const RECORD_WORDS: u32 = 24;
const DISTANCES: u32 = 4;
const IMPULSES: u32 = 4;

/// A step, as a design that streams the collisions once sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowStep {
    /// Its size; empty entries count as collisions.
    pub shape: StepShape,
    /// Entries by which each pass is behind the previous one.
    pub lag: u64,
    /// Bodies that move and are in no collision.
    pub untouched: u64,
}

impl WindowStep {
    /// A step whose order needs the whole of the design's delay lines, with every body in a
    /// collision.
    #[must_use]
    pub fn longest(design: &Window, shape: StepShape) -> Self {
        Self { shape, lag: design.lag.into(), untouched: 0 }
    }

    /// The lag that an order needs in a pipeline of `depth`.
    ///
    /// `span` counts entries from a body's first use to its last, for the body with the longest
    /// span.
    #[must_use]
    pub fn lag_of(span: u64, depth: Depth, slot: u64) -> u64 {
        span.saturating_add(u64::from(depth.window).div_ceil(slot.max(1))).saturating_add(1)
    }
}

/// Clock cycles of a step with a window. Counts beyond 64 bits saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowCycles {
    /// Cycles in which every pass issues one entry.
    pub slot: u64,
    /// The first pass: all entries, one a slot.
    pub stream: u64,
    /// Cycles by which the last pass is behind the first.
    pub behind: u64,
    /// Fill of the last pass.
    pub fill: u64,
    /// The solver: these three.
    pub passes: u64,
    /// Velocities in, beside the passes.
    pub load: u64,
    /// Poses in or results out, the longer of the two, beside the passes.
    pub integration: u64,
    /// Load and integration of the bodies in no collision, after the passes.
    pub exposed: u64,
    /// Fill of the integration: from the last body in to the end of the step.
    pub integration_fill: u64,
    /// All together.
    pub total: u64,
}

impl WindowCycles {
    /// The formula for a variant of a profile; `None` if its passes run one after the other.
    #[must_use]
    pub fn new(variant: &Variant, step: &WindowStep) -> Option<Self> {
        let design = Window::of(variant.profile)?;
        let profile = variant.profile;
        let shape = &step.shape;
        let slot = slot(variant, design, shape);
        let passes = shape.passes();
        let entries = if passes == 0 { 0 } else { shape.collisions };
        let stream = entries.saturating_mul(slot);
        let behind = passes.saturating_sub(1).saturating_mul(step.lag).saturating_mul(slot);
        let last =
            if shape.friction_iterations > 0 { variant.friction() } else { variant.contact() };
        let fill = if passes == 0 { 0 } else { last.fill.into() };
        let solver = stream.saturating_add(behind).saturating_add(fill);
        let side = |bodies| {
            let bodies = StepShape { bodies, ..*shape };
            let traffic = StepTraffic::new(variant, Records::Streamed, &bodies);
            (traffic.velocities.cycles, traffic.poses.cycles.max(traffic.results.cycles))
        };
        let (load, integration) = side(shape.bodies);
        let (rest_in, rest_out) = side(step.untouched);
        let exposed = rest_in.max(rest_out);
        let integration_fill = u64::from(profile.integration_fill);
        let total = solver.saturating_add(exposed).saturating_add(integration_fill);
        Some(Self {
            slot,
            stream,
            behind,
            fill,
            passes: solver,
            load,
            integration,
            exposed,
            integration_fill,
            total,
        })
    }
}

/// Cycles in which every pass issues one entry.
fn slot(variant: &Variant, design: &Window, shape: &StepShape) -> u64 {
    let passes = |iterations: u64| u32::try_from(iterations).unwrap_or(u32::MAX);
    let profile = variant.profile;
    let units = Window {
        contact_units: design.contact_units.max(1),
        friction_units: design.friction_units.max(1),
        ..*design
    };
    // The pass counters hold no more.
    let most = pgs_interface::control::ITERATIONS_MAX;
    let slot = units.slot_cycles(
        passes(shape.contact_iterations).min(most),
        passes(shape.friction_iterations).min(most),
        profile.initiation_interval,
        profile.collisions_per_issue.max(1),
    );
    slot.into()
}

/// An array of a design with a window: its memories, and the rows of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WindowArray {
    pub(crate) memories: u32,
    pub(crate) rows: u64,
    pub(crate) row_bytes: u32,
}

/// Size of an array with four passes of each kind; `None` if the design does not have it.
pub(crate) fn array(variant: &Variant, design: &Window, array: OnChipArray) -> Option<WindowArray> {
    let StepShape { contact_iterations, friction_iterations, .. } = StepShape::new(0, 0);
    let passes = |iterations: u64| u32::try_from(iterations).unwrap_or(u32::MAX);
    let (contact, friction) = (passes(contact_iterations), passes(friction_iterations));
    let units = (design.contact_units + design.friction_units).max(1);
    let six = 6 * variant.numbers.velocities.bytes();
    let places = |row_bytes| {
        let rows = u64::from(design.slots.div_ceil(units));
        Some(WindowArray { memories: units, rows, row_bytes })
    };
    let line = |memories: u32, words: u32| {
        let record = (words - IMPULSES) * (variant.numbers.collisions.bits() / 8);
        let row_bytes = record + IMPULSES * variant.numbers.impulses.bytes();
        Some(WindowArray { memories, rows: design.lag.into(), row_bytes })
    };
    match array {
        OnChipArray::Velocities | OnChipArray::Inertia => places(six),
        OnChipArray::ShapeIndices => places(variant.profile.memory.shape_index_bytes),
        // A contact line lies between two contact passes; a friction line leads into each friction
        // pass.
        OnChipArray::ContactLines => line(contact.saturating_sub(1), RECORD_WORDS + IMPULSES),
        OnChipArray::FrictionLines => line(
            friction.saturating_sub(u32::from(contact == 0)),
            RECORD_WORDS - DISTANCES + IMPULSES,
        ),
        OnChipArray::Impulses => None,
    }
}

/// Logic of a design with a window, percent of the device: an extrapolation from the thesis' design
/// in the same arithmetic, which has one unit of each kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowLogic {
    /// The design of the thesis.
    pub from: &'static Design,
    /// Units of the kind that has more of them.
    pub units: u32,
    /// DSP48E.
    pub dsp: u32,
    /// Flip-flops.
    pub flip_flops: u32,
    /// Lookup tables, without places, scoreboard and delay lines.
    pub lookup_tables: u32,
}

impl WindowLogic {
    /// The extrapolation; `None` for a design without a window.
    #[must_use]
    pub fn new(variant: &Variant) -> Option<Self> {
        let design = Window::of(variant.profile)?;
        Some(Self::of_units(variant, design))
    }

    fn of_units(variant: &Variant, design: &Window) -> Self {
        let from = match variant.numbers.updates {
            Precision::F32 => &FLOAT_DESIGN,
            Precision::Binary16 => &HALF_DESIGN,
        };
        let units = design.contact_units.max(design.friction_units);
        let times = |percent: u32| percent.saturating_mul(units);
        Self {
            from,
            units,
            dsp: times(from.dsp),
            flip_flops: times(from.flip_flops),
            lookup_tables: times(from.lookup_tables),
        }
    }

    /// Whether the design fits the device.
    #[must_use]
    pub fn fits(&self) -> bool {
        [self.dsp, self.flip_flops, self.lookup_tables].into_iter().all(|percent| percent <= 100)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{MemoryUse, PortAccount, StepCycles, WINDOWED, WINDOWED16};
    use pgs_interface::profile::{FLOAT, Profile};

    fn cycles(profile: &'static Profile, step: &WindowStep) -> WindowCycles {
        WindowCycles::new(&profile.default_variant(), step).expect("it has a window")
    }

    /// By hand: (127,891 + 7 x 2,581) x 4 + 306 and (128,101 + 7 x 2,827) x 3 + 306, then two
    /// cycles for each of 1,630 bodies, and the fill of the integration.
    #[test]
    fn the_formula_is_entries_and_lags_by_slots() {
        let shape = |entries| StepShape::new(38_880, entries);
        let lag = |profile: &Profile, span, slot| {
            let step = WindowStep { shape: shape(0), lag: 0, untouched: 1_630 };
            WindowStep { lag: WindowStep::lag_of(span, profile.contact, slot), ..step }
        };
        let step = WindowStep { shape: shape(127_891), ..lag(&WINDOWED, 2_501, 4) };
        let float = cycles(&WINDOWED, &step);
        assert_eq!((step.lag, float.slot), (2_581, 4));
        assert_eq!(float.passes, 511_564 + 72_268 + 306);
        assert_eq!((float.load, float.integration, float.exposed), (77_760, 77_760, 3_260));
        assert_eq!(float.total, 584_138 + 3_260 + 264);
        let step = WindowStep { shape: shape(128_101), ..lag(&WINDOWED16, 2_720, 3) };
        let half = cycles(&WINDOWED16, &step);
        assert_eq!((step.lag, half.slot), (2_827, 3));
        assert_eq!(half.passes, 384_303 + 59_367 + 306);
        assert_eq!(half.load, 38_880);
        assert_eq!(WindowCycles::new(&FLOAT.default_variant(), &step), None);
    }

    #[test]
    fn the_step_formula_assumes_the_whole_of_the_delay_lines() {
        let shape = StepShape::new(38_880, 127_000);
        for (profile, slot) in [(&WINDOWED, 4), (&WINDOWED16, 3)] {
            let variant = profile.default_variant();
            let step = StepCycles::new(&variant, Records::Streamed, &shape);
            assert_eq!((step.load, step.integration()), (0, 0), "both are beside the passes");
            assert_eq!(step.total, (127_000 + 7 * 2_816) * slot + 306 + 264);
        }
    }

    #[test]
    fn without_passes_the_bodies_alone_pass_through() {
        let shape =
            StepShape { contact_iterations: 0, friction_iterations: 0, ..StepShape::new(9, 5) };
        let found = cycles(&WINDOWED, &WindowStep { shape, lag: 2_816, untouched: 9 });
        assert_eq!((found.passes, found.total), (0, 18 + 264));
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
            let velocities = account.velocities().expect("they are on chip");
            assert_eq!((velocities.accesses(), velocities.interval()), (accesses, interval));
            assert_eq!(account.smallest(), profile.initiation_interval);
            // Without the pump it would take twice as long.
            assert_eq!(velocities.with(1, 1).interval(), accesses / 2);
        }
    }

    #[test]
    fn two_units_of_a_kind_take_nearly_all_lookup_tables_and_three_do_not_fit() {
        let logic = |profile: &'static Profile| WindowLogic::new(&profile.default_variant());
        let float = logic(&WINDOWED).expect("it has a window");
        assert_eq!((float.dsp, float.flip_flops, float.lookup_tables), (84, 64, 94));
        let half = logic(&WINDOWED16).expect("it has a window");
        assert_eq!((half.dsp, half.flip_flops, half.lookup_tables), (84, 58, 98));
        assert!(float.fits() && half.fits());
        let own = Window { contact_units: 3, friction_units: 2, slots: 8_192, lag: 2_816 };
        assert!(!WindowLogic::of_units(&WINDOWED.default_variant(), &own).fits());
        assert_eq!(logic(&FLOAT), None);
    }
}
