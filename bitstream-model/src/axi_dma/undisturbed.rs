//! Finds channels in which only beats flow, and passes many of their beats at once.
//!
//! A channel is undisturbed while it moves beats in the middle of a descriptor, or waits for beats:
//! no fault has touched it, and no timer of its own runs out.

use super::Core;
use super::channel::{Channel, Work};
use super::mover::BEAT;
use crate::cast::register;
use pgs_interface::axi_dma::{Direction, dmacr};
use pgs_interface::record::BEAT_BYTES;

impl Channel {
    /// Whether the channel is undisturbed, and its clock is not ahead by more than a beat.
    fn undisturbed(&self, now: u64, beat_shift: u32) -> bool {
        let plain = !dmacr::KEYHOLE.is_set(self.control) && self.time < now + (1 << beat_shift);
        plain && self.next_event().is_none() && self.faulty.none()
    }
}

impl Core {
    /// The address of the next beat of an undisturbed channel, and the beats left in its
    /// descriptor's buffer.
    pub(crate) fn undisturbed(&self, direction: Direction, now: u64) -> Option<(u64, usize)> {
        let (channel, beat_shift) = match direction {
            Direction::Mm2s => (&self.mm2s, self.build.mm2s_beat_shift),
            Direction::S2mm => (&self.s2mm, self.build.s2mm_beat_shift),
        };
        let Work::Descriptor(descriptor) = channel.work else { return None };
        let at = descriptor.buffer + u64::from(descriptor.moved);
        let left = descriptor.length - descriptor.moved;
        let whole = at % u64::from(BEAT) == 0 && self.reset_until.is_none();
        let beats = (left / BEAT) as usize;
        (whole && channel.undisturbed(now, beat_shift)).then_some((at, beats))
    }

    /// S2MM: whether the channel does nothing until a beat arrives.
    pub(crate) fn rests_without_beats(&self, now: u64) -> bool {
        let fetches = matches!(self.s2mm.work, Work::Fetch { .. });
        self.reset_until.is_none()
            && !fetches
            && self.s2mm.undisturbed(now, self.build.s2mm_beat_shift)
    }

    /// Binary logarithm of the clocks that a beat takes on the MM2S stream.
    pub(crate) fn beat_shift(&self) -> u32 {
        self.build.mm2s_beat_shift
    }

    /// MM2S: the clocks from `now` to the end of the last beat.
    pub(crate) fn ahead(&self, now: u64) -> u64 {
        self.mm2s.time.saturating_sub(now)
    }

    /// MM2S: the last beat ends `ahead` clocks after `now`.
    pub(crate) fn set_ahead(&mut self, now: u64, ahead: u64) {
        if ahead > 0 {
            self.mm2s.time = now + ahead;
        }
    }

    /// Moves beats of a channel, fewer than its descriptor has left.
    pub(crate) fn pass_over(&mut self, direction: Direction, beats: usize) {
        if beats == 0 {
            return;
        }
        let channel = self.channel(direction);
        if let Work::Descriptor(descriptor) = &mut channel.work {
            descriptor.moved += register(beats * BEAT_BYTES);
            descriptor.rxsof |= !channel.in_packet;
            channel.in_packet = true;
            channel.beats += beats as u64;
        }
    }
}
