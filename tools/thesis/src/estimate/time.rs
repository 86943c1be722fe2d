//! Time of a step under a memory bandwidth.
//!
//! Each part of a step takes the longer of computation and transfer: the velocities in, each pass,
//! and the poses in with the results out. Fill is added, because nothing streams meanwhile. Where
//! the passes run side by side, all records stream beside them and count in their part.

use super::cycles::StepCycles;
use super::designs::Window;
use super::ports::PortAccount;
use super::step::StepShape;
use super::traffic::{Records, StepTraffic};
use bitstream_model::Bandwidth;
use pgs_interface::profile::Variant;

/// The limit on the speed of a part of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartLimit {
    /// The width of the streams.
    Streams,
    /// The initiation interval.
    Pipeline,
    /// The memory bandwidth.
    Memory,
}

impl PartLimit {
    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Streams => "streams",
            Self::Pipeline => "pipeline",
            Self::Memory => "memory",
        }
    }
}

/// Time of one part of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartTime {
    /// Time, s.
    pub seconds: f64,
    /// Bytes that the part moves, in and out.
    pub bytes: u64,
    /// The limit on its speed.
    pub limit: PartLimit,
}

/// Time of a step under a memory bandwidth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTime {
    /// Velocities in.
    pub load: PartTime,
    /// One pass over the collisions, without fill.
    pub pass: PartTime,
    /// Poses in and results out.
    pub integration: PartTime,
    /// The whole step, s.
    pub seconds: f64,
    /// Bytes that the step moves, in and out.
    pub bytes: u64,
}

impl StepTime {
    /// The time for a variant of a profile, with its records counted as `records` says.
    #[must_use]
    pub fn new(
        variant: &Variant,
        records: Records,
        step: &StepShape,
        bandwidth: Bandwidth,
    ) -> Self {
        let cycles = StepCycles::new(variant, records, step);
        let traffic = StepTraffic::new(variant, records, step);
        let clock_hz = f64::from(variant.profile.clock_khz) * 1e3;
        let part = |cycles: u64, bytes: u64, own: PartLimit| {
            let compute = cycles as f64 / clock_hz;
            let moving = match bandwidth {
                Bandwidth::Unlimited => 0.0,
                Bandwidth::BytesPerSecond(rate) => bytes as f64 / rate as f64,
            };
            if moving > compute {
                PartTime { seconds: moving, bytes, limit: PartLimit::Memory }
            } else {
                PartTime { seconds: compute, bytes, limit: own }
            }
        };
        let (first, each, last) = match Window::of(variant.profile) {
            Some(_) => (0, traffic.bytes(), 0),
            None => (
                traffic.velocities.bytes,
                traffic.collisions.bytes,
                traffic.poses.bytes + traffic.results.bytes,
            ),
        };
        let load = part(cycles.load, first, PartLimit::Streams);
        let pass = part(cycles.pass, each, interval_limit(variant));
        let integration = part(cycles.integration(), last, PartLimit::Streams);
        let fill_seconds = (cycles.fill + cycles.integration_fill) as f64 / clock_hz;
        let passes = traffic.collision_streams as f64 * pass.seconds;
        let seconds = load.seconds + passes + fill_seconds + integration.seconds;
        Self { load, pass, integration, seconds, bytes: traffic.bytes() }
    }

    /// The step in clock cycles of the accelerator, waits for the memory included.
    #[must_use]
    pub fn cycles(&self, variant: &Variant) -> f64 {
        self.seconds * f64::from(variant.profile.clock_khz) * 1e3
    }
}

/// The limit that keeps the initiation interval from being shorter; the pipeline's ports if streams
/// and ports allow the same interval.
fn interval_limit(variant: &Variant) -> PartLimit {
    let account = PortAccount::new(variant);
    if account.by_streams > account.by_ports() { PartLimit::Streams } else { PartLimit::Pipeline }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{MIXED, thesis};
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

    const THESIS_STEP: StepShape = thesis::step();

    fn time(profile: &'static Profile, bandwidth: Bandwidth) -> StepTime {
        StepTime::new(&profile.default_variant(), Records::Streamed, &THESIS_STEP, bandwidth)
    }

    fn limits(time: &StepTime) -> [PartLimit; 3] {
        [time.load.limit, time.pass.limit, time.integration.limit]
    }

    /// The times of the platform notes: eight passes of 127,000 collisions.
    #[test]
    fn the_sustained_bandwidth_limits_float_and_the_peak_does_not() {
        let passes = |profile, bandwidth| {
            let time = time(profile, bandwidth);
            (time.pass.seconds * 8e3, time.pass.limit)
        };
        for (profile, bandwidth, ms, limit) in [
            (&FLOAT, Bandwidth::ZCU102_SUSTAINED, 8.89, PartLimit::Memory),
            (&FLOAT, Bandwidth::ZCU102_PEAK, 7.39, PartLimit::Pipeline),
            (&HALF, Bandwidth::ZCU102_SUSTAINED, 6.10, PartLimit::Pipeline),
            (&MIXED, Bandwidth::ZCU102_SUSTAINED, 4.064, PartLimit::Pipeline),
        ] {
            let (found, by) = passes(profile, bandwidth);
            assert!((found - ms).abs() < 0.005, "{} {found} ms, not {ms}", profile.name);
            assert_eq!(by, limit, "{}", profile.name);
        }
    }

    /// The demand of the thesis' float design on its memory of 16 GB/s (§5.4.2).
    #[test]
    fn a_pass_of_float_needs_15_4_gigabytes_a_second() {
        let pass = time(&FLOAT, Bandwidth::Unlimited).pass;
        let rate = pass.bytes as f64 / pass.seconds / 1e9;
        assert!((rate - 15.4).abs() < 0.01, "{rate} GB/s");
    }

    #[test]
    fn each_part_says_what_limits_it() {
        use PartLimit::{Memory, Pipeline, Streams};
        assert_eq!(limits(&time(&MIXED, Bandwidth::Unlimited)), [Streams, Pipeline, Streams]);
        assert_eq!(limits(&time(&MIXED, Bandwidth::ZCU102_PEAK)), [Streams, Pipeline, Memory]);
        assert_eq!(limits(&time(&FLOAT, Bandwidth::ZCU102_SUSTAINED)), [Memory; 3]);
        assert_eq!(limits(&time(&NAIVE, Bandwidth::ZCU102_SUSTAINED)), [Streams; 3]);
    }

    #[test]
    fn a_step_is_the_sum_of_its_parts() {
        let time = time(&MIXED, Bandwidth::ZCU102_SUSTAINED);
        // Velocities 77,760 beats, passes of 381,000, poses 77,760, results 155,520.
        assert_eq!(time.bytes, 16 * (77_760 + 8 * 381_000 + 77_760 + 155_520));
        let expected =
            25_920.0 / 250e6 + 8.0 * 127_000.0 / 250e6 + 2_944.0 / 250e6 + 3_732_480.0 / 12.8e9;
        assert!((time.seconds - expected).abs() < 1e-12, "{} s", time.seconds);
        assert!((time.cycles(&MIXED.default_variant()) - expected * 250e6).abs() < 1e-3);
    }

    #[test]
    fn mixed_moves_less_than_half_of_floats_bytes() {
        let bytes = |profile| time(profile, Bandwidth::Unlimited).bytes;
        assert_eq!((bytes(&FLOAT), bytes(&MIXED)), (118_768_640, 53_744_640));
        assert!(2 * bytes(&MIXED) <= bytes(&FLOAT));
    }
}
