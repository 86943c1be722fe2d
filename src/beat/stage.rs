//! This file holds a block of records between the caller's values and the channels.

use bitstream_model::interface::record::Beat;

use super::deal::Dealer;
use super::stripe::Layout;
use crate::platform::{Lanes, Vectors};
use crate::record::sixteen::{Row, Sixteen};

/// A block of at most `BLOCK` records on its way, in the format of its stream.
pub(super) struct Stage<const ROWS: usize, const BLOCK: usize> {
    /// Those in sixteen bits, two rows a beat, fill the first half, without a gap between records.
    beats: [[Beat; ROWS]; BLOCK],
    format: Option<Sixteen>,
}

/// The records of a block, in f32.
///
/// `get` is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(super) trait Records<const ROWS: usize> {
    /// Rows whose word is an unsigned integer.
    const INTEGERS: [bool; ROWS];

    /// How many there are.
    fn len(&self) -> usize;

    /// One of them, if there is one. Each is asked for once, in their order.
    fn get(&mut self, at: usize) -> Option<[Lanes; ROWS]>;
}

impl<const ROWS: usize, const BLOCK: usize> Stage<ROWS, BLOCK> {
    const EVEN: () =
        assert!(BLOCK.is_multiple_of(2), "only the last beat of a segment is half full");

    pub(super) fn new(layout: &Layout) -> Self {
        const { Self::EVEN };
        Self { beats: [[Beat::default(); ROWS]; BLOCK], format: Sixteen::of(layout.format) }
    }

    /// Takes the records of a block, at most `BLOCK`, and sends them to the channels.
    #[inline(always)]
    pub(super) fn send<V: Vectors, R: Records<ROWS>>(
        &mut self,
        vectors: V,
        records: &mut R,
        dealer: &mut Dealer<'_, '_>,
    ) {
        let count = records.len().min(BLOCK);
        debug_assert!(records.len() <= BLOCK, "no more than a block");
        let beats = match self.format {
            None => {
                for (at, to) in self.beats[..count].iter_mut().enumerate() {
                    let Some(record) = records.get(at) else { break };
                    for (to, row) in to.iter_mut().zip(record) {
                        *to = row.into();
                    }
                }
                count * ROWS
            }
            // One loop each, in which nothing is asked of the format.
            Some(Sixteen::Binary16) => self.narrow(vectors, records, count, Sixteen::Binary16),
            Some(Sixteen::Thesis16) => self.narrow(vectors, records, count, Sixteen::Thesis16),
        };
        dealer.write(&self.beats.as_flattened()[..beats]);
    }

    /// Takes the records of a block; how many beats they are.
    #[inline(always)]
    fn narrow<V: Vectors, R: Records<ROWS>>(
        &mut self,
        vectors: V,
        records: &mut R,
        count: usize,
        format: Sixteen,
    ) -> usize {
        let rows: &mut [Row] = bytemuck::cast_slice_mut(self.beats.as_flattened_mut());
        for (at, to) in rows.as_chunks_mut::<ROWS>().0[..count].iter_mut().enumerate() {
            let Some(record) = records.get(at) else { break };
            *to = format.narrow(vectors, record, &R::INTEGERS);
        }
        let count = count * ROWS;
        if !count.is_multiple_of(2) {
            // The last beat of the segment.
            rows[count] = Row::default();
        }
        count.div_ceil(2)
    }
}
