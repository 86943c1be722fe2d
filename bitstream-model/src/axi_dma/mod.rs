//! Emulates an AXI DMA core: two channels, one reset.
//!
//! `channel.rs` holds the registers of one channel and their side effects, `mover.rs` the engine
//! that fetches descriptors and moves beats, `faults.rs` the effects of faults on both. Both
//! directions are one piece of code. `chain.rs` is for [`fast`](crate::fast): the buffers of a
//! whole chain, and a chain that passes at once.
//!
//! Source: PG021 (v7.1); where it leaves a choice, the specification's table of behaviours.

pub(crate) mod chain;
mod channel;
mod effects;
mod faults;
mod mover;

use crate::config::beat_cycles;
use crate::config::quirks::{Master, Resettable};
use crate::config::{BoardConfig, Delays, cycles_of};
use crate::fault::{FaultKind, Faults, Place, StepPhase, end_of_reset};
use crate::memory::Memory;
use crate::recording::Recorder;
use crate::stream::Stream;
use crate::violation::Log;
use pgs_interface::axi_dma::{DMACR, Direction, S2MM_OFFSET, dmacr};
use pgs_interface::fence::Fence;

use channel::{Channel, Work};

/// The build options of a core.
#[derive(Debug, Clone, Copy)]
struct Build {
    core: usize,
    length_width: u32,
    address_width: u32,
    scatter_gather: bool,
    /// The fence, and the masters that it does not hold.
    fence: Option<Fence>,
    unfenced: &'static [(usize, Master)],
    /// Binary logarithm of the clocks that a beat takes on the streams.
    mm2s_beat_shift: u32,
    s2mm_beat_shift: u32,
    delays: Delays,
    clock_khz: u32,
}

impl Build {
    /// Clock cycles in `ns` nanoseconds.
    fn cycles(&self, ns: u64) -> u64 {
        cycles_of(ns, self.clock_khz)
    }

    /// Whether the interconnect has a way from a master to these bytes.
    fn reaches(&self, master: Master, address: u64, bytes: usize) -> bool {
        self.fence.is_none_or(|fence| {
            fence.contains(address, bytes as u64) || self.unfenced.contains(&(self.core, master))
        })
    }
}

/// A packet that has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketCount {
    /// Which DMA.
    pub core: usize,
    /// Which channel.
    pub direction: Direction,
    /// The phase that it belongs to: the first contact pass, if the design streams the collisions
    /// once.
    pub phase: Option<StepPhase>,
    /// Its beats.
    pub beats: u64,
    /// Descriptors that carried it.
    pub descriptors: u32,
}

/// Counts of the work of all engines, for the observer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Moved {
    /// The packets of this step.
    pub(crate) packets: Vec<PacketCount>,
    pub(crate) beats_read: u64,
    pub(crate) beats_written: u64,
    pub(crate) descriptors: u64,
}

/// Everything outside a core that its engines need to move beats.
pub(crate) struct Surroundings<'a> {
    pub(crate) memory: &'a mut Memory,
    pub(crate) log: &'a mut Log,
    pub(crate) moved: &'a mut Moved,
    pub(crate) faults: &'a mut Faults,
    /// Whether beats are counted and not moved: a whole step has read and written them already.
    pub(crate) counts_only: bool,
    /// Takes notes, if the board is to be recorded.
    pub(crate) recorder: Option<&'a mut Recorder>,
}

/// Everything outside a core that a write to a register needs.
pub(crate) struct WriteContext<'a> {
    pub(crate) log: &'a mut Log,
    pub(crate) faults: &'a mut Faults,
    /// Takes notes, if the board is to be recorded.
    pub(crate) recorder: Option<&'a mut Recorder>,
}

/// One AXI DMA.
#[derive(Debug)]
pub(crate) struct Core {
    build: Build,
    config: BoardConfig,
    mm2s: Channel,
    s2mm: Channel,
    reset_until: Option<u64>,
}

impl Core {
    pub(crate) fn new(core: usize, config: &BoardConfig) -> Self {
        let profile = config.profile;
        // A direction without a stream never moves a beat, and its shift has no effect.
        let shift =
            |widths: &[u32]| widths.get(core).map_or(0, |width| beat_cycles(*width).ilog2());
        let build = Build {
            core,
            length_width: config.quirks.length_register.unwrap_or(config.length_width),
            address_width: config.address_width,
            scatter_gather: config.scatter_gather,
            fence: config.fence,
            unfenced: config.quirks.unfenced,
            mm2s_beat_shift: shift(profile.mm2s_widths),
            s2mm_beat_shift: shift(profile.s2mm_widths),
            delays: config.delays,
            clock_khz: profile.clock_khz,
        };
        let held = config.quirks.held_reset == Some(Resettable::Dma(core));
        Self {
            build,
            config: *config,
            mm2s: Channel::new(Direction::Mm2s),
            s2mm: Channel::new(Direction::S2mm),
            reset_until: held.then_some(u64::MAX),
        }
    }

    fn channel(&mut self, direction: Direction) -> &mut Channel {
        match direction {
            Direction::Mm2s => &mut self.mm2s,
            Direction::S2mm => &mut self.s2mm,
        }
    }

    /// The channel that an offset belongs to, and the offset in MM2S terms.
    fn decode(offset: u32) -> (Direction, u32) {
        if offset < S2MM_OFFSET {
            (Direction::Mm2s, offset)
        } else {
            (Direction::S2mm, offset - S2MM_OFFSET)
        }
    }

    /// Reads a register; `None` if the offset has no register.
    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        let (direction, at) = Self::decode(offset);
        let resetting = self.reset_until.is_some();
        let build = self.build;
        let value = self.channel(direction).read(&build, at)?;
        Some(if resetting && at == DMACR.offset { value | dmacr::RESET.mask() } else { value })
    }

    /// Writes a register. Returns whether it was a doorbell, or `None` if the offset has no
    /// register.
    pub(crate) fn write(
        &mut self,
        now: u64,
        offset: u32,
        value: u32,
        with: WriteContext<'_>,
    ) -> Option<bool> {
        let WriteContext { log, faults, recorder } = with;
        let (direction, at) = Self::decode(offset);
        if self.reset_until.is_some() {
            // The core is deaf until the reset has ended.
            return self.channel(direction).has(at).then_some(false);
        }
        if at == DMACR.offset && dmacr::RESET.is_set(value) {
            let core = self.build.core;
            let fault = faults.at_reset(Place::Core(core));
            self.reset_until = Some(end_of_reset(&self.config, now, fault));
            self.mm2s.stop();
            self.s2mm.stop();
            if let Some(recorder) = recorder {
                self.abandons_all(now, recorder);
            }
            log.withdraw_pardon();
            return Some(false);
        }
        let build = self.build;
        let channel = self.channel(direction);
        let rested = channel.rests();
        let doorbell = channel.write(&build, now, at, value, log)?;
        if doorbell && rested {
            faults.channel_begins(build.core, direction);
        }
        if at == DMACR.offset && channel.stopping() {
            match faults.at_halt(build.core, direction) {
                Some(FaultKind::HaltDelay { ns }) => channel.halt_later(build.cycles(ns)),
                Some(_) => channel.halt_later(u64::MAX),
                None => {}
            }
        }
        Some(doorbell)
    }

    /// Notes that both channels drop what is under way.
    pub(crate) fn abandons_all(&self, now: u64, recorder: &mut Recorder) {
        for channel in [&self.mm2s, &self.s2mm] {
            recorder.abandons((self.build.core, channel.direction), now);
        }
    }

    /// Changes the states that change by time alone.
    pub(crate) fn tick(&mut self, now: u64, recorder: Option<&mut Recorder>) {
        if self.reset_until.is_some_and(|until| until <= now) {
            self.reset_until = None;
            self.mm2s = Channel::new(Direction::Mm2s);
            self.s2mm = Channel::new(Direction::S2mm);
        }
        let halted = [&mut self.mm2s, &mut self.s2mm]
            .map(|channel| channel.tick(now).then_some(channel.direction));
        if let Some(recorder) = recorder {
            for direction in halted.into_iter().flatten() {
                recorder.abandons((self.build.core, direction), now);
            }
        }
    }

    /// The cycle of the next change by time alone.
    pub(crate) fn next_event(&self) -> Option<u64> {
        [self.reset_until, self.mm2s.next_event(), self.s2mm.next_event()]
            .into_iter()
            .flatten()
            .min()
    }

    /// Whether either engine has work.
    pub(crate) fn running(&self) -> bool {
        let works = |channel: &Channel| !matches!(channel.work, Work::None);
        works(&self.mm2s) || works(&self.s2mm)
    }

    /// Whether the engine of a channel has no work.
    pub(crate) fn rests(&self, direction: Direction) -> bool {
        match direction {
            Direction::Mm2s => self.mm2s.rests(),
            Direction::S2mm => self.s2mm.rests(),
        }
    }

    /// Whether an enabled interrupt stands.
    pub(crate) fn interrupt(&self) -> bool {
        self.reset_until.is_none() && (self.mm2s.interrupt() || self.s2mm.interrupt())
    }

    /// Moves up to `limit` beats of one channel until cycle `end`. Returns their number, and
    /// whether any state changed.
    #[inline]
    pub(crate) fn run(
        &mut self,
        direction: Direction,
        start: u64,
        end: u64,
        limit: usize,
        stream: &mut Stream,
        with: &mut Surroundings<'_>,
    ) -> (usize, bool) {
        if self.reset_until.is_some() {
            return (0, false);
        }
        let build = self.build;
        let channel = self.channel(direction);
        if channel.cannot_move(stream) {
            channel.time = channel.time.max(start);
            if let Some(recorder) = &mut with.recorder {
                channel.note_rest(&build, stream, recorder);
            }
            return (0, false);
        }
        let outcome = channel.run(&build, start, end, limit, stream, with);
        if let Some(recorder) = &mut with.recorder {
            if channel.has_failed() {
                recorder.abandons((build.core, direction), channel.time);
            }
            channel.note_rest(&build, stream, recorder);
        }
        outcome
    }
}
