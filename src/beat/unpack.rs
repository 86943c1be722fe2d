//! This file reads the results out of the channels' beats.

use bitstream_model::interface::record::{Beat, LANES, result};

use super::stripe::{Deal, Layout, Place};
use crate::record;
use crate::record::sixteen::{Row, Sixteen};
use crate::scene::{Pose, Velocity};

/// The new states of the bodies, one after the other, from the result segments, one a channel.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
#[derive(Debug)]
pub(crate) struct Results<'a> {
    channels: &'a [&'a [Beat]],
    deal: Deal,
    format: Option<Sixteen>,
}

impl<'a> Results<'a> {
    /// From the first body on.
    pub(crate) fn new(layout: &Layout, channels: &'a [&'a [Beat]]) -> Self {
        Self { channels, deal: Deal::new(layout.stripe), format: Sixteen::of(layout.format) }
    }

    /// The new state of the next body. A number that the accelerator could not hold is not finite.
    #[inline]
    pub(crate) fn next(&mut self) -> (Pose, Velocity) {
        let rows = match self.format {
            None => std::array::from_fn(|_| self.beat()),
            Some(format) => {
                let beats: [Beat; result::ROWS / 2] = std::array::from_fn(|_| self.beat());
                let rows: [Row; result::ROWS] = bytemuck::cast(beats);
                format.widen(&rows)
            }
        };
        record::result::decode(&rows)
    }

    #[inline]
    fn beat(&mut self) -> Beat {
        let Place { channel, slot } = self.deal.next();
        self.channels[channel][slot]
    }
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
    use super::super::stripe::Segment;
    use super::*;
    use crate::interface::number::{Numbers, StreamFormat};
    use crate::interface::profile::{HALF, PROFILES, Variant};
    use proptest::prelude::*;

    #[test]
    fn the_sum_wraps() {
        assert_eq!(sum_of_words(&[]), 0);
        assert_eq!(sum_of_words(&[Beat([1, 2, 3, 4]), Beat([10, 20, 30, 40])]), 110);
        assert_eq!(sum_of_words(&[Beat([u32::MAX, 0, 0, 0]), Beat([0, 0, 0, 3])]), 2);
    }

    /// Numbers of a record in the order of its rows.
    fn numbers(pose: Pose, velocity: Velocity) -> Vec<u32> {
        let Velocity { linear, angular } = velocity;
        let rows = [&pose.position[..], &pose.orientation, &linear, &angular];
        rows.concat().into_iter().map(f32::to_bits).collect()
    }

    /// Those of the sixteen words of a record that are numbers.
    fn of_words<T: Copy>(words: &[T]) -> Vec<T> {
        [&words[0..3], &words[4..8], &words[8..11], &words[12..15]].concat()
    }

    proptest! {
        /// The beats are laid out as the record table and the stripe say, without `place`.
        #[test]
        fn every_f32_result_comes_back_bit_for_bit(
            words in prop::collection::vec(any::<[u32; 16]>(), 0..30),
            profile in prop::sample::select(PROFILES.to_vec()),
        ) {
            prop_assume!(profile.numbers.poses == StreamFormat::F32);
            let group = profile.stripes.results.streams;
            let mut segments = vec![Vec::new(); profile.s2mm_widths.len()];
            for (index, lanes) in words.iter().flat_map(|record| record.chunks(4)).enumerate() {
                let stream = usize::from(group[index % group.len()]);
                segments[stream].push(Beat([lanes[0], lanes[1], lanes[2], lanes[3]]));
            }
            let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
            let layout = Segment::Results.layout(&profile.default_variant());
            let mut results = Results::new(&layout, &views);
            for expected in &words {
                let (pose, velocity) = results.next();
                prop_assert_eq!(numbers(pose, velocity), of_words(expected));
            }
        }

        #[test]
        fn every_sixteen_bit_result_comes_back_as_its_number(
            words in prop::collection::vec(any::<[u16; 16]>(), 0..30),
            thesis in any::<bool>(),
        ) {
            // half: 0 0 1 1 2, two beats a record.
            let mut segments = vec![Vec::new(); 3];
            for (index, halves) in words.iter().flat_map(|record| record.chunks(8)).enumerate() {
                let lane = |at: usize| u32::from(halves[2 * at]) | u32::from(halves[2 * at + 1]) << 16;
                segments[index % 5 / 2].push(Beat([0, 1, 2, 3].map(lane)));
            }
            let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
            let poses = if thesis { StreamFormat::Thesis16 } else { StreamFormat::Binary16 };
            let numbers_of = Numbers { poses, ..HALF.numbers };
            let layout =
                Segment::Results.layout(&Variant { numbers: numbers_of, ..HALF.default_variant() });
            let mut results = Results::new(&layout, &views);
            for expected in &words {
                let (pose, velocity) = results.next();
                for (found, word) in numbers(pose, velocity).into_iter().zip(of_words(expected)) {
                    let found = f32::from_bits(found);
                    let (f, m) = (i32::from(word >> 10 & 31), f64::from(word & 1023) / 1024.0);
                    if f == 31 {
                        prop_assert!(!found.is_finite());
                        continue;
                    }
                    let magnitude = if thesis || f > 0 {
                        (1.0 + m) * 2.0_f64.powi(f - 15)
                    } else {
                        m * 2.0_f64.powi(-14)
                    };
                    let value = if word >> 15 == 0 { magnitude } else { -magnitude };
                    prop_assert_eq!(f64::from(found).to_bits(), value.to_bits());
                }
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
