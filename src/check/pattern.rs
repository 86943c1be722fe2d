//! Makes the pattern of an echo: no beat twice, and every bit of every lane comes back as 0 and as
//! 1.
//!
//! Every part on the way holds these numbers exactly. Where a stream, an array or the arithmetic
//! for bodies has sixteen bits, the numbers are limited to a sign, exponents of -14 to 15 and ten
//! bits of mantissa. Their words are the same in binary16 and in the thesis' format.

use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::Variant;
use pgs_interface::record::{Beat, LANES, WORD_LANE, result};

use crate::axi_dma::Direction;
use crate::beat::stripe::{Layout, Segment};
use crate::scene::{Body, Pose, Shape, Velocity};
use crate::step::FillPattern;

/// Shapes that the bodies refer to in turn. All of them move, so that every body is sent.
pub(super) const SHAPES: [Shape; 3] =
    [Shape::isotropic(1.0, 1.0), Shape::isotropic(2.0, 3.0), Shape::isotropic(0.5, 0.25)];

/// Lanes of a body that come back.
const WORDS_PER_BODY: u32 = 13;

/// The numbers that a bitstream returns bit for bit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pattern {
    results: Layout,
    /// Whether numbers must be exact in sixteen bits.
    short: bool,
}

impl Pattern {
    /// Makes the pattern for a bitstream.
    pub(super) fn of(variant: &Variant) -> Self {
        let Numbers { bodies, poses, updates, velocities, .. } = variant.numbers;
        let short = [bodies, poses] != [StreamFormat::F32; 2]
            || updates != Precision::F32
            || velocities != Precision::F32;
        Self { results: Segment::Results.layout(variant), short }
    }

    /// The bodies of a pattern.
    pub(super) fn bodies(&self, seed: u32, count: u32) -> Vec<Body> {
        let number = if self.short { short_number } else { number };
        let body = |index: u32| {
            let at = |word: u32| f32::from_bits(number(seed, index * WORDS_PER_BODY + word));
            let three = |first| [at(first), at(first + 1), at(first + 2)];
            Body {
                pose: Pose { position: three(0), orientation: [at(3), at(4), at(5), at(6)] },
                velocity: Velocity { linear: three(7), angular: three(10) },
                shape: index % 3,
            }
        };
        (0..count).map(body).collect()
    }

    /// The result beats of bodies that come back unchanged, by channel.
    pub(super) fn results(&self, bodies: &[Body], channels: usize) -> Vec<Vec<Beat>> {
        let beats = |channel| self.results.beats_on_channel(bodies.len(), channel);
        let mut results: Vec<_> =
            (0..channels).map(|channel| vec![Beat::default(); beats(channel)]).collect();
        let mut next = 0;
        let mut put = |beat| {
            let place = self.results.place(next);
            results[place.channel][place.slot] = beat;
            next += 1;
        };
        for body in bodies {
            let three = |v: [f32; 3]| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), 0];
            let mut of = [[0; LANES]; result::ROWS];
            of[result::POSITION] = three(body.pose.position);
            of[result::ORIENTATION] = body.pose.orientation.map(f32::to_bits);
            of[result::LINEAR] = three(body.velocity.linear);
            of[result::ANGULAR] = three(body.velocity.angular);
            if self.results.rows_per_beat() == 1 {
                of.map(Beat).into_iter().for_each(&mut put);
            } else {
                let (pairs, _) = of.as_chunks::<2>();
                pairs.iter().map(pair).for_each(&mut put);
            }
        }
        results
    }

    /// The contents of buffers before their use: numbers that no pattern holds. Read as a body they
    /// are valid, so that an accelerator that receives them sends them back.
    pub(super) fn filler(&self) -> FillPattern {
        match (self.results.rows_per_beat(), self.short) {
            (1, false) => |direction, channel, slot| row(number, direction, channel, slot),
            (1, true) => |direction, channel, slot| row(short_number, direction, channel, slot),
            _ => |direction, channel, slot| {
                let [first, second] = [2 * slot, 2 * slot + 1]
                    .map(|row_slot| row(short_number, direction, channel, row_slot).0);
                pair(&[first, second])
            },
        }
    }

    /// The bits of a beat that every result returns unchanged, whatever its contents. The word
    /// beside a vec3 is not returned.
    pub(super) fn returned(&self) -> [u32; LANES] {
        const ALL: u32 = u32::MAX;
        if self.results.rows_per_beat() == 1 {
            [ALL, ALL, ALL, 0]
        } else {
            [ALL, 0xFFFF, ALL, 0xFFFF]
        }
    }
}

/// A row of filler: three numbers, and zero for shape and padding.
fn row(number: fn(u32, u32) -> u32, direction: Direction, channel: usize, slot: usize) -> Beat {
    let seed = match direction {
        Direction::Mm2s => 0xD1,
        Direction::S2mm => 0xD2,
    };
    let index = u32::try_from(slot * 16 + channel * 4).unwrap_or(0);
    let mut beat = Beat([0, 1, 2, 3].map(|lane| number(seed, index + lane)));
    beat.0[WORD_LANE] = 0;
    beat
}

/// A beat of two rows of short numbers, the first in its low half.
fn pair([low, high]: &[[u32; LANES]; 2]) -> Beat {
    // 0 stands for itself; every other number is a normal one in sixteen bits.
    let word = |bits: u32| {
        let magnitude = (bits & !(1 << 31)).saturating_sub(112 << 23);
        ((bits & (1 << 31)) >> 16) | (magnitude >> 13)
    };
    let lane = |row: &[u32; LANES], at: usize| word(row[at]) | (word(row[at + 1]) << 16);
    Beat([lane(low, 0), lane(low, 2), lane(high, 0), lane(high, 2)])
}

/// Bits that follow no pattern.
fn mixed(seed: u32, index: u32) -> u32 {
    // Steps of an odd constant, mixed (the finalizer of MurmurHash3).
    let mut word = seed.wrapping_mul(0x85EB_CA6B).wrapping_add(index.wrapping_mul(0x9E37_79B9));
    word = (word ^ (word >> 16)).wrapping_mul(0x85EB_CA6B);
    word = (word ^ (word >> 13)).wrapping_mul(0xC2B2_AE35);
    word ^ (word >> 16)
}

/// A number that is neither zero, nor subnormal, nor infinite, so that every arithmetic keeps it.
fn number(seed: u32, index: u32) -> u32 {
    let word = mixed(seed, index);
    // Exponents of 64 to 191.
    let exponent = 64 + ((word >> 23) & 0x7F);
    (word & 0x807F_FFFF) | (exponent << 23)
}

/// A number as [`number`] makes it, which sixteen bits hold.
fn short_number(seed: u32, index: u32) -> u32 {
    let word = mixed(seed, index);
    // Exponents of 1 to 30 in sixteen bits.
    let exponent = 112 + 1 + ((word >> 23) & 0xFF) % 30;
    (word & 0x807F_E000) | (exponent << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF};

    fn of(variant: &Variant) -> (Pattern, usize) {
        (Pattern::of(variant), variant.profile.s2mm_widths.len())
    }

    #[test]
    fn every_bit_of_every_lane_that_comes_back_is_seen_as_0_and_as_1() {
        let (pattern, channels) = of(&FLOAT.default_variant());
        let results = pattern.results(&pattern.bodies(1, 64), channels);
        for (kind, lanes) in [(0, 3), (1, 4), (2, 3), (3, 3)] {
            // With four channels, channel k carries beat k of every record.
            for lane in 0..lanes {
                let words = || results[kind].iter().map(|beat| beat.0[lane]);
                let ones = words().fold(0, |all, word| all | word);
                let zeros = words().fold(0, |all, word| all | !word);
                assert_eq!((ones, zeros), (u32::MAX, u32::MAX), "beat {kind}, lane {lane}");
            }
        }
    }

    #[test]
    fn every_bit_of_a_beat_of_half_too() {
        let (pattern, channels) = of(&HALF.default_variant());
        let results = pattern.results(&pattern.bodies(1, 200), channels);
        for (channel, beats) in results.iter().enumerate() {
            // Poses and velocities alternate. Only a pose has a number beside its second vec3.
            let ones =
                beats.iter().fold([0; 4], |all, beat| [0, 1, 2, 3].map(|l| all[l] | beat.0[l]));
            let zeros =
                beats.iter().fold([0; 4], |all, beat| [0, 1, 2, 3].map(|l| all[l] | !beat.0[l]));
            assert_eq!(ones, [u32::MAX, 0xFFFF, u32::MAX, u32::MAX], "channel {channel}");
            assert_eq!(zeros, [u32::MAX; 4], "channel {channel}");
        }
    }

    /// Checks the words by value, without the code that makes them.
    #[test]
    fn words_of_sixteen_bits_are_those_of_their_numbers() {
        let (pattern, channels) = of(&HALF.default_variant());
        let bodies = pattern.bodies(3, 5);
        let results = pattern.results(&bodies, channels);
        let beat = results[0][0].0.map(|lane| [lane & 0xFFFF, lane >> 16]);
        let words = beat.as_flattened();
        let [x, y, z] = bodies[0].pose.position;
        let sent = [&[x, y, z, 0.0][..], &bodies[0].pose.orientation].concat();
        for (word, sent) in words.iter().zip(sent) {
            let bits = u16::try_from(*word).expect("sixteen bits");
            let value = half::f16::from_bits(bits).to_f32();
            assert_eq!(value.to_bits(), sent.to_bits());
        }
    }

    #[test]
    fn a_half_way_array_shortens_the_numbers_of_wide_streams() {
        assert!(!Pattern::of(&FLOAT.default_variant()).short);
        let numbers = Numbers { velocities: Precision::Binary16, ..FLOAT.numbers };
        let pattern = Pattern::of(&Variant { numbers, ..FLOAT.default_variant() });
        let bodies = pattern.bodies(1, 100);
        assert!(bodies.iter().all(|body| body.velocity.linear[0].to_bits().trailing_zeros() >= 13));
        assert_eq!(pattern.filler()(Direction::Mm2s, 0, 7).0[0].trailing_zeros().min(13), 13);
    }

    #[test]
    fn patterns_are_normal_numbers_and_no_two_beats_are_equal() {
        for variant in [FLOAT.default_variant(), HALF.default_variant()] {
            let (pattern, channels) = of(&variant);
            let mut seen = std::collections::HashSet::new();
            for seed in 1..=3 {
                let bodies = pattern.bodies(seed, 1000);
                for body in &bodies {
                    let normal = |numbers: &[f32]| numbers.iter().all(|number| number.is_normal());
                    assert!(normal(&body.pose.position) && normal(&body.pose.orientation));
                    assert!(normal(&body.velocity.linear) && normal(&body.velocity.angular));
                }
                for beat in pattern.results(&bodies, channels).into_iter().flatten() {
                    assert!(seen.insert(beat.0), "{beat:?} twice");
                }
            }
            for slot in 0..1000 {
                for direction in [Direction::Mm2s, Direction::S2mm] {
                    for channel in 0..4 {
                        assert!(seen.insert(pattern.filler()(direction, channel, slot).0));
                    }
                }
            }
        }
    }
}
