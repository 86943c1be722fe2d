//! This file reads the results out of the channels' beats.
//!
//! The memory may be slow to read, so each beat is read once: a block of records is collected from
//! the channels, one after the other, and the sum of what was read is taken on the way.

use bitstream_model::interface::record::{Beat, LANES, WORD_LANE, result};

pub(crate) use super::deal::BLOCK;
use super::stripe::{Deal, Layout, Place};
use crate::platform::Lanes;
use crate::record::largest::{Largest, MAGNITUDE};
use crate::record::sixteen::{self, Sixteen};

/// A record of results, in f32.
pub(crate) type Record = [Beat; result::ROWS];

/// Reads results, a block at a time, from the result segments, one a channel.
///
/// A number that the accelerator could not hold is not finite.
pub(crate) struct Reader<'a> {
    collector: Collector<'a>,
    format: Option<Sixteen>,
    narrow: [[Beat; result::ROWS]; BLOCK / 2],
}

impl<'a> Reader<'a> {
    /// From the first record on.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(crate) fn new(layout: &Layout, channels: &'a [&'a [Beat]]) -> Self {
        Self {
            collector: Collector::new(layout, channels),
            format: Sixteen::of(layout.format),
            narrow: [[Beat::default(); result::ROWS]; BLOCK / 2],
        }
    }

    /// Reads the next records, at most [`BLOCK`]; only the last may be fewer. Whether all their numbers
    /// are finite.
    #[inline(always)]
    pub(crate) fn read(&mut self, records: &mut [Record]) -> bool {
        let Some(format) = self.format else {
            self.collector.read(records.as_flattened_mut());
            return finite(records);
        };
        // Two beats a record: an even number of rows.
        let beats = &mut self.narrow.as_flattened_mut()[..records.len() * (result::ROWS / 2)];
        self.collector.read(beats);
        format.widen(bytemuck::cast_slice(beats), records.as_flattened_mut());
        const EXPONENTS: [Beat; result::ROWS / 2] = sixteen::exponents(&NUMBERS);
        sixteen::finite(&EXPONENTS, beats)
    }

    /// The sum of all 32-bit words of the segments, modulo 2^32: what the accelerator counts of what
    /// it sent.
    pub(crate) fn finish(self) -> u32 {
        self.collector.finish()
    }
}

/// Lanes of a record that are numbers: what lies beside a vec3 is nobody's.
const NUMBERS: [[bool; LANES]; result::ROWS] = {
    let mut numbers = [[true; LANES]; result::ROWS];
    numbers[result::POSITION][WORD_LANE] = false;
    numbers[result::LINEAR][WORD_LANE] = false;
    numbers[result::ANGULAR][WORD_LANE] = false;
    numbers
};

/// Whether all numbers of these records are finite.
#[inline(always)]
pub(crate) fn finite(records: &[Record]) -> bool {
    const LARGEST: Largest<{ result::ROWS }> = {
        let mut beside = [f32::MAX.to_bits(); result::ROWS];
        let mut row = 0;
        while row < result::ROWS {
            if !NUMBERS[row][WORD_LANE] {
                beside[row] = MAGNITUDE;
            }
            row += 1;
        }
        Largest::new(f32::MAX, beside)
    };
    LARGEST.bound(records)
}

/// Reads beats in their order.
struct Collector<'a> {
    channels: &'a [&'a [Beat]],
    deal: Deal,
    sum: Lanes,
}

impl<'a> Collector<'a> {
    /// From the first beat on.
    fn new(layout: &Layout, channels: &'a [&'a [Beat]]) -> Self {
        Self { channels, deal: Deal::new(layout.stripe), sum: Lanes::all(0) }
    }

    /// Reads the next beats.
    #[inline(always)]
    fn read(&mut self, beats: &mut [Beat]) {
        let rest = match self.deal.group().len() {
            _ if !self.deal.at_end_of_group() => beats,
            1 => self.groups::<1>(beats),
            2 => self.groups::<2>(beats),
            3 => self.groups::<3>(beats),
            4 => self.groups::<4>(beats),
            5 => self.groups::<5>(beats),
            _ => beats,
        };
        for beat in rest {
            let Place { channel, slot } = self.deal.next();
            *beat = self.channels[channel][slot];
            self.sum = self.sum.plus(Lanes::from(*beat));
        }
    }

    /// Reads whole groups of `G` beats; what is left to read.
    #[inline(always)]
    fn groups<'c, const G: usize>(&mut self, beats: &'c mut [Beat]) -> &'c mut [Beat] {
        let (groups, rest) = beats.as_chunks_mut::<G>();
        if self.deal.one_a_channel() && self.channels.len() == G {
            let from = std::array::from_fn(|channel| {
                &self.channels[channel][self.deal.take(channel, groups.len())]
            });
            one_each(from, groups, &mut self.sum);
            return rest;
        }
        for (channel, from) in self.channels.iter().enumerate() {
            let (places, share) = self.deal.places::<G>(channel);
            let from = &from[self.deal.take(channel, groups.len() * share)];
            let sum = &mut self.sum;
            match share {
                0 => {}
                1 => run::<G, 1>(from, places, groups, sum),
                2 => run::<G, 2>(from, places, groups, sum),
                _ => {
                    for (from, group) in from.chunks_exact(share).zip(groups.iter_mut()) {
                        for (from, place) in from.iter().zip(places) {
                            group[place] = *from;
                            *sum = sum.plus(Lanes::from(*from));
                        }
                    }
                }
            }
        }
        rest
    }

    /// The sum of all words, of those that fill the last group too.
    fn finish(mut self) -> u32 {
        for (channel, beats) in self.channels.iter().enumerate() {
            let used = self.deal.take(channel, 0).start;
            self.sum =
                beats[used..].iter().fold(self.sum, |sum, beat| sum.plus(Lanes::from(*beat)));
        }
        total(self.sum)
    }
}

/// Reads groups of which each channel has one beat, in the order of the channels.
#[inline(always)]
fn one_each<const G: usize>(from: [&[Beat]; G], groups: &mut [[Beat; G]], sum: &mut Lanes) {
    // Said once here, so that it is not asked of every beat.
    let from = from.map(|beats| &beats[..groups.len()]);
    let mut total = *sum;
    for (at, group) in groups.iter_mut().enumerate() {
        for (beat, from) in group.iter_mut().zip(from) {
            *beat = from[at];
            total = total.plus(Lanes::from(from[at]));
        }
    }
    *sum = total;
}

/// Reads the `S` beats of each group that one channel has, and adds them up.
#[inline(always)]
fn run<const G: usize, const S: usize>(
    from: &[Beat],
    places: [usize; G],
    groups: &mut [[Beat; G]],
    sum: &mut Lanes,
) {
    // Said once here, so that it is not asked of every beat.
    let places: [usize; S] = std::array::from_fn(|at| places[at % G].min(G - 1));
    let mut total = *sum;
    for (group, from) in groups.iter_mut().zip(from.as_chunks::<S>().0) {
        for (beat, place) in from.iter().zip(places) {
            group[place] = *beat;
            total = total.plus(Lanes::from(*beat));
        }
    }
    *sum = total;
}

/// Sum of all 32-bit words, modulo 2^32.
pub(crate) fn sum_of_words(beats: &[Beat]) -> u32 {
    total(beats.iter().fold(Lanes::all(0), |sum, beat| sum.plus(Lanes::from(*beat))))
}

/// The lanes' sums in one.
pub(super) fn total(sum: Lanes) -> u32 {
    sum.words().into_iter().fold(0, u32::wrapping_add)
}

#[cfg(test)]
mod tests {
    use super::super::stripe::Segment;
    use super::*;
    use crate::interface::number::{Numbers, StreamFormat};
    use crate::interface::profile::{HALF, PROFILES, Variant};
    use crate::record::result::decode;
    use crate::scene::{Pose, Velocity};
    use proptest::prelude::*;

    /// Everything that is read, and the sum.
    fn read(layout: &Layout, channels: &[&[Beat]], count: usize) -> (Vec<(Pose, Velocity)>, u32) {
        let mut reader = Reader::new(layout, channels);
        let mut records = vec![Record::default(); count];
        records.chunks_mut(BLOCK).for_each(|block| {
            let good = reader.read(block);
            assert_eq!(good, finite(block));
        });
        (records.iter().map(decode).collect(), reader.finish())
    }

    /// Word by word, in 64 bits.
    fn sum_of(segments: &[Vec<Beat>]) -> u32 {
        let words = segments.iter().flatten().flat_map(|beat| beat.0);
        let sum: u64 = words.map(u64::from).sum();
        u32::try_from(sum & 0xFFFF_FFFF).expect("32 bits")
    }

    #[test]
    fn the_sum_wraps_and_holds_the_padding() {
        let layout = Segment::Results.layout(&HALF.default_variant());
        // A body fills two beats of five.
        let segments = [
            vec![Beat([1, 2, 3, 4]), Beat([10, 20, 30, 40])],
            vec![Beat([u32::MAX, 0, 0, 0]), Beat([0, 0, 0, 3])],
            vec![Beat([100; 4])],
        ];
        let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
        assert_eq!(read(&layout, &views, 1).1, 110 + 2 + 400);
        assert_eq!(read(&layout, &[&[], &[], &[]], 0).1, 0);
    }

    #[test]
    fn what_is_not_finite_is_found_wherever_it_is_and_nothing_else_is() {
        let largest = f32::MAX.to_bits();
        let records = [[Beat([largest; 4]); 4]; 3];
        assert!(finite(&records) && finite(&[]));
        for value in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            for at in 0..16 {
                let mut records = records;
                records[1][at / 4].0[at % 4] = value.to_bits();
                let beside = [3, 11, 15].contains(&at);
                assert_eq!(finite(&records), beside, "{value} {at}");
            }
        }
    }

    /// So many others stand beside the one that all of a block but it are finite.
    #[test]
    fn what_is_not_finite_in_sixteen_bits_is_found_wherever_it_is_and_nothing_else_is() {
        for poses in [StreamFormat::Binary16, StreamFormat::Thesis16] {
            let numbers = Numbers { poses, ..HALF.numbers };
            let layout = Segment::Results.layout(&Variant { numbers, ..HALF.default_variant() });
            let good = |at: usize, word: u16| {
                let largest = 0x7BFF_7BFF;
                // Three records fill six beats of ten: 0 0 1 1 2, 0.
                let mut beats = [Beat([largest; 4]); 6];
                let half = &mut bytemuck::cast_slice_mut::<_, u16>(&mut beats)[16 + at];
                *half = word;
                let [a, b, c, d, e, f] = beats;
                let channels = [[a, b, f], [c, d, Beat::default()], [e; 3]];
                let views = [&channels[0][..], &channels[1][..2], &channels[2][..1]];
                let mut records = [Record::default(); 3];
                Reader::new(&layout, &views).read(&mut records)
            };
            assert!(good(0, 0x7BFF) && good(0, 0xFBFF));
            for word in [0x7C00, 0xFC00, 0x7C01, 0x7FFF, 0xFFFF] {
                for at in 0..16 {
                    let beside = [3, 11, 15].contains(&at);
                    assert_eq!(good(at, word), beside, "{poses:?} {word:#x} {at}");
                }
            }
        }
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
            words in prop::collection::vec(any::<[u32; 16]>(), 0..100),
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
            let (states, sum) = read(&layout, &views, words.len());
            prop_assert_eq!(sum, sum_of(&segments));
            for (expected, (pose, velocity)) in words.iter().zip(states) {
                prop_assert_eq!(numbers(pose, velocity), of_words(expected));
            }
        }

        #[test]
        fn every_sixteen_bit_result_comes_back_as_its_number(
            words in prop::collection::vec(any::<[u16; 16]>(), 0..100),
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
            let (states, sum) = read(&layout, &views, words.len());
            prop_assert_eq!(sum, sum_of(&segments));
            for (expected, (pose, velocity)) in words.iter().zip(states) {
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
            prop_assert_eq!(sum_of_words(&beats), sum_of(&[beats]));
        }
    }
}
