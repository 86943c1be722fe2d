//! Traffic of a step: bytes, padding and stream cycles of each array.
//!
//! An array of records goes out in groups of beats ([`stripe`](pgs_interface::stripe)). Its streams
//! run side by side, and each takes `128 / width` cycles for a beat of 128 bits. The array takes
//! the cycles of its busiest stream.

use super::step::StepShape;
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::{Inertia, RecordWords, THESIS_WORDS, Variant};
use pgs_interface::record::{LANES, collision, pose, result};
use pgs_interface::stripe::Stripe;

/// Bits of a beat.
const BEAT_BITS: u64 = 128;
const BITS_PER_BYTE: u64 = 8;

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
        let useful = (records * record_bits).div_ceil(BITS_PER_BYTE);
        let sent = records.next_multiple_of(whole.into());
        let group = stripe.streams.len();
        let mut beats = (sent * record_bits).div_ceil(BEAT_BITS);
        if stripe.padded {
            beats = beats.next_multiple_of(group as u64);
        }
        let (groups, rest) = (beats / group as u64, beats % group as u64);
        let cycles = (0..).zip(widths).map(|(stream, width)| {
            let own = (0..).zip(stripe.streams).filter(|(_, number)| **number == stream);
            let beats: u64 = own.map(|(at, _)| groups + u64::from(at < rest)).sum();
            (beats * BEAT_BITS).div_ceil(u64::from(*width))
        });
        let bytes = beats * (BEAT_BITS / BITS_PER_BYTE);
        Self { bytes, padding: bytes - useful, cycles: cycles.max().unwrap_or(0) }
    }

    /// Records of `numbers` numbers without padding, on streams with the sum of `widths` as their
    /// width.
    #[must_use]
    pub fn packed(records: u64, numbers: u32, format: StreamFormat, widths: &[u32]) -> Self {
        let width: u64 = widths.iter().map(|width| u64::from(*width)).sum();
        let bits = records * u64::from(numbers) * u64::from(format.bits());
        Self { bytes: bits.div_ceil(BITS_PER_BYTE), padding: 0, cycles: bits.div_ceil(width) }
    }
}

/// Numbers of the records without padding: the thesis' records, with this project's additions.
fn packed_numbers(variant: &Variant) -> RecordWords {
    let inertia = match variant.inertia {
        Inertia::Isotropic => 0,
        Inertia::World => INERTIA_NUMBERS,
    };
    RecordWords { velocity: THESIS_WORDS.velocity + inertia, ..THESIS_WORDS }
}

/// Traffic of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepTraffic {
    /// Velocities in.
    pub velocities: Transfer,
    /// Collisions in, once.
    pub collisions: Transfer,
    /// Passes: the collisions stream once in each.
    pub passes: u64,
    /// Poses in.
    pub poses: Transfer,
    /// Results out, while the poses come in.
    pub results: Transfer,
}

impl StepTraffic {
    /// The traffic of a step in a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant, records: Records, step: &StepShape) -> Self {
        let Variant { profile, numbers: formats, .. } = variant;
        let (stripes, to, from) = (&profile.stripes, profile.mm2s_widths, profile.s2mm_widths);
        let array = |count, whole, (numbers, rows), format, stripe: &Stripe, widths| match records {
            Records::Packed => Transfer::packed(count, numbers, format, widths),
            Records::Streamed => Transfer::streamed(count, whole, rows, format, stripe, widths),
        };
        let body = |size, format, stripe, to| array(step.bodies, 1, size, format, stripe, to);
        let numbers = packed_numbers(variant);
        let record = (numbers.collision, collision::ROWS);
        let (each, whole) = (step.collisions, profile.collisions_per_issue);
        let velocity = (numbers.velocity, variant.velocity_rows());
        let (pose, result) = ((numbers.pose, pose::ROWS), (numbers.result, result::ROWS));
        Self {
            velocities: body(velocity, formats.bodies, &stripes.velocities, to),
            collisions: array(each, whole, record, formats.collisions, &stripes.collisions, to),
            passes: step.passes(),
            poses: body(pose, formats.poses, &stripes.poses, to),
            results: body(result, formats.poses, &stripes.results, from),
        }
    }

    /// Bytes of a whole step, in and out.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let bodies = self.velocities.bytes + self.poses.bytes + self.results.bytes;
        self.collisions.bytes * self.passes + bodies
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, PROFILES};

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
    fn the_most_bodies_and_collisions_of_the_command_line_are_counted() {
        for profile in PROFILES {
            for records in Records::ALL {
                let step = StepShape::new(u32::MAX.into(), u32::MAX.into());
                let traffic = StepTraffic::new(&profile.default_variant(), records, &step);
                assert!(traffic.bytes() > u64::from(u32::MAX) * 28, "{}", profile.name);
            }
        }
    }
}
