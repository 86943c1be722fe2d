//! This file makes what an echo sends: no beat twice, and every bit of every lane that comes back as
//! 0 and as 1.

use bitstream_model::interface::record::{Beat, WORD_LANE, result};

use crate::axi_dma::Direction;
use crate::beat::stripe::{Segment, beats_on_channel};
use crate::scene::{Body, Pose, Shape, Velocity};

/// Shapes that the bodies refer to in turn; all of them move, so that nothing is left out.
pub(super) const SHAPES: [Shape; 3] =
    [Shape::isotropic(1.0, 1.0), Shape::isotropic(2.0, 3.0), Shape::isotropic(0.5, 0.25)];

/// Lanes of a body that come back.
const WORDS_PER_BODY: u32 = 13;

/// A number that is neither zero, nor subnormal, nor infinite, so that every arithmetic keeps it.
fn number(seed: u32, index: u32) -> u32 {
    // Steps of an odd constant, mixed (the finalizer of MurmurHash3).
    let mut word = seed.wrapping_mul(0x85EB_CA6B).wrapping_add(index.wrapping_mul(0x9E37_79B9));
    word = (word ^ (word >> 16)).wrapping_mul(0x85EB_CA6B);
    word = (word ^ (word >> 13)).wrapping_mul(0xC2B2_AE35);
    word ^= word >> 16;
    // Exponents of 64 to 191.
    let exponent = 64 + ((word >> 23) & 0x7F);
    (word & 0x807F_FFFF) | (exponent << 23)
}

/// The bodies of a pattern.
pub(super) fn bodies(seed: u32, count: u32) -> Vec<Body> {
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

/// The result beats of bodies that come back as they were sent, by channel.
pub(super) fn results(bodies: &[Body], channels: usize) -> Vec<Vec<Beat>> {
    let beats = |channel| beats_on_channel(Segment::Results, bodies.len(), channel, channels);
    let mut results: Vec<_> =
        (0..channels).map(|channel| vec![Beat::default(); beats(channel)]).collect();
    for (record, body) in bodies.iter().enumerate() {
        let three = |v: [f32; 3]| Beat([v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), 0]);
        let mut of = [Beat::default(); result::BEATS];
        of[result::POSITION] = three(body.pose.position);
        of[result::ORIENTATION] = Beat(body.pose.orientation.map(f32::to_bits));
        of[result::LINEAR] = three(body.velocity.linear);
        of[result::ANGULAR] = three(body.velocity.angular);
        for (beat, content) in of.into_iter().enumerate() {
            let place = Segment::Results.place(record, beat, channels);
            results[place.channel][place.slot] = content;
        }
    }
    results
}

/// What buffers are dirtied with: nothing that a pattern holds. Read as a body it is a valid one,
/// so that an accelerator which gets it sends it back.
pub(super) fn dirt(direction: Direction, channel: usize, slot: usize) -> Beat {
    let seed = match direction {
        Direction::Mm2s => 0xD1,
        Direction::S2mm => 0xD2,
    };
    let index = u32::try_from(slot * 16 + channel * 4).unwrap_or(0);
    let mut beat = Beat([0, 1, 2, 3].map(|lane| number(seed, index + lane)));
    // Shape and padding.
    beat.0[WORD_LANE] = 0;
    beat
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_of_every_lane_that_comes_back_is_seen_as_0_and_as_1() {
        let results = results(&bodies(1, 64), 4);
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
    fn patterns_are_normal_numbers_and_no_two_beats_are_equal() {
        let mut seen = std::collections::HashSet::new();
        for seed in 1..=3 {
            for beat in results(&bodies(seed, 1000), 4).into_iter().flatten() {
                let numbers = beat.0.map(f32::from_bits);
                assert!(numbers[..3].iter().all(|number| number.is_normal()));
                assert!(seen.insert(beat.0), "{beat:?} twice");
            }
        }
        for slot in 0..1000 {
            for direction in [Direction::Mm2s, Direction::S2mm] {
                for channel in 0..4 {
                    assert!(seen.insert(dirt(direction, channel, slot).0));
                }
            }
        }
    }
}
