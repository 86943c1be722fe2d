//! This file is the cycle formula of a step, and its time under a memory bandwidth.
//!
//! `cycles = load + passes x (ceil(C / collisions per issue) x II + fill) + max(pose in, result out)`
//!
//! Source: thesis Tables 6.4 and 6.8 (which the formula meets within 0.6 %); fill and bandwidth are
//! this project's.

use crate::config::Bandwidth;
use crate::interface::profile::{Profile, RecordWords};

const WORD_BITS: u64 = 32;
const WORD_BYTES: u64 = 4;

/// How large a step is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepShape {
    /// Bodies B.
    pub bodies: u64,
    /// Collisions C.
    pub collisions: u64,
    /// Contact passes.
    pub contact_iterations: u64,
    /// Friction passes.
    pub friction_iterations: u64,
}

impl StepShape {
    /// Four contact and four friction passes.
    #[must_use]
    pub const fn new(bodies: u64, collisions: u64) -> Self {
        Self { bodies, collisions, contact_iterations: 4, friction_iterations: 4 }
    }
}

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
    /// All together.
    pub total: u64,
}

/// Cycles that a stream of records takes on channels of that total width.
fn stream_cycles(records: u64, words: u32, widths: &[u32]) -> u64 {
    let bits: u64 = widths.iter().map(|width| u64::from(*width)).sum();
    (records * u64::from(words) * WORD_BITS).div_ceil(bits)
}

impl StepCycles {
    /// The formula for a profile, with records of those words.
    #[must_use]
    pub fn new(profile: &Profile, words: &RecordWords, step: &StepShape) -> Self {
        let load = stream_cycles(step.bodies, words.velocity, profile.mm2s_widths);
        let pose_in = stream_cycles(step.bodies, words.pose, profile.mm2s_widths);
        let result_out = stream_cycles(step.bodies, words.result, profile.s2mm_widths);
        let passes = if step.collisions == 0 {
            (0, 0)
        } else {
            (step.contact_iterations, step.friction_iterations)
        };
        let issues = step.collisions.div_ceil(u64::from(profile.collisions_per_issue));
        let pass = issues * u64::from(profile.initiation_interval);
        let fill = passes.0 * u64::from(profile.contact.fill)
            + passes.1 * u64::from(profile.friction.fill);
        let total = load + (passes.0 + passes.1) * pass + fill + pose_in.max(result_out);
        Self { load, pass, fill, pose_in, result_out, total }
    }

    /// The time of that many cycles, s.
    #[must_use]
    pub fn seconds(&self, profile: &Profile) -> f64 {
        self.total as f64 / (f64::from(profile.clock_khz) * 1e3)
    }
}

/// What limits a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PassLimit {
    /// The pipeline.
    Pipeline,
    /// The memory.
    Memory,
}

/// Time of a step under a memory bandwidth: each part takes the longer of computing and moving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTime {
    /// The whole step, s.
    pub seconds: f64,
    /// Bytes that the step moves, in and out.
    pub bytes: u64,
    /// What limits the passes.
    pub limit: PassLimit,
}

impl StepTime {
    /// The time for a profile, with records of those words.
    #[must_use]
    pub fn new(
        profile: &Profile,
        words: &RecordWords,
        step: &StepShape,
        bandwidth: Bandwidth,
    ) -> Self {
        let cycles = StepCycles::new(profile, words, step);
        let clock_hz = f64::from(profile.clock_khz) * 1e3;
        let bytes = |records: u64, words: u32| records * u64::from(words) * WORD_BYTES;
        let move_seconds = |bytes: u64| match bandwidth {
            Bandwidth::Unlimited => 0.0,
            Bandwidth::BytesPerSecond(rate) => bytes as f64 / rate as f64,
        };
        let longer = |cycles: u64, bytes: u64| {
            let compute = cycles as f64 / clock_hz;
            let moving = move_seconds(bytes);
            if moving > compute {
                (moving, PassLimit::Memory)
            } else {
                (compute, PassLimit::Pipeline)
            }
        };
        let passes = if step.collisions == 0 {
            0
        } else {
            step.contact_iterations + step.friction_iterations
        };
        let load = bytes(step.bodies, words.velocity);
        let pass = bytes(step.collisions, words.collision);
        let last = bytes(step.bodies, words.pose) + bytes(step.bodies, words.result);
        let (pass_seconds, limit) = longer(cycles.pass, pass);
        let seconds = longer(cycles.load, load).0
            + passes as f64 * pass_seconds
            + cycles.fill as f64 / clock_hz
            + longer(cycles.pose_in.max(cycles.result_out), last).0;
        Self { seconds, bytes: load + passes * pass + last, limit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::profile::{FLOAT, THESIS_WORDS};

    const THESIS_STEP: StepShape = StepShape::new(38_880, 127_000);

    fn deviation(ours: u64, theirs: u64) -> f64 {
        (ours as f64 - theirs as f64) / theirs as f64
    }

    #[test]
    fn float_meets_the_thesis_within_its_tolerance() {
        let cycles = StepCycles::new(&FLOAT, &THESIS_WORDS, &THESIS_STEP);
        assert_eq!((cycles.load, cycles.pose_in, cycles.result_out), (14_580, 17_010, 14_580));
        assert_eq!(cycles.total - cycles.fill, 2_063_590);
        assert_eq!(cycles.total, 2_066_270);
        assert!(deviation(cycles.total, 2_062_697).abs() < 0.006);
    }

    #[test]
    fn the_streamed_records_take_what_their_beats_take() {
        let cycles = StepCycles::new(&FLOAT, &FLOAT.default_variant().words(), &THESIS_STEP);
        assert_eq!((cycles.load, cycles.pose_in, cycles.result_out), (19_440, 19_440, 38_880));
        assert_eq!(cycles.total, 19_440 + 2_032_000 + 4 * (364 + 306) + 38_880);
    }

    /// The times of the platform notes: eight passes of 127,000 collisions.
    #[test]
    fn the_sustained_bandwidth_limits_float_and_the_peak_does_not() {
        let passes_only = StepShape { bodies: 0, ..THESIS_STEP };
        let time = |bandwidth| {
            StepTime::new(&FLOAT, &FLOAT.default_variant().words(), &passes_only, bandwidth)
        };
        let sustained = time(Bandwidth::ZCU102_SUSTAINED);
        assert_eq!(sustained.limit, PassLimit::Memory);
        assert!((sustained.seconds * 1e3 - 8.89).abs() < 0.02, "{sustained:?}");
        let peak = time(Bandwidth::ZCU102_PEAK);
        assert_eq!(peak.limit, PassLimit::Pipeline);
        assert!((peak.seconds * 1e3 - 7.40).abs() < 0.01, "{peak:?}");
    }

    #[test]
    fn without_collisions_there_are_no_passes() {
        let cycles =
            StepCycles::new(&FLOAT, &FLOAT.default_variant().words(), &StepShape::new(4, 0));
        assert_eq!(cycles.total, 2 + 4);
    }
}
