//! Reads the results out of the channels' beats.
//!
//! The memory may be slow to read, so each beat is read once, and the sum and the check for finite
//! numbers are made on the way.

use pgs_interface::record::{Beat, result};

use super::deal::{Joiner, sum_of_words};
use super::format::rows_of;
use super::pool::{ChannelChunks, PackPool, PieceRead, whole_read};
use super::stripe::{BLOCK, Layout};
use crate::record::result::{Record, all_finite};

/// Reads the results of all records from the result segments, one a channel, on several threads if
/// the records are many; the sum of all 32-bit words of the segments, modulo 2^32, padding
/// included, which the accelerator computes of the words that it sends; and whether all numbers are
/// finite. A number that the accelerator could not hold is not finite.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
pub(crate) fn read_all(
    layout: &Layout,
    channels: &[&[Beat]],
    records: &mut [Record],
    packers: &mut PackPool,
) -> (u32, bool) {
    let (mut sum, mut good) = (0_u32, true);
    let count = records.len();
    let cut = |size| {
        let (mut pieces, all) = (ChannelChunks::new(layout, size, whole_read(channels)), records);
        all.chunks_mut(size).map(move |records| (records, pieces.cut()))
    };
    let work = |(records, piece): (&mut [Record], PieceRead<'_>)| read(layout, piece, records);
    packers.each(count, cut, work, |(of_range, finite)| {
        sum = sum.wrapping_add(of_range);
        good &= finite;
    });
    (sum, good)
}

/// Reads a range of results, otherwise as [`read_all`].
fn read(layout: &Layout, channels: PieceRead<'_>, records: &mut [Record]) -> (u32, bool) {
    let (mut sum, mut good) = (0_u32, true);
    let mut joiner = Joiner::new(layout.stripe, channels);
    let mut buffer = [Beat::default(); BLOCK * result::ROWS];
    for block in records.chunks_mut(BLOCK) {
        let beats = &mut buffer[..layout.beats(block.len())];
        joiner.read(beats);
        sum = sum.wrapping_add(sum_of_words(beats));
        rows_of(layout.format, beats, block.as_flattened_mut());
        good &= all_finite(block);
    }
    (sum, good)
}

#[cfg(test)]
mod tests {
    use pgs_interface::address_map::DMA_COUNT_MAX;
    use pgs_interface::record::LANES;
    use pgs_interface::stripe::Stripe;

    use super::*;
    use crate::beat::stripe::{Place, Segment};
    use crate::record::result::decode;
    use crate::record::result::finite;
    use crate::scene::{Pose, Velocity};
    use pgs_interface::number::StreamFormat;
    use pgs_interface::profile::{HALF, PROFILES};
    use proptest::prelude::*;

    /// Everything that a reader reads, and the sum.
    fn read(layout: &Layout, channels: &[&[Beat]], count: usize) -> (Vec<(Pose, Velocity)>, u32) {
        let mut records = vec![Record::default(); count];
        let (sum, good) = read_all(layout, channels, &mut records, &mut PackPool::alone());
        assert_eq!(good, records.iter().all(finite));
        (records.iter().map(decode).collect(), sum)
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

    /// Covers numbers within units and, where a profile has such a rest, after the last unit.
    #[test]
    fn what_is_not_finite_is_found_wherever_it_is_and_nothing_else_is() {
        const COUNT: usize = 7;
        for profile in PROFILES.iter().filter(|profile| profile.numbers.poses == StreamFormat::F32)
        {
            let layout = Segment::Results.layout(&profile.default_variant());
            let good = |at: usize, value: f32| {
                let mut segments = vec![Vec::new(); profile.s2mm_widths.len()];
                for beat in 0..layout.beats(COUNT) {
                    let numbers = [f32::MAX, f32::MIN, -0.0, f32::from_bits(1)];
                    let mut beats = [Beat(numbers.map(f32::to_bits))];
                    if beat == at / LANES {
                        beats[0].0[at % LANES] = value.to_bits();
                    }
                    segments[layout.place(beat).channel].extend(beats);
                }
                let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
                let records = &mut [Record::default(); COUNT];
                read_all(&layout, &views, records, &mut PackPool::alone()).1
            };
            for at in 0..COUNT * result::ROWS * LANES {
                let beside = [3, 11, 15].contains(&(at % 16));
                for value in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN] {
                    assert_eq!(good(at, value), beside, "{} {value} {at}", profile.name);
                }
                assert!(good(at, f32::MIN));
            }
        }
    }

    /// All other numbers are the largest finite one.
    #[test]
    fn what_is_not_finite_in_sixteen_bits_is_found_wherever_it_is_and_nothing_else_is() {
        let layout = Segment::Results.layout(&HALF.default_variant());
        let good = |at: usize, word: u16| {
            let largest = 0x7BFF_7BFF;
            // Three records fill six beats of ten: 0 0 1 1 2, 0.
            let mut beats = [Beat([largest; 4]); 6];
            let half = &mut bytemuck::cast_slice_mut::<_, u16>(&mut beats)[16 + at];
            *half = word;
            let [a, b, c, d, e, f] = beats;
            let none = Beat::default();
            let channels = [[a, b, f, none], [c, d, none, none], [e, none, none, none]];
            let views = [&channels[0][..], &channels[1][..], &channels[2][..2]];
            let mut records = [Record::default(); 3];
            read_all(&layout, &views, &mut records, &mut PackPool::alone()).1
        };
        assert!(good(0, 0x7BFF) && good(0, 0xFBFF));
        for word in [0x7C00, 0xFC00, 0x7C01, 0x7FFF, 0xFFFF] {
            for at in 0..16 {
                let beside = [3, 11, 15].contains(&at);
                assert_eq!(good(at, word), beside, "{word:#x} {at}");
            }
        }
    }

    /// Numbers of a record in the order of its rows.
    fn numbers(pose: Pose, velocity: Velocity) -> Vec<u32> {
        let Velocity { linear, angular } = velocity;
        let rows = [&pose.position[..], &pose.orientation, &linear, &angular];
        rows.concat().into_iter().map(f32::to_bits).collect()
    }

    /// The number of a word, as the bits of an f32.
    fn number(word: u16) -> u32 {
        let (sign, f, m) = (u32::from(word >> 15) << 31, word >> 10 & 31, word & 1023);
        let (exponent, fraction) = (i32::from(f) - 15, f32::from(m) / 1024.0);
        let magnitude = match (f, m) {
            // A NaN keeps its bits and is quiet.
            (31, 1..) => return sign | 0x7FC0_0000 | u32::from(m) << 13,
            (31, _) => f32::INFINITY,
            (0, _) => fraction * 2.0_f32.powi(-14),
            _ => (1.0 + fraction) * 2.0_f32.powi(exponent),
        };
        sign | magnitude.to_bits()
    }

    /// The words of a record that are numbers, out of its sixteen words.
    fn of_words<T: Copy>(words: &[T]) -> Vec<T> {
        [&words[0..3], &words[4..8], &words[8..11], &words[12..15]].concat()
    }

    /// Lays out records of 16-bit words as `half` does, and compares the numbers read from them.
    fn read_sixteen_bit_results(words: &[[u16; 16]]) {
        // half: 0 0 1 1 2, two beats a record.
        let mut segments = vec![Vec::new(); 3];
        for (index, halves) in words.iter().flat_map(|record| record.chunks(8)).enumerate() {
            let lane = |at: usize| u32::from(halves[2 * at]) | u32::from(halves[2 * at + 1]) << 16;
            segments[index % 5 / 2].push(Beat([0, 1, 2, 3].map(lane)));
        }
        let layout = Segment::Results.layout(&HALF.default_variant());
        for (channel, segment) in segments.iter_mut().enumerate() {
            segment.resize(layout.beats_on_channel(words.len(), channel), Beat::default());
        }
        let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
        let (states, sum) = read(&layout, &views, words.len());
        assert_eq!(sum, sum_of(&segments));
        for (expected, (pose, velocity)) in words.iter().zip(states) {
            let expected: Vec<u32> = of_words(expected).into_iter().map(number).collect();
            assert_eq!(numbers(pose, velocity), expected);
        }
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
        ) {
            read_sixteen_bit_results(&words);
        }

        /// Covers the stripes of the profiles and others, in every format.
        #[test]
        fn every_result_is_read_where_the_definition_says(
            words in prop::collection::vec(any::<[u32; 16]>(), 0..200),
            streams in prop::sample::select(
                PROFILES.iter().map(|profile| profile.stripes.results.streams)
                    .chain([&[1, 0][..], &[0, 1, 1], &[3, 2, 1, 0, 0, 1], &[2], &[1, 2, 3]])
                    .collect::<Vec<_>>(),
            ),
            padded in any::<bool>(),
            format in prop::sample::select(StreamFormat::ALL.to_vec()),
        ) {
            let layout = Layout { rows: result::ROWS, format, stripe: Stripe { streams, padded } };
            let count = words.len();
            let mut segments: Vec<Vec<Beat>> = (0..DMA_COUNT_MAX)
                .map(|channel| vec![Beat::default(); layout.beats_on_channel(count, channel)])
                .collect();
            let rows = words.iter().flat_map(|record| record.as_chunks().0);
            let mut beats = rows.map(|row| Beat(*row));
            for at in 0..layout.beats(count) {
                let Place { channel, slot } = layout.place(at);
                // Padding may hold any words.
                segments[channel][slot] = beats.next().unwrap_or(Beat([3; LANES]));
            }
            let expected: Vec<Record> = (0..count)
                .map(|record| std::array::from_fn(|row| {
                    let row = record * result::ROWS + row;
                    let Place { channel, slot } = layout.place(row / layout.rows_per_beat());
                    let beat = segments[channel][slot];
                    if format == StreamFormat::F32 {
                        return beat;
                    }
                    let halves: [u16; 8] = bytemuck::cast(beat);
                    let halves = halves.as_chunks::<LANES>().0[row % 2];
                    Beat(halves.map(number))
                }))
                .collect();

            let views: Vec<&[Beat]> = segments.iter().map(Vec::as_slice).collect();
            let mut found = vec![Record::default(); count];
            let (sum, good) = read_all(&layout, &views, &mut found, &mut PackPool::alone());
            prop_assert_eq!(good, found.iter().all(finite));
            prop_assert_eq!(found, expected);
            prop_assert_eq!(sum, sum_of(&segments));
        }

        #[test]
        fn the_sum_is_that_of_the_words_one_by_one(
            beats in prop::collection::vec(any::<[u32; 4]>().prop_map(Beat), 0..40),
        ) {
            prop_assert_eq!(sum_of_words(&beats), sum_of(&[beats]));
        }
    }
}
