//! This file holds a block of records between the caller's values and the channels.

use bitstream_model::interface::record::Beat;

use super::deal::{BLOCK, Dealer};
use super::stripe::Layout;
use crate::platform::{Lanes, Vectors};
use crate::record::sixteen::{Row, Sixteen};

/// A block of records on its way, in the format of its stream.
pub(super) struct Stage<const ROWS: usize> {
    /// Those in sixteen bits, two rows a beat, fill the first half, without a gap between records.
    beats: [[Beat; ROWS]; BLOCK],
    format: Option<Sixteen>,
}

/// The records of a block, in f32.
///
/// `next` is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(super) trait Records<const ROWS: usize> {
    /// Rows whose word is an unsigned integer.
    const INTEGERS: [bool; ROWS];

    /// The next record, if there is one.
    fn next(&mut self) -> Option<[Lanes; ROWS]>;
}

impl<const ROWS: usize> Stage<ROWS> {
    pub(super) fn new(layout: &Layout) -> Self {
        Self { beats: [[Beat::default(); ROWS]; BLOCK], format: Sixteen::of(layout.format) }
    }

    /// Takes the records of a block, at most [`BLOCK`], and sends them to the channels.
    #[inline(always)]
    pub(super) fn send<V: Vectors, R: Records<ROWS>>(
        &mut self,
        vectors: V,
        records: &mut R,
        dealer: &mut Dealer<'_, '_>,
    ) {
        let beats = match self.format {
            None => {
                let mut count = 0;
                for to in &mut self.beats {
                    let Some(record) = records.next() else { break };
                    for (to, row) in to.iter_mut().zip(record) {
                        *to = row.into();
                    }
                    count += ROWS;
                }
                count
            }
            // One loop each, in which nothing is asked of the format.
            Some(Sixteen::Binary16) => self.narrow(vectors, records, Sixteen::Binary16),
            Some(Sixteen::Thesis16) => self.narrow(vectors, records, Sixteen::Thesis16),
        };
        debug_assert!(records.next().is_none(), "no more than a block");
        dealer.write(&self.beats.as_flattened()[..beats]);
    }

    /// Takes the records of a block; how many beats they are.
    #[inline(always)]
    fn narrow<V: Vectors, R: Records<ROWS>>(
        &mut self,
        vectors: V,
        records: &mut R,
        format: Sixteen,
    ) -> usize {
        let rows: &mut [Row] = bytemuck::cast_slice_mut(self.beats.as_flattened_mut());
        let mut count = 0;
        for to in &mut rows.as_chunks_mut::<ROWS>().0[..BLOCK] {
            let Some(record) = records.next() else { break };
            *to = format.narrow(vectors, record, &R::INTEGERS);
            count += ROWS;
        }
        if !count.is_multiple_of(2) {
            // The last beat of the segment.
            rows[count] = Row::default();
        }
        count.div_ceil(2)
    }
}

const _: () = assert!(BLOCK.is_multiple_of(2));
