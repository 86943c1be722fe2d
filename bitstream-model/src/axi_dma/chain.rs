//! Finds the buffers of a whole chain of descriptors, and lets such a chain pass at once.

use super::channel::Work;
use super::mover::BEAT;
use super::{Core, Surroundings};
use crate::config::quirks::Master;
use crate::memory::Memory;
use crate::stream::Stream;
use pgs_interface::axi_dma::{Direction, dmacr};
use pgs_interface::descriptor::{
    BUFFER, BUFFER_MSB, BYTES, CONTROL, FETCHED_WORDS, NXTDESC, NXTDESC_MSB, STATUS, control,
    status,
};
use pgs_interface::record::BEAT_BYTES;

/// Descriptors of the longest chain that is looked through.
const DESCRIPTORS_MAX: usize = 1 << 16;

/// The buffer of a descriptor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) at: u64,
    pub(crate) beats: usize,
    /// SOF and EOF; nobody sets them for a receiver.
    pub(crate) begins: bool,
    pub(crate) ends: bool,
}

/// A descriptor as far as a chain needs it.
struct Link {
    piece: Piece,
    next: u64,
    complete: bool,
}

impl Core {
    /// Adds the buffers of the chain that a channel works at to `pieces`, from the first descriptor
    /// to the tail, and returns how many of their beats have moved. A channel that has never worked
    /// has no chain. `None` if anything but beats and completions can happen on the channel, or a
    /// descriptor is not as a driver makes it.
    pub(crate) fn chain(
        &self,
        direction: Direction,
        memory: &mut Memory,
        pieces: &mut Vec<Piece>,
    ) -> Option<usize> {
        let channel = match direction {
            Direction::Mm2s => &self.mm2s,
            Direction::S2mm => &self.s2mm,
        };
        // An interrupt on the way would wake the host.
        let interrupts = direction == Direction::Mm2s && dmacr::IOC_IRQ_EN.is_set(channel.control);
        if self.reset_until.is_some() || !channel.is_plain() || interrupts {
            return None;
        }
        let (current, part) = match channel.work {
            Work::None if !channel.idle => return Some(0),
            Work::None => (None, 0),
            Work::Fetch { address, .. } => (Some(address), 0),
            Work::Descriptor(descriptor) => (Some(descriptor.address), descriptor.moved / BEAT),
            Work::Direct { .. } => return None,
        };
        let (mut at, mut beats, mut moved) = (channel.first, 0, None);
        for _ in 0..DESCRIPTORS_MAX {
            let link = self.link(direction, at, memory)?;
            if current == Some(at) {
                moved = Some(beats + part as usize);
            }
            // The engine completes those before the current one.
            if link.complete != (current.is_none() || moved.is_none()) {
                return None;
            }
            pieces.push(link.piece);
            beats += link.piece.beats;
            if at == channel.tail {
                return if current.is_some() { moved } else { Some(beats) };
            }
            at = link.next;
        }
        None
    }

    /// Reads a descriptor that the engine would take without a complaint.
    fn link(&self, direction: Direction, at: u64, memory: &mut Memory) -> Option<Link> {
        let build = &self.build;
        let mut words = [0_u32; FETCHED_WORDS];
        if !at.is_multiple_of(BYTES as u64) || !build.reaches(Master::Sg, at, BYTES) {
            return None;
        }
        memory.read_words(at, &mut words).ok()?;
        let wide = build.address_width > 32;
        let join = |low: usize, high: usize| {
            u64::from(words[low]) | if wide { u64::from(words[high]) << 32 } else { 0 }
        };
        let (buffer, length) = (join(BUFFER, BUFFER_MSB), control::LENGTH.of(words[CONTROL]));
        let whole = length > 0 && length.is_multiple_of(BEAT) && buffer % u64::from(BEAT) == 0;
        let beats = (length / BEAT) as usize;
        let reached = build.reaches(Master::Data(direction), buffer, beats * BEAT_BYTES);
        let fits = length <= u32::MAX >> (32 - build.length_width);
        (whole && reached && fits).then_some(Link {
            piece: Piece {
                at: buffer,
                beats,
                begins: control::SOF.is_set(words[CONTROL]),
                ends: control::EOF.is_set(words[CONTROL]),
            },
            next: join(NXTDESC, NXTDESC_MSB),
            complete: status::CMPLTED.is_set(words[STATUS]),
        })
    }

    /// Lets `beats` beats pass, the rest of the chain that a channel works at, so that the last one
    /// ends at the clock `end`. They are counted and not moved, through an [unread](Stream::unread)
    /// stream.
    pub(crate) fn pass_chain(
        &mut self,
        direction: Direction,
        beats: usize,
        end: u64,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) {
        stream.clear();
        let shift = match direction {
            Direction::Mm2s => self.build.mm2s_beat_shift,
            Direction::S2mm => {
                stream.expect_packet(beats);
                self.build.s2mm_beat_shift
            }
        };
        let start = end.saturating_sub((beats as u64) << shift);
        self.run(direction, start, u64::MAX / 2, usize::MAX, stream, with);
    }
}
