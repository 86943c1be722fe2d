//! Sends the results: rows into beats, beats onto streams, padding, TLAST.

use super::array::{Array, Row};
use super::striping::{PerStream, STREAMS_MAX};
use crate::stream::Stream;
use pgs_interface::record::{Beat, result};

/// A result fills whole beats, even with two rows in a beat.
const _: () = assert!(result::ROWS.is_multiple_of(2));

/// The results while they are being sent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Results {
    array: Array,
    /// Records sent so far.
    done: usize,
    /// Beats sent so far, altogether and on each stream.
    beats: usize,
    sent: PerStream,
}

impl Results {
    pub(crate) fn new(array: Array) -> Self {
        Self { array, done: 0, beats: 0, sent: [0; STREAMS_MAX] }
    }

    /// How they lie.
    pub(crate) fn array(&self) -> &Array {
        &self.array
    }

    /// Clock cycles that the streams take for the records sent so far.
    pub(crate) fn cycles(&self) -> u64 {
        self.array.cycles(self.done)
    }

    /// Records that the streams have space for; the last one counts with the padding behind it.
    pub(crate) fn room(&self, streams: &[Stream]) -> usize {
        let room = self.array.striping.contiguous(|k| self.sent[k] + streams[k].space());
        self.array.records_in(room) - self.done
    }

    /// Sends a record, for which there must be room; returns the sum of its words.
    pub(crate) fn send(&mut self, rows: &[Row], streams: &mut [Stream]) -> u32 {
        let (mut sum, array) = (0_u32, self.array);
        array.each_beat(rows, |beat| sum = sum.wrapping_add(self.push(beat, streams)));
        self.done += 1;
        while self.done == self.array.records && self.beats < self.array.beats {
            self.push(Beat::default(), streams);
        }
        sum
    }

    fn push(&mut self, beat: Beat, streams: &mut [Stream]) -> u32 {
        let (k, number) = self.array.striping.places(self.beats).take();
        streams[k].push(&[beat]);
        if number + 1 == self.array.packets[k] {
            streams[k].mark_last();
        }
        self.beats += 1;
        self.sent[k] = number + 1;
        beat.0.into_iter().fold(0, u32::wrapping_add)
    }
}

#[cfg(test)]
mod tests {
    use super::super::array::Records;
    use super::super::striping::Striping;
    use super::*;
    use pgs_interface::profile::HALF;

    /// Three results of `half`: six beats on three streams, padded to ten.
    #[test]
    fn sixteen_bit_results_go_out_two_rows_a_beat_and_end_with_padding() {
        let striping = Striping::new(&HALF.stripes.results, HALF.s2mm_widths);
        let format = HALF.numbers.poses;
        let records = Records { format, rows: result::ROWS, count: 3, together: 1 };
        let mut results = Results::new(Array::new(striping, records));
        let mut narrow: Vec<Stream> = [8, 8, 1].map(Stream::new).into();
        assert_eq!(results.room(&narrow), 2, "the third has its padding on stream 2");
        narrow[2] = Stream::new(2);
        assert_eq!(results.room(&narrow), 3);

        let mut streams = narrow;
        let mut number = 0;
        for _ in 0..3 {
            let rows: [Row; result::ROWS] = std::array::from_fn(|_| {
                number += 1;
                [number; 4]
            });
            results.send(&rows, &mut streams);
        }
        // Words 1 to 12, each four times in half a beat.
        let beat = |first: u32| Beat([first, first, first + 1, first + 1].map(|n| n * 0x1_0001));
        let found: Vec<Vec<Beat>> = streams
            .iter()
            .map(|stream| (0..stream.len()).map(|k| stream.peek(k)).collect())
            .collect();
        let zero = Beat::default();
        assert_eq!(
            found,
            [
                vec![beat(1), beat(3), beat(11), zero],
                vec![beat(5), beat(7), zero, zero],
                vec![beat(9), zero]
            ]
        );
        assert!(streams.iter().all(|stream| stream.next_last() == Some(stream.len() - 1)));
        assert_eq!(results.cycles(), 4, "two beats of two cycles on the narrow stream");
    }
}
