//! Layout of an array: its records in beats, and its beats on streams.
//!
//! A row is a beat of 32-bit words, or half a beat of sixteen-bit words, in which case two records
//! may share a beat.

use super::striping::{PerStream, Striping};
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, LANES};

/// The four words of a row. Sixteen-bit ones are in the low bits.
pub(crate) type Row = [u32; LANES];

/// Records of one kind.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Records {
    pub(crate) format: StreamFormat,
    /// Rows of a record.
    pub(crate) rows: usize,
    pub(crate) count: usize,
    /// Records of one issue. Padding records fill the last issue up.
    pub(crate) together: usize,
}

/// An array of records on its streams.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Array {
    pub(crate) striping: Striping,
    pub(crate) rows: usize,
    pub(crate) rows_per_beat: usize,
    pub(crate) records: usize,
    /// Beats, with padding, altogether and on each stream.
    pub(crate) beats: usize,
    pub(crate) packets: PerStream,
}

impl Array {
    pub(crate) fn new(striping: Striping, records: Records) -> Self {
        let rows_per_beat = records.format.rows_per_beat();
        let rows = records.count.next_multiple_of(records.together) * records.rows;
        let beats = striping.padded(rows.div_ceil(rows_per_beat));
        Self {
            striping,
            rows: records.rows,
            rows_per_beat,
            records: records.count,
            beats,
            packets: striping.counts(beats),
        }
    }

    /// Beats that hold nothing but the first `records` records; for all records, with the padding.
    pub(crate) fn beats_of(&self, records: usize) -> usize {
        if records == self.records { self.beats } else { records * self.rows / self.rows_per_beat }
    }

    /// Records that lie within the first `beats` beats; the last one counts with the padding behind
    /// it.
    pub(crate) fn records_in(&self, beats: usize) -> usize {
        if beats >= self.beats {
            self.records
        } else {
            (beats * self.rows_per_beat / self.rows).min(self.records.saturating_sub(1))
        }
    }

    /// Calls `with` for each beat of a record that fills whole beats.
    #[inline]
    pub(crate) fn each_beat(&self, rows: &[Row], mut with: impl FnMut(Beat)) {
        if self.rows_per_beat == 1 {
            rows.iter().for_each(|row| with(Beat(*row)));
        } else {
            rows.chunks_exact(2).for_each(|pair| with(beat_of(pair[0], pair[1])));
        }
    }

    /// Clock cycles that the streams take for the first `records` records.
    pub(crate) fn cycles(&self, records: usize) -> u64 {
        self.striping.cycles(self.beats_of(records))
    }
}

/// Row `half` of a beat that holds two.
#[inline]
pub(crate) fn half_of(Beat(words): Beat, half: usize) -> Row {
    let [low, high] = [words[2 * half], words[2 * half + 1]];
    [low & 0xFFFF, low >> 16, high & 0xFFFF, high >> 16]
}

/// The beat of two rows of sixteen-bit words.
fn beat_of(first: Row, second: Row) -> Beat {
    let half = |[a, b, c, d]: Row| [a | (b << 16), c | (d << 16)];
    let ([a, b], [c, d]) = (half(first), half(second));
    Beat([a, b, c, d])
}
