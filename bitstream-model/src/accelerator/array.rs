//! This file says how the records of an array lie in beats, and the beats on streams.
//!
//! A row is a beat of 32-bit words, or half a beat of sixteen-bit words, in which case two records
//! may share a beat.

use super::striping::Striping;
use crate::interface::number::StreamFormat;
use crate::interface::record::{Beat, LANES};

/// The four words of a row. Sixteen-bit ones are in the low bits.
pub(super) type Row = [u32; LANES];

/// Records of one kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Records {
    pub(super) format: StreamFormat,
    /// Rows of a record.
    pub(super) rows: usize,
    pub(super) count: usize,
    /// Records come in as many together; padding records fill the last ones up.
    pub(super) together: usize,
}

/// An array of records on its streams.
#[derive(Debug, Clone, Copy)]
pub(super) struct Array {
    pub(super) striping: Striping,
    pub(super) rows: usize,
    pub(super) rows_per_beat: usize,
    pub(super) records: usize,
    /// Beats, with padding.
    pub(super) beats: usize,
}

impl Array {
    pub(super) fn new(striping: Striping, records: Records) -> Self {
        let rows_per_beat = (u32::BITS / records.format.bits()) as usize;
        let rows = records.count.next_multiple_of(records.together) * records.rows;
        Self {
            striping,
            rows: records.rows,
            rows_per_beat,
            records: records.count,
            beats: striping.padded(rows.div_ceil(rows_per_beat)),
        }
    }

    /// Beats that belong to the first `records` records alone; after the last one, the padding too.
    pub(super) fn beats_of(&self, records: usize) -> usize {
        if records == self.records { self.beats } else { records * self.rows / self.rows_per_beat }
    }

    /// Records that lie within the first `beats` beats, the last one with the padding behind it.
    pub(super) fn records_in(&self, beats: usize) -> usize {
        if beats >= self.beats {
            self.records
        } else {
            (beats * self.rows_per_beat / self.rows).min(self.records.saturating_sub(1))
        }
    }

    /// Beats of the whole array on a stream.
    pub(super) fn packet(&self, stream: usize) -> usize {
        self.striping.on(stream, self.beats)
    }

    /// Clock cycles that the streams take for the first `records` records.
    pub(super) fn cycles(&self, records: usize) -> u64 {
        self.striping.cycles(self.beats_of(records))
    }
}

/// Row `half` of a beat that holds two.
#[inline]
pub(super) fn half_of(Beat(words): Beat, half: usize) -> Row {
    let [low, high] = [words[2 * half], words[2 * half + 1]];
    [low & 0xFFFF, low >> 16, high & 0xFFFF, high >> 16]
}

/// The beat of two rows of sixteen-bit words.
pub(super) fn beat_of(first: Row, second: Row) -> Beat {
    let half = |[a, b, c, d]: Row| [a | (b << 16), c | (d << 16)];
    let ([a, b], [c, d]) = (half(first), half(second));
    Beat([a, b, c, d])
}
