//! This file reads the results out of the channels' beats.

use super::stripe::{Place, Segment};
use crate::interface::record::{Beat, LANES, result};
use crate::record;
use crate::scene::{Pose, Velocity};

/// The new state of body `body` from the result segments, one a channel.
#[inline]
pub(crate) fn unpack_result(body: usize, channels: &[&[Beat]]) -> (Pose, Velocity) {
    let beats: [Beat; result::ROWS] = if let [first, second, third, fourth] = channels {
        // As many channels as a record has beats: the running index needs no division.
        [first[body], second[body], third[body], fourth[body]]
    } else {
        std::array::from_fn(|beat| {
            let Place { channel, slot } = Segment::Results.place(body, beat, channels.len());
            channels[channel][slot]
        })
    };
    record::result::decode(&beats)
}

/// Sum of all 32-bit words, modulo 2^32: what the accelerator counts of what it sent.
pub(crate) fn sum_of_words(beats: &[Beat]) -> u32 {
    let mut lanes = [0_u32; LANES];
    for beat in beats {
        add(&mut lanes, *beat);
    }
    total(lanes)
}

/// Adds each word of a beat to its lane's sum.
#[inline]
pub(super) fn add(lanes: &mut [u32; LANES], beat: Beat) {
    for (sum, word) in lanes.iter_mut().zip(beat.0) {
        *sum = sum.wrapping_add(word);
    }
}

/// The lanes' sums in one.
pub(super) fn total(lanes: [u32; LANES]) -> u32 {
    lanes.into_iter().fold(0, u32::wrapping_add)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_sum_wraps() {
        assert_eq!(sum_of_words(&[]), 0);
        assert_eq!(sum_of_words(&[Beat([1, 2, 3, 4]), Beat([10, 20, 30, 40])]), 110);
        assert_eq!(sum_of_words(&[Beat([u32::MAX, 0, 0, 0]), Beat([0, 0, 0, 3])]), 2);
    }

    proptest! {
        /// The beats are laid out as the record table and the running index say, without `place`.
        #[test]
        fn every_result_comes_back_from_any_number_of_channels(
            words in prop::collection::vec(any::<[u32; 16]>(), 0..30),
            channels in 1_usize..=4,
        ) {
            let mut segments = vec![Vec::new(); channels];
            for (index, lanes) in words.iter().flat_map(|record| record.chunks(4)).enumerate() {
                segments[index % channels].push(Beat([lanes[0], lanes[1], lanes[2], lanes[3]]));
            }
            let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
            for (body, expected) in words.iter().enumerate() {
                let (pose, velocity) = unpack_result(body, &views);
                prop_assert_eq!(&pose.position.map(f32::to_bits)[..], &expected[0..3]);
                prop_assert_eq!(&pose.orientation.map(f32::to_bits)[..], &expected[4..8]);
                prop_assert_eq!(&velocity.linear.map(f32::to_bits)[..], &expected[8..11]);
                prop_assert_eq!(&velocity.angular.map(f32::to_bits)[..], &expected[12..15]);
            }
        }

        #[test]
        fn the_sum_is_that_of_the_words_one_by_one(
            beats in prop::collection::vec(any::<[u32; 4]>().prop_map(Beat), 0..40),
        ) {
            let mut expected = 0_u64;
            for Beat(words) in &beats {
                for word in words {
                    expected += u64::from(*word);
                }
            }
            prop_assert_eq!(u64::from(sum_of_words(&beats)), expected & 0xFFFF_FFFF);
        }
    }
}
