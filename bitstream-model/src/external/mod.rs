//! An accelerator that is not the built-in model, behind the same streams, DMAs and clock.
//!
//! The board keeps a model beside it, which computes nothing: it knows which registers exist, which
//! accesses are violations, and which packets a step has, so that faults can be placed in them.

mod lock_step;
mod model;
mod process;
mod serve;

pub use lock_step::{Difference, DifferencePlace, LockStep, same_number};
pub use model::ModelAccelerator;
pub use process::SimulatorProcess;
pub use serve::{RequestError, serve};

pub use crate::stream::StreamBeat;

use std::fmt;
use std::time::Duration;

use crate::accelerator::{Accelerator, Ran};
use crate::fault::Faults;
use crate::stream::Stream;
use crate::violation::Log;
use pgs_interface::control::{AP_CTRL, RESET, ap_ctrl, reset};

/// Beats of each stream that are offered at once.
const OFFERED_BEATS: usize = 64;
/// Clocks that the accelerator runs before the DMAs move beats again.
const BATCH_CLOCKS: u64 = 64;
/// Most clocks of its reset.
const RESET_CLOCKS: u32 = 8192;
/// Clocks between two looks at its reset.
const RESET_BATCH: u32 = 64;
/// Clocks after a register access of an accelerator that does nothing else.
const SETTLE_CLOCKS: u32 = 4;

/// Beats and space that the streams offer for a number of clocks.
#[derive(Debug, Clone, Default)]
pub struct Offer {
    /// For each MM2S stream the next beats, the oldest first.
    pub beats: Vec<Vec<StreamBeat>>,
    /// For each S2MM stream the number of beats that it takes.
    pub space: Vec<usize>,
}

/// The work of an accelerator in a number of clocks.
#[derive(Debug, Clone, Default)]
pub struct Clocked {
    /// Clocks that have passed.
    pub clocks: u32,
    /// The level of its interrupt.
    pub interrupt: bool,
    /// Whether a step is under way.
    pub busy: bool,
    /// Beats that it took of each MM2S stream.
    pub taken: Vec<usize>,
    /// Beats that it sent on each S2MM stream.
    pub sent: Vec<Vec<StreamBeat>>,
    /// The clock, from 0, in which each of them was sent; empty where that is not known.
    pub sent_at: Vec<Vec<u32>>,
}

/// An accelerator that does not answer as one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExternalError {
    /// It cannot be started.
    #[error("the simulator {path} cannot be started; build one with `rtlgen simulator`")]
    Start {
        /// Its path.
        path: String,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// It was built for another profile.
    #[error("the simulator is built for profile {simulator}, and the board for {board}")]
    Profile {
        /// The simulator's profile.
        simulator: &'static str,
        /// The board's.
        board: &'static str,
    },
    /// It was built for another treatment of hazards.
    #[error("the simulator is built {simulator}, and the board {board}")]
    Hazards {
        /// The simulator's treatment.
        simulator: &'static str,
        /// The board's.
        board: &'static str,
    },
    /// It was built for another form of inertia.
    #[error("the simulator is built for {simulator} inertia, and the board for {board} inertia")]
    Inertia {
        /// The simulator's form.
        simulator: &'static str,
        /// The board's.
        board: &'static str,
    },
    /// It has ended, or its pipes are closed.
    #[error("the simulator has ended in the middle of a request ({act})")]
    Ended {
        /// The request.
        act: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// It did not answer in time.
    #[error("the simulator has not answered for {deadline:?} ({act})")]
    Silent {
        /// The request.
        act: &'static str,
        /// The deadline.
        deadline: Duration,
    },
    /// It answers, and is no accelerator of this interface.
    #[error(
        "the simulator's IDENTIFICATION is {found:#010x}, expected {expected:#010x}: it is no \
         accelerator; build one with `rtlgen simulator`"
    )]
    Identification {
        /// The register's value.
        found: u32,
        /// The value of every accelerator.
        expected: u32,
    },
    /// Its answer contradicts the request.
    #[error(
        "the simulator answers {what} {found}, expected at most {most}; is it one of this version?"
    )]
    Answer {
        /// The name of the count.
        what: &'static str,
        /// The answer.
        found: u32,
        /// The largest sensible answer.
        most: u32,
    },
    /// It is not the model's equal.
    #[error("hardware and model differ: {0}")]
    Difference(Box<Difference>),
}

/// An accelerator: registers, a clock, streams and an interrupt.
pub trait ExternalAccelerator: fmt::Debug + Send {
    /// Reads the register at an offset of the control block.
    ///
    /// # Errors
    /// [`ExternalError`] if there is no sensible answer in time.
    fn read(&mut self, offset: u32) -> Result<u32, ExternalError>;

    /// Writes the register at an offset of the control block.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    fn write(&mut self, offset: u32, value: u32) -> Result<(), ExternalError>;

    /// Lets up to `limit` clocks pass, at least one. It stops early where its interrupt rises.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    fn run(&mut self, limit: u32, offer: &Offer) -> Result<Clocked, ExternalError>;
}

/// An external accelerator in its place on the board.
#[derive(Debug)]
pub(crate) struct External {
    accelerator: Box<dyn ExternalAccelerator>,
    busy: bool,
    starts: bool,
    interrupt: bool,
    /// Why it is dead, if it is.
    error: Option<ExternalError>,
}

impl External {
    pub(crate) fn new(accelerator: Box<dyn ExternalAccelerator>) -> Self {
        Self { accelerator, busy: false, starts: false, interrupt: false, error: None }
    }

    pub(crate) fn error(&self) -> Option<&ExternalError> {
        self.error.as_ref()
    }

    pub(crate) fn busy(&self) -> bool {
        self.error.is_none() && self.busy
    }

    pub(crate) fn starts(&self) -> bool {
        self.error.is_none() && self.starts
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.error.is_none() && self.interrupt
    }

    /// A dead accelerator reads all ones, as a bus without an answer does.
    fn answer<T>(&mut self, answer: Result<T, ExternalError>) -> Option<T> {
        match answer {
            Ok(answer) => Some(answer),
            Err(error) => {
                self.error.get_or_insert(error);
                None
            }
        }
    }

    fn alive(&self) -> bool {
        self.error.is_none()
    }

    pub(crate) fn read(&mut self, offset: u32) -> u32 {
        if !self.alive() {
            return u32::MAX;
        }
        let value = self.accelerator.read(offset);
        let value = self.answer(value).unwrap_or(u32::MAX);
        self.settle(SETTLE_CLOCKS);
        value
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        if !self.alive() {
            return;
        }
        let written = self.accelerator.write(offset, value);
        self.answer(written);
        let starts = offset == AP_CTRL.offset && ap_ctrl::START.is_set(value);
        let resets = offset == RESET.offset && value & 1 != 0;
        self.starts |= starts && !self.busy;
        self.busy |= starts;
        if resets {
            self.busy = false;
            self.starts = false;
            self.reset();
        } else if !starts {
            self.settle(SETTLE_CLOCKS);
        }
    }

    /// Lets clocks pass until its reset has ended.
    fn reset(&mut self) {
        let mut clocks = 0;
        while clocks < RESET_CLOCKS && self.alive() {
            self.settle(RESET_BATCH);
            clocks += RESET_BATCH;
            let reset = self.accelerator.read(RESET.offset);
            if self.answer(reset) == Some(0) {
                break;
            }
        }
    }

    /// Lets clocks pass in which it has neither beats nor space.
    fn settle(&mut self, clocks: u32) {
        if !self.busy {
            self.clock(clocks, &Offer::default());
        }
    }

    fn clock(&mut self, limit: u32, offer: &Offer) -> Clocked {
        let clocked = self.accelerator.run(limit, offer);
        let clocked = self.answer(clocked).unwrap_or_default();
        self.interrupt = clocked.interrupt;
        self.busy = clocked.busy;
        clocked
    }

    /// Works for up to `limit` cycles on the beats that have arrived.
    pub(crate) fn run(&mut self, limit: u64, inputs: &mut [Stream], outputs: &mut [Stream]) -> Ran {
        self.starts = false;
        let mut offer = Offer::default();
        for stream in &mut *inputs {
            let beats = stream.len().min(OFFERED_BEATS);
            offer.beats.push(stream.marked_beats(beats));
        }
        offer.space.extend(outputs.iter().map(Stream::space));
        let limit = u32::try_from(limit.min(BATCH_CLOCKS)).unwrap_or(1);
        let clocked = self.clock(limit, &offer);
        for (stream, taken) in inputs.iter_mut().zip(&clocked.taken) {
            stream.pop(*taken);
        }
        for (stream, sent) in outputs.iter_mut().zip(&clocked.sent) {
            for beat in sent {
                stream.push(&[beat.beat]);
                if beat.last {
                    stream.mark_last();
                }
                if beat.partial {
                    stream.mark_partial();
                }
            }
        }
        Ran { cycles: clocked.clocks.into(), progressed: clocked.clocks > 0, loaded: false }
    }
}

/// The accelerator of a board: the model, alone or as the shadow of an external one.
#[derive(Debug)]
pub(crate) struct Installed {
    pub(crate) model: Accelerator,
    external: Option<External>,
}

impl Installed {
    pub(crate) fn new(model: Accelerator, external: Option<Box<dyn ExternalAccelerator>>) -> Self {
        Self { model, external: external.map(External::new) }
    }

    /// A new model takes the model's place, and an external accelerator is reset. The stages so far
    /// stay in the recording.
    pub(crate) fn load_anew(&mut self, mut model: Accelerator) {
        model.watch_after(&mut self.model);
        self.model = model;
        if let Some(external) = &mut self.external {
            external.write(RESET.offset, reset::RESET.mask());
        }
    }

    pub(crate) fn error(&self) -> Option<&ExternalError> {
        self.external.as_ref().and_then(External::error)
    }

    /// Reads a register; `None` where there is none.
    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        let modelled = self.model.read(offset)?;
        Some(self.external.as_mut().map_or(modelled, |external| external.read(offset)))
    }

    /// Writes a register. Returns whether it was a doorbell, or `None` where there is no register.
    pub(crate) fn write(
        &mut self,
        now: u64,
        offset: u32,
        value: u32,
        log: &mut Log,
        faults: &mut Faults,
    ) -> Option<bool> {
        let Some(external) = &mut self.external else {
            return self.model.write(now, offset, value, log, faults);
        };
        let doorbell = self.model.write(now, offset, value, log, faults)?;
        external.write(offset, value);
        Some(doorbell)
    }

    /// Lets a reset end; returns whether it has just ended, which empties the streams.
    pub(crate) fn tick(&mut self, now: u64) -> bool {
        self.model.tick(now)
    }

    pub(crate) fn next_event(&self) -> Option<u64> {
        self.model.next_event()
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.external.as_ref().map_or_else(|| self.model.interrupt(), External::interrupt)
    }

    /// Whether a step is under way.
    pub(crate) fn running(&self) -> bool {
        self.external.as_ref().map_or_else(|| self.model.running(), External::busy)
    }

    /// Whether a step begins with the next run.
    pub(crate) fn starts(&self) -> bool {
        self.external.as_ref().map_or_else(|| self.model.starts(), External::starts)
    }

    /// Lets `cycles` pass in which nothing could be done for want of beats or space.
    pub(crate) fn starve(&mut self, cycles: u64) {
        if self.external.is_none() {
            self.model.starve(cycles);
        }
    }

    /// Works for up to `limit` cycles on what has arrived, then returns.
    pub(crate) fn run(
        &mut self,
        limit: u64,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
        faults: &mut Faults,
    ) -> Ran {
        let Some(external) = &mut self.external else {
            return self.model.run(limit, inputs, outputs, faults);
        };
        if external.starts() {
            self.model.shadow_start(faults);
        }
        if external.busy() { external.run(limit, inputs, outputs) } else { Ran::default() }
    }
}
