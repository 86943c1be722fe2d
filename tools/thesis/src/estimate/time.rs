//! Time of a step under a memory bandwidth.
//!
//! Each part of a step takes the longer of computation and transfer: the velocities in, each pass,
//! and the poses in with the results out. Fill is added, because nothing streams meanwhile.

use super::cycles::StepCycles;
use super::step::StepShape;
use super::traffic::{Records, StepTraffic};
use bitstream_model::Bandwidth;
use pgs_interface::profile::Variant;

/// Time of one part of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartTime {
    /// Time, s.
    pub seconds: f64,
    /// Bytes that the part moves, in and out.
    pub bytes: u64,
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
        let part = |cycles: u64, bytes: u64| {
            let compute = cycles as f64 / clock_hz;
            let moving = match bandwidth {
                Bandwidth::Unlimited => 0.0,
                Bandwidth::BytesPerSecond(rate) => bytes as f64 / rate as f64,
            };
            PartTime { seconds: if moving > compute { moving } else { compute }, bytes }
        };
        let (first, each) = (traffic.velocities.bytes, traffic.collisions.bytes);
        let last = traffic.poses.bytes + traffic.results.bytes;
        let load = part(cycles.load, first);
        let pass = part(cycles.pass, each);
        let integration = part(cycles.integration(), last);
        let fill_seconds = (cycles.fill + cycles.integration_fill) as f64 / clock_hz;
        let passes = traffic.passes as f64 * pass.seconds;
        let seconds = load.seconds + passes + fill_seconds + integration.seconds;
        Self { load, pass, integration, seconds, bytes: traffic.bytes() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::thesis;
    use pgs_interface::profile::{FLOAT, HALF, Profile};

    const THESIS_STEP: StepShape = thesis::step();

    fn time(profile: &'static Profile, bandwidth: Bandwidth) -> StepTime {
        StepTime::new(&profile.default_variant(), Records::Streamed, &THESIS_STEP, bandwidth)
    }

    /// The times of the platform notes: eight passes of 127,000 collisions.
    #[test]
    fn the_sustained_bandwidth_limits_float_and_the_peak_does_not() {
        for (profile, bandwidth, ms) in [
            (&FLOAT, Bandwidth::ZCU102_SUSTAINED, 8.89),
            (&FLOAT, Bandwidth::ZCU102_PEAK, 7.39),
            (&HALF, Bandwidth::ZCU102_SUSTAINED, 6.10),
        ] {
            let found = time(profile, bandwidth).pass.seconds * 8e3;
            assert!((found - ms).abs() < 0.005, "{} {found} ms, not {ms}", profile.name);
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
    fn a_step_is_the_sum_of_its_parts() {
        let time = time(&HALF, Bandwidth::ZCU102_SUSTAINED);
        // Velocities 38,880 beats, passes of 444,500, poses 38,880, results 77,760.
        assert_eq!(time.bytes, 16 * (38_880 + 8 * 444_500 + 38_880 + 77_760));
        let expected =
            15_552.0 / 250e6 + 8.0 * 190_500.0 / 250e6 + 2_205.0 / 250e6 + 1_866_240.0 / 12.8e9;
        assert!((time.seconds - expected).abs() < 1e-12, "{} s", time.seconds);
    }
}
