//! Runs the engine of a channel: it fetches descriptors, moves beats and writes status back.
//!
//! An engine moves at most one beat a clock, as its port does; on a stream of less than 128 bits a
//! beat takes several clocks. It keeps a clock of its own that follows the board's, so that it
//! moves the beats of many clocks in a few block copies.

use super::channel::{Channel, Descriptor, Work};
use super::faults::Next;
use super::{Build, PacketCount, Surroundings};
use crate::cast::register;
use crate::config::quirks::Master;
use crate::fault::FaultKind;
use crate::recording::{MovedBeats, Recorder};
use crate::stream::Stream;
use crate::violation::ViolationKind;
use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::{dmacr, dmasr};
use pgs_interface::descriptor::{
    self, BUFFER, BUFFER_MSB, BYTES, CONTROL, FETCHED_WORDS, NXTDESC, NXTDESC_MSB, STATUS, status,
};
use pgs_interface::record::{BEAT_BYTES, Beat};
use pgs_interface::register::Field;

#[expect(clippy::cast_possible_truncation, reason = "it is 16")]
pub(super) const BEAT: u32 = BEAT_BYTES as u32;
const KEYHOLE_BEATS: usize = 1;

/// The rest of a descriptor or transfer.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// The address of its next beat.
    at: u64,
    /// Bytes.
    left: u32,
    /// Whether its end is the end of the packet.
    last: bool,
}

/// The outcome of an attempt to move beats.
#[derive(Debug, Clone, Copy)]
enum Transferred {
    Nothing,
    /// No beat moved, but the state of the channel changed.
    Stopped,
    /// `n` beats moved; `ended` if the packet ended with them.
    Beats {
        n: usize,
        ended: bool,
    },
}

impl Channel {
    /// Moves up to `limit` beats between the clocks `start` and `end`. Returns their number, and
    /// whether any state changed.
    pub(super) fn run(
        &mut self,
        build: &Build,
        start: u64,
        end: u64,
        limit: usize,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> (usize, bool) {
        self.time = self.time.max(start);
        let mut moved = 0;
        let mut changed = self.settle(build, end, stream, with);
        while !self.faulty.holds(self.direction) {
            match self.work {
                Work::None => {
                    if self.overrun(stream) {
                        self.fail(build, dmasr::DMA_INT_ERR.mask());
                        changed = true;
                    }
                    break;
                }
                Work::Fetch { address, ready_at } => {
                    if ready_at > end {
                        break;
                    }
                    self.time = self.time.max(ready_at);
                    self.fetch(build, address, with);
                    changed = true;
                }
                Work::Descriptor(_) if moved == limit => break,
                Work::Descriptor(mut bd) => {
                    let left = bd.length - bd.moved;
                    let n = self.portion(build, left, end, limit - moved, stream);
                    let at = bd.buffer + u64::from(bd.moved);
                    let part = Part { at, left, last: bd.eof };
                    let (n, ended) = match self.beats(build, n, &part, stream, with) {
                        Transferred::Nothing => break,
                        Transferred::Stopped => {
                            changed = true;
                            break;
                        }
                        Transferred::Beats { n, ended } => (n, ended),
                    };
                    moved += n;
                    bd.rxsof |= !self.in_packet;
                    self.in_packet = true;
                    bd.moved += left.min(register(n * BEAT_BYTES));
                    self.work = Work::Descriptor(bd);
                    if ended || bd.moved == bd.length {
                        self.complete(build, bd, ended, with);
                        changed = true;
                    }
                }
                Work::Direct { moved: done } => {
                    let left = self.length - done;
                    let n = self.portion(build, left, end, limit - moved, stream);
                    if n == 0 {
                        if left == 0 {
                            // The buffer is full and the packet goes on.
                            if stream.len() > 0 {
                                self.fail(build, dmasr::DMA_INT_ERR.mask());
                                changed = true;
                            }
                        }
                        break;
                    }
                    let part = Part { at: self.address + u64::from(done), left, last: true };
                    let (n, ended) = match self.beats(build, n, &part, stream, with) {
                        Transferred::Nothing => break,
                        Transferred::Stopped => {
                            changed = true;
                            break;
                        }
                        Transferred::Beats { n, ended } => (n, ended),
                    };
                    moved += n;
                    let done = done + left.min(register(n * BEAT_BYTES));
                    self.work = Work::Direct { moved: done };
                    if ended {
                        if self.direction == Direction::S2mm {
                            self.length = done;
                        }
                        self.packet_ended(build, with);
                        self.direct_done();
                        changed = true;
                    }
                }
            }
        }
        (moved, changed || moved > 0)
    }

    /// Notes that no beat moves from the channel's clock on, and which side of the stream waits.
    pub(super) fn note_rest(&self, build: &Build, stream: &Stream, recorder: &mut Recorder) {
        let has_part = match self.work {
            Work::None | Work::Fetch { .. } => false,
            Work::Descriptor(bd) => bd.moved < bd.length,
            Work::Direct { moved } => moved < self.length,
        };
        let (beats, room) = (stream.len() > 0, stream.space() > 0);
        // Where both could, the memory holds the channel up.
        let sides = match self.direction {
            Direction::Mm2s => [has_part && !room, room],
            Direction::S2mm => [beats, has_part && !beats],
        };
        recorder.rests((build.core, self.direction), self.time, sides);
    }

    /// S2MM in scatter-gather mode: the chain has ended in the middle of a packet and more comes.
    fn overrun(&self, stream: &Stream) -> bool {
        // A channel that has failed already is on its way to Halted.
        let runs = dmacr::RS.is_set(self.control);
        runs && self.direction == Direction::S2mm && self.idle && self.in_packet && stream.len() > 0
    }

    /// Binary logarithm of the clocks that a beat takes on the stream.
    fn beat_shift(&self, build: &Build) -> u32 {
        match self.direction {
            Direction::Mm2s => build.mm2s_beat_shift,
            Direction::S2mm => build.s2mm_beat_shift,
        }
    }

    /// The number of beats that can be moved now and begin before `end`.
    fn portion(&self, build: &Build, left: u32, end: u64, limit: usize, stream: &Stream) -> usize {
        let shift = self.beat_shift(build);
        let last = (1 << shift) - 1;
        let clocks = end.saturating_sub(self.time).saturating_add(last) >> shift;
        let clocks = usize::try_from(clocks).unwrap_or(usize::MAX);
        // A slow port takes its time after each beat.
        let clocks = if self.faulty.slow > 0 { clocks.min(1) } else { clocks };
        let stream_beats = match self.direction {
            Direction::Mm2s => stream.space(),
            Direction::S2mm => match stream.next_last() {
                Some(last) => stream.len().min(last + 1),
                None => stream.len(),
            },
        };
        let keyhole = if dmacr::KEYHOLE.is_set(self.control) { KEYHOLE_BEATS } else { usize::MAX };
        (left.div_ceil(BEAT) as usize).min(clocks).min(stream_beats).min(limit).min(keyhole)
    }

    /// Moves up to `n` beats of a descriptor or transfer, until a fault is due.
    fn beats(
        &mut self,
        build: &Build,
        n: usize,
        part: &Part,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> Transferred {
        if n == 0 {
            return Transferred::Nothing;
        }
        let (n, mask, cut) = match self.next_beats(build, n, with) {
            Next::Move(n) => (n, 0, false),
            Next::Corrupt(mask) => (1, mask, false),
            Next::Cut => (1, 0, true),
            Next::Rest => return Transferred::Nothing,
            Next::Board => return Transferred::Stopped,
            Next::Fail(dmasr, status) => {
                self.data_error(build, dmasr, status, with);
                return Transferred::Stopped;
            }
        };
        let recorded = with.recorder.is_some();
        let ends =
            recorded && self.direction == Direction::S2mm && stream.next_last() == Some(n - 1);
        let Some(mut ended) = self.transfer(build, n, mask, part, stream, with) else {
            return Transferred::Stopped;
        };
        let begin = self.time;
        let clocks = (n as u64) << self.beat_shift(build);
        self.time += clocks + n as u64 * u64::from(self.faulty.slow);
        self.beats += n as u64;
        if cut && !ended {
            match self.direction {
                Direction::Mm2s => {
                    stream.mark_last();
                    self.faulty.cut = true;
                }
                Direction::S2mm => {
                    self.faulty.discards = true;
                    ended = true;
                }
            }
        }
        if let Some(recorder) = &mut with.recorder {
            let (core, direction) = (build.core, self.direction);
            let beats_before = self.beats - n as u64;
            let moved = MovedBeats {
                beats: n as u64,
                clocks: 1 << self.beat_shift(build),
                last: ends || direction == Direction::Mm2s && stream.ends_with_last(),
                beats_before,
                phase: with.faults.phase(core, direction).filter(|_| beats_before == 0),
            };
            recorder.moves((core, direction), begin, &moved);
        }
        Transferred::Beats { n, ended }
    }

    /// Moves `n` beats and inverts the bits of `mask` in their first word. Returns whether the
    /// packet ended, or `None` after an error, which stops the channel.
    fn transfer(
        &mut self,
        build: &Build,
        n: usize,
        mask: u32,
        part: &Part,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> Option<bool> {
        let Part { at, left, last } = *part;
        let at = if dmacr::KEYHOLE.is_set(self.control) { self.keyhole_address(at) } else { at };
        // Without a realignment engine the low address bits do not exist: the data is wrong, and
        // the violation was recorded when the descriptor was fetched.
        let at = at & !(u64::from(BEAT) - 1);
        let fenced_off = !build.reaches(Master::Data(self.direction), at, n * BEAT_BYTES);
        let denied = match self.direction {
            direction if fenced_off => with.memory.check(direction, at, n).err(),
            Direction::Mm2s if with.counts_only => {
                stream.pass(n);
                with.moved.beats_read += n as u64;
                None
            }
            Direction::S2mm if with.counts_only => {
                let ends = stream.next_last() == Some(n - 1);
                stream.pop(n);
                with.moved.beats_written += n as u64;
                return Some(ends && self.ends_packet(build, with));
            }
            Direction::Mm2s => match with.memory.beats(at, n) {
                Ok(_) if self.faulty.cut => None,
                Ok(beats) => {
                    match (beats, mask) {
                        ([Beat([first, rest @ ..])], 1..) => {
                            let [b, c, d] = *rest;
                            stream.push(&[Beat([first ^ mask, b, c, d])]);
                        }
                        _ => stream.push(beats),
                    }
                    with.moved.beats_read += n as u64;
                    None
                }
                Err(denied) => Some(denied),
            },
            Direction::S2mm => {
                let ends = stream.next_last() == Some(n - 1);
                let fill = |beats: &mut [Beat]| {
                    stream.pop_into(beats);
                    if let Some(first) = beats.first_mut() {
                        first.0[0] ^= mask;
                    }
                };
                match with.memory.write(at, n, fill) {
                    Ok(()) => {
                        with.moved.beats_written += n as u64;
                        return Some(ends && self.ends_packet(build, with));
                    }
                    Err(denied) => Some(denied),
                }
            }
        };
        if let Some(denied) = denied {
            with.log.violation(ViolationKind::OutsideGrant {
                core: build.core,
                direction: self.direction,
                address: at,
                bytes: (n * BEAT_BYTES) as u64,
                denied,
            });
        }
        if denied.is_some() || fenced_off {
            self.data_error(build, dmasr::DMA_DEC_ERR, status::DMA_DEC_ERR, with);
            return None;
        }
        let whole = left as usize <= n * BEAT_BYTES;
        if whole && last && !self.faulty.cut && self.ends_packet(build, with) {
            stream.mark_last();
        }
        if whole && left % BEAT != 0 && !self.faulty.cut {
            stream.mark_partial();
        }
        Some(whole && last)
    }

    fn keyhole_address(&self, at: u64) -> u64 {
        match self.work {
            Work::Descriptor(bd) => bd.buffer,
            Work::Direct { .. } => self.address,
            Work::None | Work::Fetch { .. } => at,
        }
    }

    /// Reports a failed access to data in the descriptor, if it can be written, and stops the
    /// channel.
    fn data_error(
        &mut self,
        build: &Build,
        dmasr: Field,
        status: Field,
        with: &mut Surroundings<'_>,
    ) {
        if let Work::Descriptor(bd) = self.work {
            let word = status.put(bd.moved, 1);
            // The channel fails anyway, whether or not the status could be written.
            let _ = with.memory.write_word(bd.address + 4 * STATUS as u64, word);
        }
        self.fail(build, dmasr.mask());
    }

    fn fetch(&mut self, build: &Build, address: u64, with: &mut Surroundings<'_>) {
        let (core, direction) = (build.core, self.direction);
        self.current = address;
        if !address.is_multiple_of(BYTES as u64) {
            with.log.violation(ViolationKind::MisalignedDescriptor { core, direction, address });
        }
        let address = address & !(BYTES as u64 - 1);
        if let Some(error) = self.fetch_fault(build, with) {
            self.fail(build, error.mask());
            return;
        }
        let mut words = [0_u32; FETCHED_WORDS];
        if let Err(denied) = with.memory.read_words(address, &mut words) {
            let bytes = (FETCHED_WORDS * 4) as u64;
            with.log.violation(ViolationKind::OutsideGrant {
                core,
                direction,
                address,
                bytes,
                denied,
            });
            self.fail(build, dmasr::SG_DEC_ERR.mask());
            return;
        }
        // The status lies in the same segment, which whole descriptors fill.
        if !build.reaches(Master::Sg, address, BYTES) {
            self.fail(build, dmasr::SG_DEC_ERR.mask());
            return;
        }
        let wide = build.address_width > 32;
        let join = |low: usize, high: usize| {
            u64::from(words[low]) | if wide { u64::from(words[high]) << 32 } else { 0 }
        };
        let cyclic = dmacr::CYCLIC_BD.is_set(self.control);
        if status::CMPLTED.is_set(words[STATUS]) && !cyclic {
            with.log.violation(ViolationKind::StaleDescriptor { core, direction, address });
            self.fail(build, dmasr::SG_INT_ERR.mask());
            return;
        }
        let wanted = descriptor::control::LENGTH.of(words[CONTROL]);
        let length = wanted & (u32::MAX >> (32 - build.length_width));
        if length != wanted {
            let width = build.length_width;
            with.log.violation(ViolationKind::LengthTooWide { core, direction, wanted, width });
        }
        if length == 0 {
            with.log.violation(ViolationKind::ZeroLength { core, direction, address });
            let _ = with.memory.write_word(address + 4 * STATUS as u64, status::DMA_INT_ERR.mask());
            self.fail(build, dmasr::DMA_INT_ERR.mask());
            return;
        }
        let sof = descriptor::control::SOF.is_set(words[CONTROL]);
        let eof = descriptor::control::EOF.is_set(words[CONTROL]);
        if direction == Direction::Mm2s && sof == self.in_packet {
            with.log.violation(ViolationKind::UnpairedPacket { core, direction, address });
        }
        let buffer = join(BUFFER, BUFFER_MSB);
        let whole_beats = length.is_multiple_of(BEAT) || (direction == Direction::Mm2s && eof);
        if buffer % u64::from(BEAT) != 0 || !whole_beats {
            let kind = ViolationKind::Misaligned { core, direction, address: buffer, length };
            with.log.violation(kind);
        }
        if let Some(recorder) = &mut with.recorder {
            recorder.descriptor_begins((core, direction), self.time, address);
        }
        let next = join(NXTDESC, NXTDESC_MSB);
        self.work = Work::Descriptor(Descriptor {
            address,
            next,
            buffer,
            length,
            moved: 0,
            eof,
            rxsof: false,
        });
    }

    /// Checks that the rest of a buffer is granted to the device, if the packet ends before the
    /// buffer: the next packet could be longer.
    fn check_rest(&self, build: &Build, bd: &Descriptor, with: &mut Surroundings<'_>) {
        if self.direction == Direction::Mm2s || bd.moved == bd.length {
            return;
        }
        let beats = bd.length.div_ceil(BEAT) as usize;
        if let Err(denied) =
            with.memory.check(self.direction, bd.buffer & !(u64::from(BEAT) - 1), beats)
        {
            with.log.violation(ViolationKind::OutsideGrant {
                core: build.core,
                direction: self.direction,
                address: bd.buffer,
                bytes: bd.length.into(),
                denied,
            });
        }
    }

    /// Writes the status of a finished descriptor and goes on, or pauses at the tail.
    fn complete(
        &mut self,
        build: &Build,
        bd: Descriptor,
        ended: bool,
        with: &mut Surroundings<'_>,
    ) {
        let mut word = status::CMPLTED.put(bd.moved, 1);
        if self.direction == Direction::S2mm {
            word = status::RXSOF.put(word, u32::from(bd.rxsof));
            word = status::RXEOF.put(word, u32::from(ended));
        }
        let address = bd.address + 4 * STATUS as u64;
        let fault = self.status_fault(build, with);
        match fault {
            Some(FaultKind::SgDecErrWrite) => {
                self.fail(build, dmasr::SG_DEC_ERR.mask());
                return;
            }
            Some(FaultKind::BdIntErr) => word = status::DMA_INT_ERR.put(word, 1),
            Some(FaultKind::BdSlvErr) => word = status::DMA_SLV_ERR.put(word, 1),
            Some(FaultKind::BdDecErr) => word = status::DMA_DEC_ERR.put(word, 1),
            _ => {}
        }
        if let Some(FaultKind::LateCmplted { ns }) = fault {
            let at = self.time.saturating_add(build.cycles(ns));
            self.faulty.late.push((at, address, word));
        } else if !self.put_status(build, address, word, with) {
            return;
        }
        self.check_rest(build, &bd, with);
        if let Some(recorder) = &mut with.recorder {
            recorder.descriptor_ends((build.core, self.direction), self.time, bd.moved);
        }
        with.moved.descriptors += 1;
        self.descriptors += 1;
        if ended {
            self.in_packet = false;
            self.packet_ended(build, with);
            self.packet_done();
        }
        self.resume = Some(bd.next);
        if bd.address == self.tail && !dmacr::CYCLIC_BD.is_set(self.control) {
            self.idle = true;
            self.work = Work::None;
        } else {
            // The engine fetched it ahead while the data of this one moved.
            self.work = Work::Fetch { address: bd.next, ready_at: self.time };
        }
    }

    /// Writes the status of a descriptor; returns whether the write succeeded.
    pub(super) fn put_status(
        &mut self,
        build: &Build,
        address: u64,
        word: u32,
        with: &mut Surroundings<'_>,
    ) -> bool {
        let Err(denied) = with.memory.write_word(address, word) else { return true };
        let (core, direction) = (build.core, self.direction);
        let kind = ViolationKind::OutsideGrant { core, direction, address, bytes: 4, denied };
        with.log.violation(kind);
        self.fail(build, dmasr::SG_DEC_ERR.mask());
        false
    }

    /// Counts a finished packet, and ends the faults that last as long as the packet.
    fn packet_ended(&mut self, build: &Build, with: &mut Surroundings<'_>) {
        let (core, direction) = (build.core, self.direction);
        let (beats, descriptors) = (self.beats, self.descriptors);
        let phase = with.faults.phase(core, direction);
        with.moved.packets.push(PacketCount { core, direction, phase, beats, descriptors });
        if let Some(recorder) = &mut with.recorder {
            recorder.packet_ends((core, direction), self.time);
        }
        with.faults.packet_ends(core, direction);
        (self.beats, self.descriptors) = (0, 0);
        self.faulty.slow = 0;
        self.faulty.cut = false;
    }
}
