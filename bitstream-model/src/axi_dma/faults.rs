//! Lets a channel's faults happen, and ends what they began.

use super::channel::{Channel, Work};
use super::{Build, Surroundings};
use crate::fault::{Due, FaultKind, Turn};
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::dmasr;
use pgs_interface::descriptor::status;
use pgs_interface::record::Beat;
use pgs_interface::register::Field;

/// What faults have done to a channel, until its packet ends or its core is reset.
#[derive(Debug, Clone, Default)]
pub(super) struct Faulty {
    /// It moves nothing.
    pub(super) stalled: bool,
    /// Clocks more for each beat.
    pub(super) slow: u32,
    /// MM2S: the packet has ended on the stream; the rest of it is dropped.
    pub(super) cut: bool,
    /// S2MM: the packet has ended in memory; the rest of it is dropped.
    pub(super) discards: bool,
    /// A beat with TLAST is still to follow the packet.
    pub(super) extra: bool,
    /// Statuses that are still on their way to memory: when each arrives, where, and what.
    pub(super) late: Vec<(u64, u64, u32)>,
}

impl Faulty {
    /// Whether nothing is wrong.
    pub(super) fn none(&self) -> bool {
        let Self { stalled, slow, cut, discards, extra, late } = self;
        !(*stalled || *cut || *discards || *extra) && *slow == 0 && late.is_empty()
    }

    /// Whether what a fault has begun comes before all else: a beat that is still to follow a packet
    /// before the next packet, and so the end of one that is dropped.
    pub(super) fn holds(&self, direction: Direction) -> bool {
        self.discards || self.extra && direction == Direction::Mm2s
    }
}

/// What becomes of the next beats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// So many may be moved.
    Move(usize),
    /// One, and the bits of this mask are inverted in its first word.
    Corrupt(u32),
    /// One, and the packet ends with it.
    Cut,
    /// The engine rests until it is reset.
    Rest,
    /// The engine stops for now: the board as a whole is concerned.
    Board,
    /// The access fails with these bits of DMASR and of the descriptor's status.
    Fail(Field, Field),
}

impl Channel {
    fn turn(&self, build: &Build) -> Turn {
        let begins = match self.work {
            Work::Descriptor(bd) => bd.moved == 0,
            Work::Direct { moved } => moved == 0,
            Work::None | Work::Fetch { .. } => true,
        };
        let (core, direction) = (build.core, self.direction);
        Turn { core, direction, beats: self.beats, descriptors: self.descriptors, begins }
    }

    /// What becomes of the next `n` beats.
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
        match with.faults.at_beats(&self.turn(build), n as u64) {
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

    /// What the fetch of a descriptor fails with.
    pub(super) fn fetch_fault(
        &mut self,
        build: &Build,
        with: &mut Surroundings<'_>,
    ) -> Option<Field> {
        if with.faults.none() {
            return None;
        }
        match with.faults.at_fetch(&self.turn(build))? {
            FaultKind::SgSlvErr => Some(dmasr::SG_SLV_ERR),
            FaultKind::SgDecErr => Some(dmasr::SG_DEC_ERR),
            _ => Some(dmasr::SG_INT_ERR),
        }
    }

    /// What happens to the status of a descriptor.
    pub(super) fn status_fault(
        &mut self,
        build: &Build,
        with: &mut Surroundings<'_>,
    ) -> Option<FaultKind> {
        if with.faults.none() { None } else { with.faults.at_completion(&self.turn(build)) }
    }

    /// Whether the packet that ends here has its TLAST.
    pub(super) fn ends_packet(&mut self, build: &Build, with: &mut Surroundings<'_>) -> bool {
        if with.faults.none() {
            return true;
        }
        match with.faults.at_packet_end(&self.turn(build)) {
            None => true,
            fault => {
                self.faulty.extra = fault == Some(FaultKind::LongPacket);
                false
            }
        }
    }

    /// Goes on with the effects of earlier faults; returns whether anything changed.
    pub(super) fn settle(
        &mut self,
        build: &Build,
        now: u64,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> bool {
        let mut changed = false;
        while let Some(place) = self.faulty.late.iter().position(|(at, ..)| *at <= now) {
            let (_, address, word) = self.faulty.late.remove(place);
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
                // There is no room for it in the chain, or behind LENGTH.
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

    /// Whether all room for a packet was used up.
    fn is_full(&self) -> bool {
        match self.work {
            Work::None => true,
            Work::Direct { moved } => moved == self.length,
            Work::Fetch { .. } | Work::Descriptor(_) => false,
        }
    }
}
