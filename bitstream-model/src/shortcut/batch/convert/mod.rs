//! Converts collisions of `half` to the batch's own format: f32 on four streams. A portion fits into the
//! cache. Two records of three and a half beats share a beat: the sum of all their words, padding included, counts for the
//! first one.

use super::records::{BEATS, STREAMS};
use super::{Batch, Properties};
use crate::accelerator::records::array::{Row, half_of};
use crate::accelerator::records::decode;
use crate::accelerator::records::segment::PacketError;
use crate::accelerator::records::striping::STREAMS_MAX;
use crate::shortcut::deferred::eligible::Layout;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, LANES, WORD_LANE, collision};
use pgs_support::chunks::Chunks;
use pgs_support::lanes::{Instructions, Work};

/// Records that are translated at once.
const TOGETHER: usize = 4096;
/// Records that one thread translates at once.
const OF_THREAD: usize = 512;

/// Records that share a beat.
const PAIR: usize = 2;
const _: () = assert!(TOGETHER.is_multiple_of(PAIR) && OF_THREAD.is_multiple_of(PAIR));

/// Records that have been translated.
#[derive(Debug)]
pub(crate) struct Translation {
    layout: Layout,
    streams: [Box<[Beat]>; STREAMS],
    /// The sum of the words of each record as received.
    sums: Box<[u32]>,
}

impl Translation {
    pub(crate) fn new(layout: Layout) -> Self {
        Self {
            layout,
            streams: BEATS.map(|beats| vec![Beat::default(); TOGETHER * beats].into()),
            sums: vec![0; TOGETHER].into(),
        }
    }

    /// As [`Batch::decode`], for records in the design's own layout.
    pub(crate) fn decode(
        &mut self,
        batch: &mut Batch,
        streams: [&[Beat]; STREAMS_MAX],
        count: usize,
        properties: Properties<'_>,
        sums: &mut [u32],
    ) -> Result<(), PacketError> {
        for (part, sums) in (0..).zip(sums[..count].chunks_mut(TOGETHER)) {
            self.translate(batch, streams, part * TOGETHER, sums.len());
            let mut translated: [&[Beat]; STREAMS] = [&[]; STREAMS];
            for ((to, from), beats) in translated.iter_mut().zip(&self.streams).zip(BEATS) {
                *to = &from[..sums.len() * beats];
            }
            let decoded = batch.decode(translated, sums.len(), properties, sums);
            sums.copy_from_slice(&self.sums[..sums.len()]);
            decoded?;
        }
        Ok(())
    }

    /// Translates records from `first` on.
    fn translate(
        &mut self,
        batch: &mut Batch,
        streams: [&[Beat]; STREAMS_MAX],
        first: usize,
        count: usize,
    ) {
        let (layout, width) = (&self.layout, batch.width);
        let [a, b, c, d] = self.streams.each_mut().map(|stream| &mut stream[..]);
        let parts = a
            .chunks_mut(OF_THREAD * BEATS[0])
            .zip(b.chunks_mut(OF_THREAD * BEATS[1]))
            .zip(c.chunks_mut(OF_THREAD * BEATS[2]))
            .zip(d.chunks_mut(OF_THREAD * BEATS[3]))
            .zip(self.sums[..count].chunks_mut(OF_THREAD));
        let parts = (first..).step_by(OF_THREAD).zip(parts);
        batch.crew.each(parts, |(first, ((((a, b), c), d), sums))| {
            let part = Part { layout, streams, first, to: [a, b, c, d], sums };
            if let Err(part) = width.run(part) {
                part.translate();
            }
        });
    }
}

/// Records that one thread translates, one for each sum, and their destination.
struct Part<'a> {
    layout: &'a Layout,
    streams: [&'a [Beat]; STREAMS_MAX],
    /// The first record on the streams.
    first: usize,
    to: [&'a mut [Beat]; STREAMS],
    sums: &'a mut [u32],
}

impl Work for Part<'_> {
    type Output = ();

    /// The same code: the compiler vectorises it.
    #[inline(always)]
    fn run(self, _: impl Instructions) {
        self.translate();
    }
}

impl Part<'_> {
    /// Translates pairs of records with sixteen-bit words.
    #[inline(always)]
    fn translate(self) {
        let format = self.layout.format;
        let Self { layout, streams, first, to: [a, b, c, d], sums } = self;
        let from: [_; collision::ROWS] = std::array::from_fn(|beat| {
            let (stream, number) = layout.places[beat];
            let share = layout.share[stream];
            (&streams[stream][first / PAIR * share + number..], share)
        });
        let [a, b, c] = [a, b, c].map(|beats| beats.split_arrays_mut::<2>().0.chunks_mut(PAIR));
        let to = a.zip(b).zip(c.zip(d.chunks_mut(PAIR)));
        for (issue, (sums, ((a, b), (c, d)))) in sums.chunks_mut(PAIR).zip(to).enumerate() {
            let beats = from.map(|(beats, share)| beats[issue * share]);
            let rows = rows_of_pair(format, &beats);
            sums.fill(0);
            sums[0] = beats.iter().flat_map(|beat| beat.0).fold(0, u32::wrapping_add);
            let records = rows.split_arrays::<{ collision::ROWS }>().0;
            let to = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
            for (rows, ((a, b), (c, d))) in records.iter().zip(to) {
                let [a0, b0, c0, d0, a1, b1, c1] = rows.map(Beat);
                (*a, *b, *c, *d) = ([a0, a1], [b0, b1], [c0, c1], d0);
            }
        }
    }
}

/// The rows of two records, which share their beats.
#[inline(always)]
fn rows_of_pair(
    format: StreamFormat,
    beats: &[Beat; collision::ROWS],
) -> [Row; PAIR * collision::ROWS] {
    // First all words as numbers, which the compiler vectorises; then the words that are none.
    let mut rows = [[0; LANES]; PAIR * collision::ROWS];
    for (rows, beat) in rows.split_arrays_mut::<2>().0.iter_mut().zip(beats) {
        let words: [u16; 2 * LANES] = bytemuck::cast(*beat);
        for (to, word) in rows.as_flattened_mut().iter_mut().zip(words) {
            *to = decode::number(format, u32::from(word)).to_bits();
        }
    }
    for record in 0..PAIR {
        for row in [collision::NORMAL, collision::BODY_A, collision::BODY_B] {
            let row = record * collision::ROWS + row;
            rows[row][WORD_LANE] = half_of(beats[row / 2], row % 2)[WORD_LANE];
        }
    }
    rows
}

#[cfg(test)]
mod tests;
