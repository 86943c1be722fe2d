//! Applies the faults of a channel, and completes the effects that outlast a beat.

use super::channel::{Channel, Work};
use super::{Build, Surroundings};
use crate::fault::{Due, FaultKind, PacketPosition};
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::dmasr;
use pgs_interface::descriptor::status;
use pgs_interface::record::Beat;
use pgs_interface::register::Field;

/// The fate of the next beats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// This number of beats moves.
    Move(usize),
    /// One beat moves, with the bits of this mask inverted in its first word.
    Corrupt(u32),
    /// One beat moves, and the packet ends with it.
    Cut,
    /// No beat moves until a reset.
    Rest,
    /// The engine stops for now: the fault is one of the whole board.
    Board,
    /// The access fails with these bits of DMASR and of the descriptor's status.
    Fail(Field, Field),
}

impl Channel {
    fn packet_position(&self, build: &Build) -> PacketPosition {
        let begins = match self.work {
            Work::Descriptor(bd) => bd.moved == 0,
            Work::Direct { moved } => moved == 0,
            Work::None | Work::Fetch { .. } => true,
        };
        let (core, direction) = (build.core, self.direction);
        PacketPosition { core, direction, beats: self.beats, descriptors: self.descriptors, begins }
    }

    /// The fate of the next `n` beats.
    pub(super) fn next_beats(
        &mut self,
        build: &Build,
        n: usize,
        with: &mut Surroundings<'_>,
    ) -> Next {
        if with.faults.none() {
            return if self.faulty.stalled { Next::Rest } else { Next::Move(n) };
        }
        if self.faulty.stalled {
            return Next::Rest;
        }
        match with.faults.at_beats(&self.packet_position(build), n as u64) {
            Due::Nothing => Next::Move(n),
            Due::After(beats) => Next::Move(usize::try_from(beats).map_or(n, |beats| beats.min(n))),
            Due::Now(FaultKind::DmaIntErr) => Next::Fail(dmasr::DMA_INT_ERR, status::DMA_INT_ERR),
            Due::Now(FaultKind::DmaSlvErr) => Next::Fail(dmasr::DMA_SLV_ERR, status::DMA_SLV_ERR),
            Due::Now(FaultKind::DmaDecErr) => Next::Fail(dmasr::DMA_DEC_ERR, status::DMA_DEC_ERR),
            Due::Now(FaultKind::Stall) => {
                self.faulty.stalled = true;
                Next::Rest
            }
            Due::Now(FaultKind::Slow { clocks }) => {
                self.faulty.slow = clocks;
                Next::Move(1)
            }
            Due::Now(FaultKind::ShortPacket) => Next::Cut,
            Due::Now(FaultKind::Corrupt { mask }) => Next::Corrupt(mask),
            Due::Now(_) => Next::Board,
        }
    }

    /// The error bit with which the fetch of a descriptor fails, if it fails.
    pub(super) fn fetch_fault(
        &mut self,
        build: &Build,
        with: &mut Surroundings<'_>,
    ) -> Option<Field> {
        if with.faults.none() {
            return None;
        }
        match with.faults.at_fetch(&self.packet_position(build))? {
            FaultKind::SgSlvErr => Some(dmasr::SG_SLV_ERR),
            FaultKind::SgDecErr => Some(dmasr::SG_DEC_ERR),
            _ => Some(dmasr::SG_INT_ERR),
        }
    }

    /// The fault of the write of a descriptor's status, if one is due.
    pub(super) fn status_fault(
        &mut self,
        build: &Build,
        with: &mut Surroundings<'_>,
    ) -> Option<FaultKind> {
        if with.faults.none() {
            None
        } else {
            with.faults.at_completion(&self.packet_position(build))
        }
    }

    /// Whether the packet that ends here gets its TLAST.
    pub(super) fn ends_packet(&mut self, build: &Build, with: &mut Surroundings<'_>) -> bool {
        if with.faults.none() {
            return true;
        }
        match with.faults.at_packet_end(&self.packet_position(build)) {
            None => true,
            fault => {
                self.faulty.extra = fault == Some(FaultKind::LongPacket);
                false
            }
        }
    }

    /// Completes effects of faults that are due; returns whether anything changed.
    pub(super) fn settle(
        &mut self,
        build: &Build,
        now: u64,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> bool {
        let mut changed = false;
        while let Some(index) = self.faulty.late.iter().position(|(at, ..)| *at <= now) {
            let (_, address, word) = self.faulty.late.remove(index);
            self.put_status(build, address, word, with);
            changed = true;
        }
        if self.faulty.extra {
            match self.direction {
                Direction::Mm2s if stream.space() > 0 => {
                    self.faulty.extra = false;
                    stream.push(&[Beat::default()]);
                    stream.mark_last();
                    changed = true;
                }
                // The chain of descriptors, or LENGTH, has no room for the extra beat.
                Direction::S2mm if self.is_full() => {
                    self.faulty.extra = false;
                    self.fail(build, dmasr::DMA_INT_ERR.mask());
                    changed = true;
                }
                _ => {}
            }
        }
        while self.faulty.discards && stream.len() > 0 {
            self.faulty.discards = stream.next_last() != Some(0);
            stream.take_sum(1);
            changed = true;
        }
        changed
    }

    /// Whether the packet has used up the room of its buffers.
    fn is_full(&self) -> bool {
        match self.work {
            Work::None => true,
            Work::Direct { moved } => moved == self.length,
            Work::Fetch { .. } | Work::Descriptor(_) => false,
        }
    }
}
