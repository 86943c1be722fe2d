//! Turns rows into the words of a stream, and the words of results into rows.

use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, LANES, WORD_LANE};

use super::stripe::Layout;
use crate::simd::{narrow, widen};

/// The beats of the first `records` of these rows, in the format of their stream; zeros fill the
/// last group. `integers` are the rows of a record whose last word is an unsigned integer. Of such
/// a word sixteen bits keep the lower half: validation refuses larger integers.
///
/// Shape: `rows` and `halves` have room for the beats that the layout has for the records.
#[inline]
pub(crate) fn beats_of<'b, const ROWS: usize>(
    layout: &Layout,
    (rows, records): (&'b mut [[Beat; ROWS]], usize),
    integers: &[usize],
    halves: &'b mut [Beat],
) -> &'b [Beat] {
    let beats = layout.beats(records);
    let rows = &mut rows.as_flattened_mut()[..beats * layout.rows_per_beat()];
    rows[records * ROWS..].fill(Beat::default());
    if layout.format == StreamFormat::F32 {
        return rows;
    }
    let to = &mut halves[..beats];
    narrow(rows, to);
    let words: &mut [u16] = bytemuck::cast_slice_mut(to);
    for (record, words) in rows.chunks_exact(ROWS).zip(words.chunks_exact_mut(ROWS * LANES)) {
        for row in integers {
            #[allow(clippy::cast_possible_truncation, reason = "the lower half")]
            let low = record[*row].0[WORD_LANE] as u16;
            words[row * LANES + WORD_LANE] = low;
        }
    }
    to
}

/// Writes the rows of beats to `rows`, up to its end.
#[inline]
pub(crate) fn rows_of(format: StreamFormat, beats: &[Beat], rows: &mut [Beat]) {
    match format {
        StreamFormat::F32 => rows.copy_from_slice(&beats[..rows.len()]),
        StreamFormat::Binary16 => widen(beats, rows),
    }
}
