//! This file holds a block of records between the caller's values and the channels.

use bitstream_model::interface::record::Beat;

use super::deal::{BLOCK, Dealer};
use super::stripe::Layout;
use crate::record::sixteen::{Row, Sixteen};

/// A block of records on its way.
pub(super) struct Stage<const ROWS: usize> {
    wide: [[Beat; ROWS]; BLOCK],
    /// The same in sixteen bits: two rows a beat, without a gap between records.
    narrow: [[Beat; ROWS]; BLOCK / 2],
    format: Option<Sixteen>,
}

impl<const ROWS: usize> Stage<ROWS> {
    pub(super) fn new(layout: &Layout) -> Self {
        Self {
            wide: [[Beat::default(); ROWS]; BLOCK],
            narrow: [[Beat::default(); ROWS]; BLOCK / 2],
            format: Sixteen::of(layout.format),
        }
    }

    /// The records of the block, to write.
    #[inline(always)]
    pub(super) fn records(&mut self, count: usize) -> &mut [[Beat; ROWS]] {
        &mut self.wide[..count]
    }

    /// Sends the block to the channels, in the format of the stream.
    #[inline(always)]
    pub(super) fn deal(
        &mut self,
        count: usize,
        integers: &[bool; ROWS],
        dealer: &mut Dealer<'_, '_>,
    ) {
        let records = &self.wide[..count];
        let Some(format) = self.format else { return dealer.write(records.as_flattened()) };
        let rows: &mut [Row] = bytemuck::cast_slice_mut(self.narrow.as_flattened_mut());
        format.narrow(records, integers, &mut rows.as_chunks_mut().0[..count]);
        let used = count * ROWS;
        if !used.is_multiple_of(2) {
            // The last beat of the segment.
            rows[used] = Row::default();
        }
        dealer.write(&self.narrow.as_flattened()[..used.div_ceil(2)]);
    }
}

const _: () = assert!(BLOCK.is_multiple_of(2));
