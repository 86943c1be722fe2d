//! The cycle formula of a step.
//!
//! ```text
//! cycles = load + passes x (ceil(C / collisions per issue) x II + fill)
//!        + max(pose in, result out) + integration fill
//! ```
//!
//! This is a step in the order of the stream, as the thesis has it: an issue queue adds its filling
//! to each pass (interface specification, cycles).
//!
//! Source: thesis Tables 6.4 and 6.8, which the formula meets within 0.6 %; the fills are this
//! project's.

use super::step::StepShape;
use super::traffic::{Records, StepTraffic};
use pgs_interface::profile::Variant;

/// Clock cycles of a step by the formula, part by part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepCycles {
    /// Velocities in.
    pub load: u64,
    /// One pass over the collisions, without fill.
    pub pass: u64,
    /// Fill of all passes together.
    pub fill: u64,
    /// Poses in.
    pub pose_in: u64,
    /// Results out.
    pub result_out: u64,
    /// Fill of the integration: from the last body in to the end of the step.
    pub integration_fill: u64,
    /// All together.
    pub total: u64,
}

impl StepCycles {
    /// The formula for a variant of a profile, with its records counted as `records` says.
    #[must_use]
    pub fn new(variant: &Variant, records: Records, step: &StepShape) -> Self {
        let profile = variant.profile;
        let traffic = StepTraffic::new(variant, records, step);
        let [contact, friction] = [variant.contact(), variant.friction()].map(|kind| kind.fill);
        let issues = step.collisions.div_ceil(profile.collisions_per_issue.into());
        let pass = issues * u64::from(profile.initiation_interval);
        let fill = match step.passes() {
            0 => 0,
            _ => {
                step.contact_iterations * u64::from(contact)
                    + step.friction_iterations * u64::from(friction)
            }
        };
        let load = traffic.velocities.cycles;
        let (pose_in, result_out) = (traffic.poses.cycles, traffic.results.cycles);
        let integration_fill = u64::from(profile.integration_fill);
        let passes = pass * step.passes() + fill;
        let total = load + passes + pose_in.max(result_out) + integration_fill;
        Self { load, pass, fill, pose_in, result_out, integration_fill, total }
    }

    /// Poses in or results out, the longer of the two, without fill.
    #[must_use]
    pub fn integration(&self) -> u64 {
        self.pose_in.max(self.result_out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::thesis;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

    const THESIS_STEP: StepShape = thesis::step();

    fn cycles(profile: &'static Profile, records: Records) -> StepCycles {
        StepCycles::new(&profile.default_variant(), records, &THESIS_STEP)
    }

    #[test]
    fn eight_passes_follow_from_the_cycles_that_the_thesis_prints() {
        for (profile, printed, rest) in [(&FLOAT, 2_062_697, 30_697), (&HALF, 1_557_317, 33_317)] {
            let pass = cycles(profile, Records::Packed).pass;
            assert_eq!((printed / pass, printed % pass), (THESIS_STEP.passes(), rest));
        }
    }

    fn parts(cycles: &StepCycles) -> [u64; 6] {
        let StepCycles { load, pass, fill, pose_in, result_out, integration_fill, .. } = *cycles;
        [load, pass, fill, pose_in, result_out, integration_fill]
    }

    fn deviation(ours: u64, theirs: u64) -> f64 {
        (ours as f64 - theirs as f64) / theirs as f64 * 100.0
    }

    #[test]
    fn one_formula_meets_both_designs_of_the_thesis_within_0_6_percent() {
        let float = cycles(&FLOAT, Records::Packed);
        assert_eq!(parts(&float), [14_580, 254_000, 2_752, 17_010, 14_580, 264]);
        assert_eq!(float.total - float.fill - 264, 2_063_590);
        assert_eq!(float.total, 2_066_606);
        assert!((deviation(float.total, 2_062_697) - 0.19).abs() < 0.005);
        let half = cycles(&HALF, Records::Packed);
        assert_eq!(parts(&half), [11_664, 190_500, 2_028, 13_608, 11_664, 177]);
        assert_eq!(half.total - half.fill - 177, 1_549_272);
        assert_eq!(half.total, 1_551_477);
        assert!((deviation(half.total, 1_557_317) + 0.375).abs() < 0.005);
    }

    #[test]
    fn the_streamed_records_take_the_cycles_of_their_beats() {
        let float = cycles(&FLOAT, Records::Streamed);
        assert_eq!(parts(&float), [19_440, 254_000, 2_752, 19_440, 38_880, 264]);
        assert_eq!(float.total, 2_093_336);
        // One-beat records go five every two cycles, results are two beats.
        let half = cycles(&HALF, Records::Streamed);
        assert_eq!(parts(&half), [15_552, 190_500, 2_028, 15_552, 31_104, 177]);
        assert_eq!(half.total, 1_572_861);
        // Eight words a velocity, sixteen a result, one a cycle.
        let naive = cycles(&NAIVE, Records::Streamed);
        assert_eq!(parts(&naive), [311_040, 3_556_000, 2_680, 311_040, 622_080, 264]);
        assert_eq!(naive.total, 29_384_064);
    }

    #[test]
    fn an_issue_that_is_not_full_counts_as_one() {
        let half = |collisions| {
            let step = StepShape::new(1, collisions);
            StepCycles::new(&HALF.default_variant(), Records::Streamed, &step).pass
        };
        assert_eq!([half(1), half(2), half(3)], [3, 3, 6]);
    }

    #[test]
    fn without_collisions_there_are_no_passes() {
        let step = StepShape::new(4, 0);
        let cycles = StepCycles::new(&FLOAT.default_variant(), Records::Streamed, &step);
        assert_eq!(cycles.total, 2 + 4 + 264);
    }
}
