//! Traffic of a step: bytes, padding and stream cycles of each array.
//!
//! An array of records goes out in groups of beats ([`stripe`](pgs_interface::stripe)). Its streams
//! run side by side, and each takes `128 / width` cycles for a beat of 128 bits. The array takes
//! the cycles of its busiest stream.

use super::designs::{self, Window};
use super::step::StepShape;
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::{Inertia, RecordWords, THESIS_WORDS, Variant};
use pgs_interface::record::{LANES, pose, result};
use pgs_interface::stripe::Stripe;

/// Bits of a beat.
const BEAT_BITS: u32 = 128;
const BITS_PER_BYTE: u64 = 8;

/// Numbers of a relative collision: normal 3, four points with distance 16, offset 3, indices 2.
const RELATIVE_NUMBERS: u32 = 24;
/// Numbers of a world inverse inertia.
const INERTIA_NUMBERS: u32 = 6;

/// The way in which records are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Records {
    /// Without any padding, over the streams' widths together, as the thesis counts.
    Packed,
    /// As they travel: rows, beats and stripes, padding included.
    Streamed,
}

impl Records {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Packed, Self::Streamed];

    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Packed => "packed",
            Self::Streamed => "streamed",
        }
    }
}

/// One array of records on its way between memory and accelerator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transfer {
    /// Bytes that move, padding records included.
    pub bytes: u64,
    /// Bytes of padding records among them.
    pub padding: u64,
    /// Cycles of the busiest stream.
    pub cycles: u64,
}

impl Transfer {
    /// Records of `rows` rows, dealt out by `stripe` to streams of `widths` bits.
    ///
    /// `whole` records always travel together; padding records fill the last of these sets up.
    /// Counts beyond 64 bits saturate.
    #[must_use]
    pub fn streamed(
        records: u64,
        whole: u32,
        rows: usize,
        format: StreamFormat,
        stripe: &Stripe,
        widths: &[u32],
    ) -> Self {
        let record_bits = (rows * LANES) as u64 * u64::from(format.bits());
        let useful = records.saturating_mul(record_bits).div_ceil(BITS_PER_BYTE);
        let sent = records.checked_next_multiple_of(u64::from(whole.max(1))).unwrap_or(records);
        let group = (stripe.streams.len() as u64).max(1);
        let mut beats = sent.saturating_mul(record_bits).div_ceil(u64::from(BEAT_BITS));
        if stripe.padded {
            beats = beats.checked_next_multiple_of(group).unwrap_or(beats);
        }
        let (groups, rest) = (beats / group, beats % group);
        let on_stream = |stream: usize| {
            let share = |beats: &[u8]| {
                beats.iter().filter(|number| usize::from(**number) == stream).count() as u64
            };
            #[expect(clippy::cast_possible_truncation, reason = "less than a group")]
            let rest = &stripe.streams[..rest as usize];
            groups.saturating_mul(share(stripe.streams)) + share(rest)
        };
        let cycles = widths
            .iter()
            .enumerate()
            .map(|(stream, width)| {
                let bits = on_stream(stream).saturating_mul(u64::from(BEAT_BITS));
                bits.div_ceil(u64::from(*width).max(1))
            })
            .max()
            .unwrap_or(0);
        let bytes = beats.saturating_mul(u64::from(BEAT_BITS) / BITS_PER_BYTE);
        Self { bytes, padding: bytes.saturating_sub(useful), cycles }
    }

    /// Records of `numbers` numbers without padding, on streams with the sum of `widths` as their
    /// width.
    #[must_use]
    pub fn packed(records: u64, numbers: u32, format: StreamFormat, widths: &[u32]) -> Self {
        let width: u64 = widths.iter().map(|width| u64::from(*width)).sum();
        let bits = records.saturating_mul(u64::from(numbers) * u64::from(format.bits()));
        Self {
            bytes: bits.div_ceil(BITS_PER_BYTE),
            padding: 0,
            cycles: bits.div_ceil(width.max(1)),
        }
    }
}

/// Numbers of the records without padding: the thesis' records, with this project's additions.
fn packed_numbers(variant: &Variant) -> RecordWords {
    let inertia = match variant.inertia {
        Inertia::Isotropic => 0,
        Inertia::World => INERTIA_NUMBERS,
    };
    let relative = designs::is_relative(variant.profile);
    let collision = if relative { RELATIVE_NUMBERS } else { THESIS_WORDS.collision };
    RecordWords { velocity: THESIS_WORDS.velocity + inertia, collision, ..THESIS_WORDS }
}

/// Traffic of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepTraffic {
    /// Velocities in.
    pub velocities: Transfer,
    /// Collisions in, once.
    pub collisions: Transfer,
    /// Number of times that the collisions stream in a step.
    pub collision_streams: u64,
    /// Poses in.
    pub poses: Transfer,
    /// Results out, while the poses come in.
    pub results: Transfer,
}

impl StepTraffic {
    /// The traffic of a step in a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant, records: Records, step: &StepShape) -> Self {
        let profile = variant.profile;
        let (bodies, collisions) = (step.bodies, step.collisions);
        let formats = variant.numbers;
        let (to, from) = (profile.mm2s_widths, profile.s2mm_widths);
        let once = Window::of(profile).is_some();
        let collision_streams = if once { step.passes().min(1) } else { step.passes() };
        match records {
            Records::Packed => {
                let numbers = packed_numbers(variant);
                let body =
                    |numbers, format, widths| Transfer::packed(bodies, numbers, format, widths);
                Self {
                    velocities: body(numbers.velocity, formats.bodies, to),
                    collisions: Transfer::packed(
                        collisions,
                        numbers.collision,
                        formats.collisions,
                        to,
                    ),
                    collision_streams,
                    poses: body(numbers.pose, formats.poses, to),
                    results: body(numbers.result, formats.poses, from),
                }
            }
            Records::Streamed => {
                let stripes = &profile.stripes;
                let body = |rows, format, stripe, widths| {
                    Transfer::streamed(bodies, 1, rows, format, stripe, widths)
                };
                Self {
                    velocities: body(
                        variant.velocity_rows(),
                        formats.bodies,
                        &stripes.velocities,
                        to,
                    ),
                    collisions: Transfer::streamed(
                        collisions,
                        profile.collisions_per_issue,
                        designs::collision_rows(profile),
                        formats.collisions,
                        &profile.stripes.collisions,
                        to,
                    ),
                    collision_streams,
                    poses: body(pose::ROWS, formats.poses, &stripes.poses, to),
                    results: body(result::ROWS, formats.poses, &stripes.results, from),
                }
            }
        }
    }

    /// Bytes of a whole step, in and out.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.collisions
            .bytes
            .saturating_mul(self.collision_streams)
            .saturating_add(self.velocities.bytes)
            .saturating_add(self.poses.bytes)
            .saturating_add(self.results.bytes)
    }
}

/// High-performance ports between memory and logic: HP0 to HP3 (UG1085; the two HPC ports cost
/// more).
pub const HP_PORTS: usize = 4;
/// Width of an HP port, bits.
pub const HP_PORT_BITS: u32 = 128;

/// Demand of a profile's collision streams on the memory while a pass runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamDemand {
    /// Streams to the accelerator; each takes a port of its own.
    pub ports: usize,
    /// Whether every stream gets a port, and none is wider than its port.
    pub fits: bool,
    /// Bytes per second.
    pub rate: f64,
}

impl StreamDemand {
    /// The demand of a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant) -> Self {
        let profile = variant.profile;
        let step = StepShape::new(0, u64::from(profile.collisions_per_issue));
        let issue = StepTraffic::new(variant, Records::Streamed, &step).collisions;
        let clock = f64::from(profile.clock_khz) * 1e3;
        let ports = profile.mm2s_widths.len();
        let issues = Window::of(profile).map_or(1, Window::issues_per_entry);
        let cycles = profile.initiation_interval.saturating_mul(issues).max(1);
        Self {
            ports,
            fits: ports <= HP_PORTS && profile.mm2s_widths.iter().all(|w| *w <= HP_PORT_BITS),
            rate: issue.bytes as f64 / f64::from(cycles) * clock,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{DESIGNS, MIXED};
    use pgs_interface::profile::{FLOAT, HALF, NAIVE};

    fn streamed(variant: &Variant, bodies: u64, collisions: u64) -> StepTraffic {
        StepTraffic::new(variant, Records::Streamed, &StepShape::new(bodies, collisions))
    }

    #[test]
    fn the_busiest_stream_counts() {
        // Float: beats 0 and 4 of a collision share stream 0; 9 bodies are 18 beats on 4 streams.
        let float = streamed(&FLOAT.default_variant(), 9, 5);
        assert_eq!((float.collisions.cycles, float.collisions.bytes), (10, 5 * 112));
        assert_eq!((float.velocities.cycles, float.results.cycles), (5, 9));
        assert_eq!(float.velocities.padding, 0);
        // Naive: 28 words on 32 bits.
        assert_eq!(streamed(&NAIVE.default_variant(), 0, 5).collisions.cycles, 5 * 28);
        // Mixed: three beats on three streams.
        let mixed = streamed(&MIXED.default_variant(), 3, 5);
        assert_eq!((mixed.collisions.cycles, mixed.collisions.bytes), (5, 5 * 48));
        assert_eq!((mixed.velocities.cycles, mixed.results.cycles), (2, 4));
    }

    #[test]
    fn half_pads_an_odd_collision_and_whole_groups_of_bodies() {
        let half = streamed(&HALF.default_variant(), 11, 3);
        // Four collisions in two groups of seven beats, three cycles each.
        let collisions = Transfer { bytes: 4 * 56, padding: 56, cycles: 6 };
        assert_eq!(half.collisions, collisions);
        // Eleven bodies in three groups of five beats, two cycles each.
        assert_eq!(half.velocities, Transfer { bytes: 15 * 16, padding: 4 * 16, cycles: 6 });
        assert_eq!(half.poses, half.velocities);
        // 22 beats of results in five groups.
        assert_eq!(half.results, Transfer { bytes: 25 * 16, padding: 3 * 16, cycles: 10 });
    }

    #[test]
    fn world_inertia_doubles_the_velocities_alone() {
        let isotropic = streamed(&FLOAT.default_variant(), 100, 7);
        let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
        let world = streamed(&world, 100, 7);
        assert_eq!(world.velocities.bytes, 2 * isotropic.velocities.bytes);
        assert_eq!(world.velocities.cycles, 2 * isotropic.velocities.cycles);
        assert_eq!(world.collisions, isotropic.collisions);
        assert_eq!((world.poses, world.results), (isotropic.poses, isotropic.results));
    }

    #[test]
    fn the_streams_ask_for_the_gb_s_of_the_platform_notes() {
        let rate = |profile: &'static pgs_interface::profile::Profile| {
            StreamDemand::new(&profile.default_variant()).rate / 1e9
        };
        for (found, expected) in [
            (rate(&NAIVE), 1.1),
            (rate(&FLOAT), 15.4),
            (rate(&HALF), 28.0 / 3.0),
            (rate(&MIXED), 12.0),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} GB/s, expected {expected}");
        }
    }

    #[test]
    fn no_count_overflows() {
        for profile in DESIGNS {
            for records in Records::ALL {
                let step = StepShape::new(u64::MAX, u64::MAX);
                let traffic = StepTraffic::new(&profile.default_variant(), records, &step);
                // Where the collisions stream once, the eighth part of the traffic of eight passes.
                let most = if Window::of(profile).is_some() { u64::MAX / 8 } else { u64::MAX };
                assert!(traffic.bytes() >= most, "{}", profile.name);
            }
        }
    }
}
