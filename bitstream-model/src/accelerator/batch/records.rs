//! This file reads collision records where their beats are, and puts sixteen of them side by side.

use super::super::array::Row;
use super::block::{Block, Heads, LANES, Words};
use super::lanes::{Lanes, Quad, Work};
use crate::interface::record::{Beat, WORD_LANE, collision};

/// Beats of a record on each stream, which take turns.
const BEATS: [usize; STREAMS] = [2, 2, 2, 1];
const STREAMS: usize = 4;

const _: () = assert!(collision::ROWS == 7, "what the streams carry of each record");

/// Records that have arrived, on four streams.
#[derive(Debug, Clone, Copy)]
pub(super) struct Records<'a> {
    pub(super) streams: [&'a [Beat]; STREAMS],
}

impl Records<'_> {
    #[inline(always)]
    fn row(&self, record: usize, row: usize) -> Row {
        let stream = row % STREAMS;
        self.streams[stream][record * BEATS[stream] + row / STREAMS].0
    }

    /// All rows of a record.
    #[inline]
    pub(super) fn rows(&self, record: usize) -> [Row; collision::ROWS] {
        std::array::from_fn(|row| self.row(record, row))
    }

    /// The number of contacts and the two bodies of a record.
    #[inline(always)]
    pub(super) fn heads(&self, record: usize) -> [u32; 3] {
        [
            self.row(record, collision::NORMAL)[WORD_LANE],
            self.row(record, collision::BODY_A)[WORD_LANE],
            self.row(record, collision::BODY_B)[WORD_LANE],
        ]
    }
}

/// Puts sixteen records side by side.
pub(super) struct Fill<'a> {
    pub(super) records: &'a Records<'a>,
    pub(super) first: usize,
    pub(super) heads: &'a Heads,
    pub(super) block: &'a mut Block,
}

/// A row of records from one on, for the lanes from `at` on.
#[inline(always)]
fn columns<L: Lanes>(lanes: L, fill: &Fill<'_>, row: usize, at: usize) -> [L::Numbers; 4] {
    let stream = row % STREAMS;
    let first = (fill.first + at) * BEATS[stream] + row / STREAMS;
    let quads: &[Quad] = bytemuck::cast_slice(&fill.records.streams[stream][first..]);
    lanes.transposed(quads, BEATS[stream])
}

#[inline(always)]
fn store<L: Lanes>(lanes: L, columns: [L::Numbers; 4], words: &mut [Words], at: usize) {
    for (words, column) in words.iter_mut().zip(columns) {
        lanes.store(column, words, at);
    }
}

impl Work for Fill<'_> {
    #[inline(always)]
    fn with<L: Lanes>(self, lanes: L) {
        self.block.put_heads(self.heads);
        let mut at = 0;
        while at < LANES {
            let column = columns(lanes, &self, collision::NORMAL, at);
            store(lanes, column, &mut self.block.normal, at);
            let column = columns(lanes, &self, collision::BODY_A, at);
            store(lanes, column, &mut self.block.position_a, at);
            let column = columns(lanes, &self, collision::BODY_B, at);
            store(lanes, column, &mut self.block.position_b, at);
            for contact in 0..self.block.contacts.len() {
                let column = columns(lanes, &self, collision::CONTACTS + contact, at);
                store(lanes, column, &mut self.block.contacts[contact], at);
            }
            at += L::WIDTH;
        }
    }
}
