//! Runs the emulated board: DMAs, streams, accelerator and memory on one virtual clock.
//!
//! Time passes with each register access, and while the CPU waits; nothing happens inside a
//! register write. The clock is the accelerator's; the DMAs run on it too.

mod bus;
mod interrupt;

use self::bus::Target;
use self::interrupt::InterruptLine;
use crate::accelerator::{Accelerator, Ran};
use crate::arbiter::{Arbiter, Turn};
use crate::axi_dma::{Core, Moved, PacketCount, Surroundings, WriteContext};
use crate::config::BoardConfig;
use crate::config::quirks::InterruptWiring;
use crate::external::{ExternalAccelerator, ExternalError, Installed};
use crate::fast::{Fast, Parts};
use crate::fault::{Fault, FaultKind, Faults};
use crate::memory::Memory;
use crate::recording::{Recorder, Recording};
use crate::stream::Stream;
use crate::violation::{Log, RegisterAccess, ViolationKind};
use pgs_interface::axi_dma::Direction;
use pgs_interface::control::IDENTIFICATION;

/// Cycles between two polls of the streams by a waiting accelerator.
pub(crate) const STARVED_CYCLES: u64 = 64;

/// Events on a board since it was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Counts {
    /// Register reads by the CPU.
    pub register_reads: u64,
    /// Register writes by the CPU.
    pub register_writes: u64,
    /// Writes that started something: TAILDESC, LENGTH, `ap_start`.
    pub doorbells: u64,
    /// Rising edges of the interrupt line.
    pub interrupts: u64,
    /// Beats read from memory by the DMAs.
    pub beats_read: u64,
    /// Beats written to memory by the DMAs.
    pub beats_written: u64,
    /// Descriptors completed.
    pub descriptors: u64,
    /// Violations, in the log or beyond its capacity.
    pub violations: u64,
    /// Clock cycles since the board was built.
    pub cycles: u64,
}

/// The board's state.
#[derive(Debug)]
pub(crate) struct Board {
    pub(crate) config: BoardConfig,
    pub(crate) now: u64,
    pub(crate) memory: Memory,
    pub(crate) interrupt: InterruptLine,
    pub(crate) log: Log,
    cores: Vec<Core>,
    accelerator: Installed,
    inputs: Vec<Stream>,
    outputs: Vec<Stream>,
    moved: Moved,
    faults: Faults,
    /// The programmable logic has lost its power.
    powerless: bool,
    /// The IDENTIFICATION of another design, if one was loaded.
    other_design: Option<u32>,
    counts: Counts,
    arbiter: Arbiter,
    turn: Turn,
    /// `None`: the board moves and computes everything slice by slice.
    fast: Option<Box<Fast>>,
    /// The run in which the fast way has taken the step: the cycle at which it began, and its
    /// cycles so far.
    taken: Option<(u64, u64)>,
    /// Cycles of a run that the reference goes on with.
    ran: u64,
    recorder: Option<Box<Recorder>>,
}

impl Board {
    /// Builds a board with the built-in accelerator, with the fast way or without, or with another
    /// accelerator, which has to compute itself.
    pub(crate) fn new(
        config: BoardConfig,
        memory: Memory,
        fast: Option<Box<Fast>>,
        external: Option<Box<dyn ExternalAccelerator>>,
    ) -> Self {
        let profile = config.profile;
        let streams = |widths: &[u32]| {
            widths.iter().map(|_| Stream::new(config.delays.fifo_beats)).collect::<Vec<_>>()
        };
        let inputs = streams(profile.mm2s_widths);
        let outputs = streams(profile.s2mm_widths);
        let cores = inputs.len().max(outputs.len());
        Self {
            config,
            now: 0,
            memory,
            interrupt: InterruptLine::default(),
            log: Log::new(),
            cores: (0..cores).map(|core| Core::new(core, &config)).collect(),
            accelerator: Installed::new(Accelerator::new(&config), external),
            inputs,
            outputs,
            moved: Moved::default(),
            faults: Faults::default(),
            powerless: false,
            other_design: None,
            counts: Counts::default(),
            arbiter: Arbiter::new(&config, cores),
            turn: Turn::default(),
            fast,
            taken: None,
            ran: 0,
            recorder: None,
        }
    }

    pub(crate) fn counts(&mut self) -> Counts {
        self.catch_up();
        Counts {
            interrupts: self.interrupt.rising_edges,
            beats_read: self.moved.beats_read,
            beats_written: self.moved.beats_written,
            descriptors: self.moved.descriptors,
            violations: self.log.count,
            cycles: self.now,
            ..self.counts
        }
    }

    pub(crate) fn inject(&mut self, fault: Fault) {
        self.catch_up();
        self.faults.inject(fault);
    }

    pub(crate) fn clear_faults(&mut self) {
        self.faults.clear();
    }

    /// Faults that have happened.
    pub(crate) fn faults(&self) -> u64 {
        self.faults.happened()
    }

    /// Why the external accelerator does not answer any more.
    pub(crate) fn accelerator_error(&self) -> Option<&ExternalError> {
        self.accelerator.error()
    }

    /// The packets that ended since the last step began.
    pub(crate) fn packets(&mut self) -> &[PacketCount] {
        self.catch_up();
        &self.moved.packets
    }

    /// Records from now on.
    pub(crate) fn start_recording(&mut self) {
        self.catch_up();
        let clock = (self.config.profile.clock_khz, self.access_cycles());
        let level = self.interrupt.level();
        let recorder = Recorder::new(self.now, clock, self.cores.len(), level);
        self.recorder = Some(Box::new(recorder));
        self.accelerator.model.watch_stages(self.now);
    }

    /// Ends the recording.
    pub(crate) fn take_recording(&mut self) -> Option<Recording> {
        let recorder = self.recorder.take()?;
        Some(recorder.finish(self.now, self.accelerator.model.take_stages()))
    }

    /// Applies the due faults of the board as a whole; with `access`, also the faults of a register
    /// access.
    fn apply_due_faults(&mut self, access: bool) {
        match self.faults.of_board(access) {
            Some(FaultKind::PowerLost) => self.powerless = true,
            Some(FaultKind::OtherBitstream { identification }) => {
                self.other_design = Some(identification);
                self.load_anew();
            }
            Some(FaultKind::Reloaded) => self.load_anew(),
            Some(FaultKind::IrqSpurious) => self.interrupt.disturb(1),
            Some(FaultKind::IrqStorm { count }) => self.interrupt.disturb(count),
            _ => {}
        }
    }

    /// Forgets all state of the logic: every register is as after a reset, the streams are empty.
    fn load_anew(&mut self) {
        self.log.pardon();
        for (number, core) in self.cores.iter_mut().enumerate() {
            if let Some(recorder) = &mut self.recorder {
                core.abandons_all(self.now, recorder);
            }
            *core = Core::new(number, &self.config);
        }
        self.accelerator.load_anew(Accelerator::new(&self.config));
        self.inputs.iter_mut().chain(&mut self.outputs).for_each(Stream::clear);
    }

    /// Whether the accelerator or a DMA engine has work.
    pub(crate) fn running(&self) -> bool {
        self.accelerator.running() || self.cores.iter().any(Core::running)
    }

    /// Whether the board is dead: without power, or strict and after its first violation.
    fn dead(&self) -> bool {
        self.powerless || self.config.strict && self.log.count > 0
    }

    fn access_cycles(&self) -> u64 {
        let cycles =
            self.config.delays.register_access_ns * u64::from(self.config.profile.clock_khz);
        cycles.div_ceil(1_000_000)
    }

    fn record(&mut self, address: u64, write: bool, value: u32) {
        let access = RegisterAccess { cycle: self.now, address, write, value };
        self.log.access(access);
        if let Some(recorder) = &mut self.recorder {
            recorder.access(access);
        }
    }

    pub(crate) fn read32(&mut self, address: u64) -> u32 {
        self.catch_up();
        self.counts.register_reads += 1;
        self.advance(self.now + self.access_cycles(), false);
        self.apply_due_faults(true);
        if self.dead() {
            self.record(address, false, u32::MAX);
            return u32::MAX;
        }
        let found = match bus::decode(address, self.cores.len()) {
            Target::Dma { core, offset } => {
                self.cores[core].read(offset).ok_or(ViolationKind::ReservedRegister { address })
            }
            Target::Control { offset } if self.other_design.is_some() => {
                let identification = self.other_design.filter(|_| offset == IDENTIFICATION.offset);
                Ok(identification.unwrap_or(0))
            }
            Target::Control { offset } => {
                self.accelerator.read(offset).ok_or(ViolationKind::ReservedRegister { address })
            }
            Target::Nothing => Err(ViolationKind::UnmappedRegister { address }),
            Target::Unaligned => Err(ViolationKind::UnalignedRegister { address }),
        };
        let value = found.as_ref().copied().unwrap_or(0);
        self.record(address, false, value);
        if let Err(kind) = found {
            self.log.violation(kind);
        }
        self.update_interrupt();
        if self.dead() { u32::MAX } else { value }
    }

    pub(crate) fn write32(&mut self, address: u64, value: u32) {
        self.catch_up();
        self.counts.register_writes += 1;
        self.advance(self.now + self.access_cycles(), false);
        self.apply_due_faults(true);
        self.record(address, true, value);
        if self.dead() {
            return;
        }
        let (now, log, faults) = (self.now, &mut self.log, &mut self.faults);
        let done = match bus::decode(address, self.cores.len()) {
            Target::Dma { core, offset } => {
                let recorder = self.recorder.as_deref_mut();
                let with = WriteContext { log, faults, recorder };
                let done = self.cores[core].write(now, offset, value, with);
                done.ok_or(ViolationKind::ReservedRegister { address })
            }
            Target::Control { .. } if self.other_design.is_some() => Ok(false),
            Target::Control { offset } => self
                .accelerator
                .write(now, offset, value, log, faults)
                .ok_or(ViolationKind::ReservedRegister { address }),
            Target::Nothing => Err(ViolationKind::UnmappedRegister { address }),
            Target::Unaligned => Err(ViolationKind::UnalignedRegister { address }),
        };
        match done {
            Ok(true) => {
                self.counts.doorbells += 1;
                if let Some(recorder) = &mut self.recorder {
                    recorder.doorbell(self.now);
                }
            }
            Ok(false) => {}
            Err(kind) => self.log.violation(kind),
        }
        self.update_interrupt();
    }

    fn update_interrupt(&mut self) {
        let source = || self.accelerator.interrupt() || self.cores.iter().any(Core::interrupt);
        let level = match self.config.quirks.interrupt {
            InterruptWiring::Connected => source(),
            InterruptWiring::Disconnected => false,
            InterruptWiring::StuckHigh => true,
        };
        let level = level && !self.dead();
        if self.interrupt.rises(level) {
            match self.faults.at_edge() {
                Some(FaultKind::IrqDelay { ns }) => {
                    let until = self.now.saturating_add(self.config.cycles(ns));
                    self.interrupt.withhold(until);
                }
                Some(_) => self.interrupt.withhold(u64::MAX),
                None => {}
            }
        }
        self.interrupt.set(level, self.now);
        if let Some(recorder) = &mut self.recorder {
            recorder.interrupt(self.now, self.interrupt.level());
        }
    }

    /// Lets time pass until `until`; with `watch`, only until an interrupt is pending.
    pub(crate) fn advance(&mut self, until: u64, watch: bool) {
        while self.now < until && !(watch && self.interrupt.pending()) {
            self.log.at(self.now);
            if self.dead() {
                self.now = until;
                break;
            }
            self.tick();
            if self.taken.is_some() {
                self.pass_taken_step(until);
                continue;
            }
            let event = self.next_event().map_or(until, |event| event.min(until));
            let limit = event - self.now;
            if self.accelerator.starts() {
                self.moved.packets.clear();
                self.accelerator.model.step_begins_at(self.now);
            }
            let mut ran = self.run_accelerator(limit);
            if ran.loaded {
                if self.takes_step(ran.cycles, until, watch) {
                    continue;
                }
                self.ran = ran.cycles;
                ran = Ran { progressed: true, ..self.run_accelerator(limit) };
            }
            if let (Some(recorder), Some(sent)) =
                (&mut self.recorder, self.accelerator.model.sent_at())
            {
                recorder.sent_at(sent);
            }
            let waits = ran.cycles == 0;
            let mut slice = if waits { limit.min(STARVED_CYCLES) } else { ran.cycles };
            if waits && ran.progressed {
                slice = 0;
            }
            let moved = self.move_beats(self.now, self.now + slice);
            if waits && !ran.progressed && !moved {
                // Nothing will change before the next event.
                slice = limit;
            }
            if waits && slice > 0 && self.accelerator.running() {
                self.accelerator.starve(slice);
                if let Some(recorder) = &mut self.recorder {
                    recorder.waits(self.now, slice);
                }
            }
            self.now += slice;
            self.apply_due_faults(false);
            self.tick();
            self.update_interrupt();
        }
        self.log.at(self.now);
    }

    /// Lets the accelerator work for up to `limit` cycles; a run that has begun before goes on.
    fn run_accelerator(&mut self, limit: u64) -> Ran {
        let before = std::mem::take(&mut self.ran);
        let (inputs, outputs) = (&mut self.inputs, &mut self.outputs);
        let left = limit.saturating_sub(before);
        let ran = self.accelerator.run(left, inputs, outputs, &mut self.faults);
        Ran { cycles: before + ran.cycles, ..ran }
    }

    /// Takes the whole rest of a step at once, if the board can, and the host does nothing until
    /// its end or waits for the interrupt. The accelerator has run for some cycles from now on.
    fn takes_step(&mut self, ran: u64, until: u64, waits: bool) -> bool {
        // A recording has the clock of every beat.
        let undisturbed = self.recorder.is_none()
            && self.faults.spare_this_step()
            && self.config.quirks.unconnected.is_none()
            && self.interrupt.next_event().is_none();
        let taken =
            undisturbed && self.with_fast(|fast, board| fast.take(ran, until, waits, board));
        self.taken = taken.then_some((self.now, ran));
        taken
    }

    /// Lets time pass while a step is under way that was taken at once; at its end it is to be
    /// seen.
    fn pass_taken_step(&mut self, until: u64) {
        let end = self.fast.as_ref().and_then(|fast| fast.end()).unwrap_or(self.now);
        self.now = end.min(until);
        if self.now < end {
            return;
        }
        if self.with_fast(Fast::finish) {
            self.taken = None;
            self.tick();
            self.update_interrupt();
        } else {
            self.catch_up();
        }
    }

    /// Has the reference take the step up to now that the fast way has taken, so that a host or an
    /// observer who acts before its end finds the state of the reference at this cycle, and none
    /// other.
    pub(crate) fn catch_up(&mut self) {
        let Some((from, ran)) = self.taken.take() else { return };
        if let Some(fast) = &mut self.fast {
            fast.forget(&mut self.accelerator.model, &self.memory);
        }
        let now = std::mem::replace(&mut self.now, from);
        self.ran = ran;
        self.advance(now, false);
    }

    fn with_fast(&mut self, act: impl FnOnce(&mut Fast, &mut Parts<'_>) -> bool) -> bool {
        let Some(fast) = &mut self.fast else { return false };
        let mut parts = Parts {
            now: self.now,
            accelerator: &mut self.accelerator.model,
            cores: &mut self.cores,
            inputs: &mut self.inputs,
            outputs: &mut self.outputs,
            arbiter: self.arbiter,
            with: Surroundings {
                memory: &mut self.memory,
                log: &mut self.log,
                moved: &mut self.moved,
                faults: &mut self.faults,
                counts_only: false,
                recorder: None,
            },
        };
        act(fast, &mut parts)
    }

    fn tick(&mut self) {
        for core in &mut self.cores {
            core.tick(self.now, self.recorder.as_deref_mut());
        }
        if self.accelerator.tick(self.now) {
            self.inputs.iter_mut().chain(&mut self.outputs).for_each(Stream::clear);
        }
    }

    /// The next cycle after now at which a state changes by time alone.
    fn next_event(&self) -> Option<u64> {
        self.cores
            .iter()
            .map(Core::next_event)
            .chain([self.accelerator.next_event(), self.interrupt.next_event()])
            .flatten()
            .filter(|event| *event > self.now)
            .min()
    }

    /// Lets every DMA engine work between two clocks; returns whether any did something.
    fn move_beats(&mut self, start: u64, end: u64) -> bool {
        let (arbiter, mut turn) = (self.arbiter, self.turn);
        let mut any = false;
        let held_up = arbiter.share(&mut turn, end - start, |engine, limit| {
            let (moved, changed) = self.run_engine(engine, start, end, limit);
            any |= changed;
            moved
        });
        self.turn = turn;
        // While the bandwidth holds the engines up, time alone brings progress.
        any || held_up
    }

    fn run_engine(&mut self, engine: usize, start: u64, end: u64, limit: usize) -> (usize, bool) {
        let number = engine / 2;
        let (direction, stream) = if engine.is_multiple_of(2) {
            (Direction::Mm2s, self.inputs.get_mut(number))
        } else {
            (Direction::S2mm, self.outputs.get_mut(number))
        };
        let Some(stream) = stream else { return (0, false) };
        if self.config.quirks.unconnected == Some((number, direction)) {
            return (0, false);
        }
        let mut with = Surroundings {
            memory: &mut self.memory,
            log: &mut self.log,
            moved: &mut self.moved,
            faults: &mut self.faults,
            counts_only: false,
            recorder: self.recorder.as_deref_mut(),
        };
        self.cores[number].run(direction, start, end, limit, stream, &mut with)
    }
}
