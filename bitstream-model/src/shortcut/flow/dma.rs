//! This file is for a channel that does nothing out of the ordinary: it waits, or moves beats in the
//! middle of a descriptor, which are counted elsewhere.

use crate::axi_dma::Core;
use crate::axi_dma::channel::{Channel, Work};
use crate::axi_dma::mover::BEAT;
use crate::cast::register;
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::dmacr;
use pgs_interface::record::BEAT_BYTES;

impl Channel {
    /// Whether it has to wait for beats, for space or for work, and nothing else can happen in it.
    #[inline]
    pub(crate) fn cannot_move(&self, stream: &Stream) -> bool {
        let waits = match self.direction {
            Direction::Mm2s => stream.space() == 0,
            Direction::S2mm => stream.len() == 0,
        };
        let works = match self.work {
            Work::None => !waits && self.direction == Direction::S2mm,
            Work::Fetch { .. } => true,
            Work::Descriptor(_) | Work::Direct { .. } => !waits,
        };
        !works && self.faulty.late.is_empty() && !self.faulty.extra && !self.faulty.discards
    }

    /// Whether it works as it should, and its clock is not ahead by more than a beat.
    fn in_order(&self, now: u64, beat_shift: u32) -> bool {
        let plain = !dmacr::KEYHOLE.is_set(self.control) && self.time < now + (1 << beat_shift);
        plain && self.next_event().is_none() && self.faulty.none()
    }
}

impl Core {
    /// Where the rest of the descriptor's data is, or goes, that a channel moves, and how many beats.
    pub(crate) fn flows(&self, direction: Direction, now: u64) -> Option<(u64, usize)> {
        let (channel, beat_shift) = match direction {
            Direction::Mm2s => (&self.mm2s, self.build.mm2s_beat_shift),
            Direction::S2mm => (&self.s2mm, self.build.s2mm_beat_shift),
        };
        let Work::Descriptor(bd) = channel.work else { return None };
        let at = bd.buffer + u64::from(bd.moved);
        let left = bd.length - bd.moved;
        let whole = at % u64::from(BEAT) == 0 && self.reset_until.is_none();
        let beats = (left / BEAT) as usize;
        (whole && channel.in_order(now, beat_shift)).then_some((at, beats))
    }

    /// Binary logarithm of the clocks that a beat takes on the MM2S stream.
    pub(crate) fn beat_shift(&self) -> u32 {
        self.build.mm2s_beat_shift
    }

    /// MM2S: by how many clocks it is ahead with the last beat.
    pub(crate) fn ahead(&self, now: u64) -> u64 {
        self.mm2s.time.saturating_sub(now)
    }

    /// MM2S: it has moved beats up to that time, and the last one is through so many clocks later.
    pub(crate) fn has_come_to(&mut self, now: u64, ahead: u64) {
        if ahead > 0 {
            self.mm2s.time = now + ahead;
        }
    }

    /// S2MM: whether it does nothing as long as nothing comes.
    pub(crate) fn rests_without_beats(&self, now: u64) -> bool {
        let fetches = matches!(self.s2mm.work, Work::Fetch { .. });
        self.reset_until.is_none()
            && !fetches
            && self.s2mm.in_order(now, self.build.s2mm_beat_shift)
    }

    /// So many beats of a channel have been moved, fewer than the descriptor had.
    pub(crate) fn flowed(&mut self, direction: Direction, beats: usize) {
        if beats == 0 {
            return;
        }
        let channel = self.channel(direction);
        if let Work::Descriptor(bd) = &mut channel.work {
            bd.moved += register(beats * BEAT_BYTES);
            bd.rxsof |= !channel.in_packet;
            channel.in_packet = true;
            channel.beats += beats as u64;
        }
    }
}
