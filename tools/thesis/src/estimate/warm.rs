//! The cost of a warm start: a pass more of each kind, and impulses in and out.

use super::cycles::StepCycles;
use super::step::StepShape;
use super::traffic::{Records, StepTraffic, Transfer};
use pgs_interface::profile::Variant;
use pgs_interface::record::{BEAT_BYTES, collision};

/// The way in which a step applies the impulses that it begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WarmStart {
    /// In a pass in front of the others of each kind, as the specification says.
    OwnPass,
    /// In the first pass of each kind, at each collision's own turn. No bitstream does it: a row
    /// would be solved before its neighbours' impulses are in the velocities, and take its own
    /// back.
    FirstPass,
}

/// Cycles and bytes of a step without and with a warm start, by formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WarmCost {
    /// Cycles of the step without it.
    pub cycles: u64,
    /// Cycles that it adds.
    pub more_cycles: u64,
    /// Bytes of the step without it, in and out.
    pub bytes: u64,
    /// Bytes that the impulses and their passes add on the way in.
    pub more_in: u64,
    /// Bytes of the impulses that go out.
    pub more_out: u64,
}

impl WarmCost {
    /// The cost in a variant of a profile; none if it has no warm start.
    #[must_use]
    pub fn new(variant: &Variant, way: WarmStart, step: &StepShape) -> Option<Self> {
        let profile = variant.profile;
        let stripe = profile.stripes.warm_collisions?;
        let records = |count| {
            let format = variant.numbers.collisions;
            let (together, rows) = (profile.collisions_per_issue, collision::WARM_ROWS);
            Transfer::streamed(count, together, rows, format, &stripe, profile.mm2s_widths)
        };
        let together = u64::from(profile.collisions_per_issue);
        let issues = step.collisions.div_ceil(together);
        let usual = u64::from(profile.initiation_interval);
        let pass = profile.issues_take(issues, records(together).cycles);
        let traffic = StepTraffic::new(variant, Records::Streamed, step);
        let bytes = records(step.collisions).bytes;
        let (mut more_cycles, mut more_in, mut more_out) = (0, 0, 0);
        for (count, kind) in [
            (step.contact_iterations, variant.contact()),
            (step.friction_iterations, variant.friction()),
        ] {
            if count == 0 || step.collisions == 0 {
                continue;
            }
            let (cycles, bytes) = match way {
                WarmStart::OwnPass => (pass + u64::from(kind.fill), bytes),
                WarmStart::FirstPass => (pass - issues * usual, bytes - traffic.collisions.bytes),
            };
            more_cycles += cycles;
            more_in += bytes;
            more_out += step.collisions * BEAT_BYTES as u64;
        }
        let cycles = StepCycles::new(variant, Records::Streamed, step).total;
        Some(Self { cycles, more_cycles, bytes: traffic.bytes(), more_in, more_out })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::thesis;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

    const THESIS_STEP: StepShape = thesis::step();

    #[test]
    fn a_pass_of_each_kind_costs_a_quarter_of_the_cycles_and_a_third_of_the_bytes() {
        let of = |way| WarmCost::new(&FLOAT.default_variant(), way, &THESIS_STEP);
        let own = of(WarmStart::OwnPass).expect("float has a warm start");
        assert_eq!(own.more_cycles, 2 * 254_000 + 374 + 314);
        assert_eq!(own.more_in, 2 * 8 * 16 * 127_000);
        assert_eq!(own.more_out, 2 * 16 * 127_000);
        // The limits that were set for it: 25 % of the cycles, 35 % of the bytes.
        assert!(100 * own.more_cycles < 25 * own.cycles);
        assert!(100 * (own.more_in + own.more_out) < 35 * own.bytes);
        let first = of(WarmStart::FirstPass).expect("likewise");
        assert_eq!((first.more_cycles, first.more_in), (0, 2 * 16 * 127_000));
        assert!(100 * (first.more_in + first.more_out) < 8 * first.bytes);
    }

    #[test]
    fn a_narrow_stream_takes_longer_for_the_impulses() {
        let naive = WarmCost::new(&NAIVE.default_variant(), WarmStart::OwnPass, &THESIS_STEP);
        assert_eq!(naive.expect("a warm start").more_cycles, 2 * 32 * 127_000 + 364 + 306);
        let first = WarmCost::new(&NAIVE.default_variant(), WarmStart::FirstPass, &THESIS_STEP);
        assert_eq!(first.expect("a warm start").more_cycles, 2 * 4 * 127_000);
    }

    /// Two collisions of `half` are eight beats, two of them on 64 bits.
    #[test]
    fn impulses_in_sixteen_bits_come_in_a_beat_of_each_issue() {
        let of = |profile: &'static Profile, way| {
            let cost = WarmCost::new(&profile.default_variant(), way, &THESIS_STEP);
            let cost = cost.expect("a warm start");
            assert_eq!(cost.more_out, 2 * 16 * 127_000, "f32 words");
            (cost.more_cycles, cost.more_in)
        };
        let (own, first) = (WarmStart::OwnPass, WarmStart::FirstPass);
        // The last slot of a pass is none that stays empty.
        assert_eq!(of(&HALF, own), (2 * (4 * 63_500 - 2) + 285 + 222, 2 * 8 * 16 * 63_500));
        assert_eq!(of(&HALF, first), (2 * (63_500 - 2), 2 * 16 * 63_500));
    }

    #[test]
    fn a_step_without_passes_has_no_cost() {
        let none = StepShape::new(9, 0);
        let cost = WarmCost::new(&FLOAT.default_variant(), WarmStart::OwnPass, &none);
        let cost = cost.expect("a warm start");
        assert_eq!((cost.more_cycles, cost.more_in, cost.more_out), (0, 0, 0));
    }
}
