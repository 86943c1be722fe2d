//! Figures that the thesis reports of its designs and of other machines (§4.4.2, §5.4.4, §5.5,
//! Tables
//! 6.1 to 6.11, equation 6.5).

use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, HALF, Profile};

/// A machine that the thesis compares with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform {
    /// Name.
    pub name: &'static str,
    /// Time of a step's solver and integration, ms.
    pub latency_ms: f64,
    /// Power that the thesis calculates with, W.
    pub watts: f64,
    /// Energy that it prints, J.
    pub joules: f64,
    /// Thermal design power of the same machine in Tables 6.2 and 6.3, W.
    pub design_watts: f64,
}

/// The GPU of Table 6.2.
pub const GPU: Platform = Platform {
    name: "GTX 980",
    latency_ms: 13.64,
    watts: 288.0,
    joules: 3.93,
    design_watts: 165.0,
};
/// The CPU of Table 6.3.
pub const CPU: Platform =
    Platform { name: "i7-3770", latency_ms: 53.01, watts: 133.0, joules: 7.05, design_watts: 77.0 };
/// Memory bandwidth in the thesis' calculations (§5.4.2): the largest that others had measured. The
/// thesis' cycles contain no wait for memory.
pub const MEMORY_BANDWIDTH: Bandwidth = Bandwidth::BytesPerSecond(16_000_000_000);
/// Power of the ZCU102 that the thesis calculates with, W: its maximum, not measured.
pub const ZCU102_WATTS: f64 = 15.0;
/// Cycles from an issue of the half design to the next before its second copy of the velocities
/// (§5.5.2).
pub const ONE_COPY_INTERVAL: u32 = 4;
/// Block RAM of the device (Table 6.1), MB.
pub const DEVICE_MEGABYTES: u32 = 4;
/// Share of a whole step that the accelerator takes over (§4.4).
pub const ACCELERATED_SHARE: f64 = 0.6;

/// The figures that the thesis reports of one of its designs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// The profile that describes it.
    pub profile: &'static Profile,
    /// Section of its results.
    pub section: &'static str,
    /// Table of its cycles and resources.
    pub results: &'static str,
    /// Table of its latency and energy.
    pub comparison: &'static str,
    /// Table of its speed-up.
    pub speedups: &'static str,
    /// Table of its efficiency.
    pub efficiencies: &'static str,
    /// Cycles from an issue to the next (§5.4.4, §5.5.3).
    pub initiation_interval: u32,
    /// Clock cycles of a step.
    pub cycles: u64,
    /// Clock, MHz.
    pub clock_mhz: u32,
    /// Block RAMs of 18 Kib used, percent of the device.
    pub block_ram: u32,
    /// DSP48E used, percent.
    pub dsp: u32,
    /// Flip-flops used, percent.
    pub flip_flops: u32,
    /// Lookup tables used, percent.
    pub lookup_tables: u32,
    /// Block RAM of its arrays, MiB (§4.4.2).
    pub mebibytes: f64,
    /// Block RAM of its arrays with the positions on chip, MiB.
    pub mebibytes_with_positions: f64,
    /// Latency, ms.
    pub latency_ms: f64,
    /// Energy, J.
    pub joules: f64,
    /// Speed-up over the GTX 980 and over the i7-3770.
    pub speedup: [f64; 2],
    /// Power efficiency over both.
    pub power: [f64; 2],
    /// Energy efficiency over both.
    pub energy: [f64; 2],
    /// Speed-up of a whole step over one with the GTX 980.
    pub whole_step: f64,
}

/// The single-precision design (§5.4).
pub const FLOAT_DESIGN: Design = Design {
    profile: &FLOAT,
    section: "§6.4",
    results: "T6.4",
    comparison: "T6.5",
    speedups: "T6.6",
    efficiencies: "T6.7",
    initiation_interval: 2,
    cycles: 2_062_697,
    clock_mhz: 275,
    block_ram: 70,
    dsp: 42,
    flip_flops: 32,
    lookup_tables: 47,
    mebibytes: 2.83,
    mebibytes_with_positions: 3.27,
    latency_ms: 7.49,
    joules: 0.11,
    speedup: [1.82, 7.08],
    power: [19.2, 8.67],
    energy: [35.72, 64.09],
    whole_step: 1.37,
};

/// The half-precision design (§5.5).
pub const HALF_DESIGN: Design = Design {
    profile: &HALF,
    section: "§6.5",
    results: "T6.8",
    comparison: "T6.9",
    speedups: "T6.10",
    efficiencies: "T6.11",
    initiation_interval: 3,
    cycles: 1_557_317,
    clock_mhz: 250,
    block_ram: 48,
    dsp: 42,
    flip_flops: 29,
    lookup_tables: 49,
    mebibytes: 1.86,
    mebibytes_with_positions: 2.30,
    latency_ms: 6.23,
    joules: 0.09,
    speedup: [2.19, 8.5],
    power: [19.2, 8.67],
    energy: [43.67, 78.34],
    whole_step: 1.48,
};

/// Both designs. Of its first design ([`NAIVE`]) the thesis prints no numbers: Figures 6.1 and 6.2
/// chart it.
///
/// [`NAIVE`]: pgs_interface::profile::NAIVE
pub const DESIGNS: [&Design; 2] = [&FLOAT_DESIGN, &HALF_DESIGN];

impl Design {
    /// The reported figures of the design that a profile describes.
    #[must_use]
    pub fn of(profile: &Profile) -> Option<&'static Self> {
        DESIGNS.into_iter().find(|design| design.profile.id == profile.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::thesis::amdahl;

    fn assert_near(found: f64, printed: f64, tolerance: f64, what: &str) {
        assert!((found - printed).abs() <= tolerance, "{what}: {found}, printed {printed}");
    }

    /// 2,062,697 cycles at 275 MHz are 7.501 ms; T6.5 prints 7.49.
    #[test]
    fn floats_latency_is_a_little_less_than_its_cycles() {
        let found = FLOAT_DESIGN.cycles as f64 / 275e3;
        assert_near(found, 7.501, 0.0005, "recomputed");
        assert_near(FLOAT_DESIGN.latency_ms, 7.49, 1e-9, "printed");
    }

    #[test]
    fn the_printed_figures_follow_from_each_other() {
        for design in DESIGNS {
            let clock_khz = f64::from(design.profile.clock_khz);
            assert_near(design.cycles as f64 / clock_khz, design.latency_ms, 0.02, "latency");
            assert_near(ZCU102_WATTS * design.latency_ms / 1e3, design.joules, 0.005, "energy");
            for (platform, speedup, energy) in [
                (GPU, design.speedup[0], design.energy[0]),
                (CPU, design.speedup[1], design.energy[1]),
            ] {
                assert_near(platform.latency_ms / design.latency_ms, speedup, 0.01, "speed-up");
                // The printed joules have two digits.
                assert_near(platform.joules / design.joules, energy, 0.01, "energy");
                assert_near(
                    platform.watts * platform.latency_ms / 1e3,
                    platform.joules,
                    0.005,
                    "J",
                );
            }
            assert_near(GPU.watts / ZCU102_WATTS, design.power[0], 0.005, "power");
            let whole = amdahl(ACCELERATED_SHARE, GPU.latency_ms / design.latency_ms);
            assert_near(whole, design.whole_step, 0.005, "whole step");
            assert_eq!(design.clock_mhz * 1000, design.profile.clock_khz);
        }
    }

    /// 133 W / 15 W is 8.87; both tables print 8.67.
    #[test]
    fn the_power_efficiency_over_the_cpu_is_misprinted() {
        let found = CPU.watts / ZCU102_WATTS;
        assert_near(found, 8.87, 0.005, "recomputed");
        assert!(DESIGNS.iter().all(|design| (design.power[1] - 8.67).abs() < 1e-9));
    }
}
