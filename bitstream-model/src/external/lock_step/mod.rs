//! Hardware and the model side by side, on the same beats and register accesses. The hardware
//! leads: the board sees its registers, its results and its interrupt. The first difference ends
//! the step.
//!
//! ```text
//! register accesses, clocks ----> hardware ----> the board
//!                        |            |
//!                        |            v beats that it took
//!                        +-------> model ------> compared with the hardware
//! ```

mod difference;
mod history;

use std::collections::VecDeque;
use std::path::PathBuf;

pub use self::difference::{Difference, DifferencePlace, same_number};
use self::difference::{Sent, first_difference};
use self::history::History;
use super::{Clocked, ExternalAccelerator, ExternalError, ModelAccelerator, Offer, StreamBeat};
use crate::config::{BoardConfig, ConfigError};
use pgs_interface::control::{
    AP_CTRL, BODY_CAPACITY, COLLISION_CAPACITY, COLLISIONS, CONTACT_ITERATIONS, CYCLES_HI,
    CYCLES_LO, ERROR, ERROR_DETAIL, FLAGS, FRICTION_ITERATIONS, HAZARDS, IMPULSE_SUM_HI,
    IMPULSE_SUM_LO, MEMORY_BYTES, RESET, SUM_RECEIVED, SUM_SENT, WAIT_CYCLES, WORK_CYCLES, ap_ctrl,
    flags, reset,
};
use pgs_interface::register::Register;

/// Most clocks between the end of a step in the hardware and in the model. Clocks in which the
/// hardware waits for space do not count.
const APART_CLOCKS: u64 = 100_000;
/// Clocks that the model catches up at once.
const CATCH_UP_BATCH: u32 = 64;
/// Beats of each stream that the model is offered at once.
const OFFERED_BEATS: usize = 256;
/// Space for results of the model: it never waits.
const SPACE: usize = 1 << 20;

/// Registers that differ between two right accelerators: times, which depend on the moment at which
/// beats come, and capacities, which are parameters of a build. The end of a step compares the
/// sums.
const NOT_COMPARED: &[Register] = &[
    CYCLES_LO,
    CYCLES_HI,
    WAIT_CYCLES,
    HAZARDS,
    SUM_SENT,
    BODY_CAPACITY,
    COLLISION_CAPACITY,
    MEMORY_BYTES,
];

/// Registers that a step without an error leaves the same in two right accelerators.
const COUNTERS: &[Register] = &[WORK_CYCLES, SUM_RECEIVED, IMPULSE_SUM_LO, IMPULSE_SUM_HI];

/// Hardware with the model beside it.
#[derive(Debug)]
pub struct LockStep {
    hardware: Box<dyn ExternalAccelerator>,
    model: ModelAccelerator,
    config: BoardConfig,
    /// A simulator that plays a step again and writes a waveform.
    player: Option<PathBuf>,
    /// The requests of the step, for the player.
    history: History,
    /// Beats of each stream that the hardware has taken and the model has yet to take.
    owed: Vec<VecDeque<StreamBeat>>,
    results: Vec<Results>,
    /// The beats that the step sends.
    sent: Sent,
    /// Clocks since the last start or reset.
    cycle: u64,
    busy: bool,
    model_busy: bool,
    /// Clocks in which the hardware went on after the model's end.
    alone: u64,
    /// Whether the hardware or the model may still be in reset, in which its registers mean
    /// nothing.
    resetting: bool,
    /// Whether the last step ended with an error: its counters mean nothing then.
    failed: bool,
    /// Whether a result was not a number: the sum of the words sent means nothing then.
    nan: bool,
}

/// Results on one stream that are not compared yet.
#[derive(Debug, Default)]
struct Results {
    /// Beats that were compared.
    compared: usize,
    hardware: VecDeque<(StreamBeat, u64)>,
    model: VecDeque<StreamBeat>,
}

impl LockStep {
    /// Puts the model beside hardware that is built as `config` says. `player` is the simulator
    /// that plays a differing step again for its waveform.
    ///
    /// # Errors
    /// [`ConfigError`] if a number is outside its range.
    pub fn new(
        config: &BoardConfig,
        hardware: Box<dyn ExternalAccelerator>,
        player: Option<PathBuf>,
    ) -> Result<Self, ConfigError> {
        let model = ModelAccelerator::new(config)?;
        let inputs = config.profile.mm2s_widths.iter().map(|_| VecDeque::new()).collect();
        let outputs = config.profile.s2mm_widths.iter().map(|_| Results::default()).collect();
        Ok(Self {
            hardware,
            model,
            config: *config,
            history: History::new(player.is_some()),
            player,
            owed: inputs,
            results: outputs,
            sent: Sent::default(),
            cycle: 0,
            busy: false,
            model_busy: false,
            alone: 0,
            resetting: false,
            failed: false,
            nan: false,
        })
    }

    fn differs<T>(
        &self,
        place: DifferencePlace,
        cycle: u64,
        [model, hardware]: [u32; 2],
    ) -> Result<T, ExternalError> {
        let waveform = match &self.player {
            Some(player) => self.history.waveform(player).map(Some),
            None => Ok(None),
        };
        let (waveform, no_waveform) = match waveform {
            Ok(waveform) => (waveform, None),
            Err(reason) => (None, Some(reason.to_string())),
        };
        let difference = Difference { place, cycle, model, hardware, waveform, no_waveform };
        Err(ExternalError::Difference(Box::new(difference)))
    }

    /// Forgets the beats of a step that has ended, or was reset.
    fn forget_beats(&mut self) {
        self.owed.iter_mut().for_each(VecDeque::clear);
        self.results.fill_with(Results::default);
        self.alone = 0;
        self.nan = false;
    }

    /// The beats that a step with the model's arguments sends.
    fn sent_by_step(&mut self) -> Result<Sent, ExternalError> {
        let mut read = |register: Register| self.model.read(register.offset);
        let set = read(FLAGS)?;
        let kinds = match flags::IMPULSES_OUT.is_set(set) {
            true => {
                let kinds = [read(CONTACT_ITERATIONS)?, read(FRICTION_ITERATIONS)?];
                kinds.iter().filter(|iterations| **iterations > 0).count()
            }
            false => 0,
        };
        Ok(Sent { impulses: kinds.saturating_mul(read(COLLISIONS)? as usize) })
    }

    /// Lets the model run on the beats that the hardware has taken.
    fn run_model(&mut self, clocks: u32) -> Result<(), ExternalError> {
        let beats = self.owed.iter().map(|beats| beats.iter().take(OFFERED_BEATS).copied());
        let beats = beats.map(Iterator::collect).collect();
        let offer = Offer { beats, space: vec![SPACE; self.results.len()] };
        let clocked = self.model.run(clocks, &offer)?;
        for (beats, taken) in self.owed.iter_mut().zip(&clocked.taken) {
            beats.drain(..*taken);
        }
        for (results, sent) in self.results.iter_mut().zip(clocked.sent) {
            results.model.extend(sent);
        }
        self.model_busy = clocked.busy;
        Ok(())
    }

    /// Compares the results that both have sent.
    fn compare_results(&mut self) -> Result<(), ExternalError> {
        for stream in 0..self.results.len() {
            let results = &mut self.results[stream];
            while let (Some(model), Some((hardware, cycle))) =
                (results.model.front(), results.hardware.front())
            {
                let at = (stream, results.compared);
                let found = first_difference(&self.config, &self.sent, at, model, hardware);
                if let Some((place, values)) = found {
                    let cycle = *cycle;
                    return self.differs(place, cycle, values);
                }
                self.nan |= model.beat.0.iter().any(|bits| f32::from_bits(*bits).is_nan());
                results.model.pop_front();
                results.hardware.pop_front();
                results.compared += 1;
            }
        }
        Ok(())
    }

    /// Lets the model end its step.
    fn catch_up(&mut self) -> Result<(), ExternalError> {
        let mut clocks = 0;
        while self.model_busy && clocks < APART_CLOCKS {
            self.run_model(CATCH_UP_BATCH)?;
            clocks += u64::from(CATCH_UP_BATCH);
        }
        match self.model_busy {
            true => self.differs(DifferencePlace::End, self.cycle, [1, 0]),
            false => self.compare_results(),
        }
    }

    /// Compares the registers and the numbers of results that a step leaves.
    fn compare_step(&mut self) -> Result<(), ExternalError> {
        self.compare_registers(&[ERROR, ERROR_DETAIL])?;
        self.failed = self.model.read(ERROR.offset)? != 0;
        if self.failed {
            return Ok(());
        }
        for stream in 0..self.results.len() {
            let results = &self.results[stream];
            let counts = [results.model.len(), results.hardware.len()]
                .map(|more| u32::try_from(results.compared + more).unwrap_or(u32::MAX));
            if counts[0] != counts[1] {
                return self.differs(DifferencePlace::Beats { stream }, self.cycle, counts);
            }
        }
        self.compare_registers(COUNTERS)?;
        if self.nan { Ok(()) } else { self.compare_registers(&[SUM_SENT]) }
    }

    fn compare_registers(&mut self, registers: &[Register]) -> Result<(), ExternalError> {
        for register in registers {
            let hardware = self.hardware.read(register.offset)?;
            self.history.read(register.offset);
            let model = self.model.read(register.offset)?;
            if hardware != model {
                let place = DifferencePlace::Register { offset: register.offset };
                return self.differs(place, self.cycle, [model, hardware]);
            }
        }
        Ok(())
    }
}

impl ExternalAccelerator for LockStep {
    fn read(&mut self, offset: u32) -> Result<u32, ExternalError> {
        let hardware = self.hardware.read(offset)?;
        self.history.read(offset);
        let model = self.model.read(offset)?;
        if self.resetting && offset == RESET.offset {
            let reset = hardware | model;
            self.resetting = reset != 0;
            return Ok(reset);
        }
        let counters = if self.failed { COUNTERS } else { &[] };
        let not_compared = || NOT_COMPARED.iter().chain(counters);
        let compared = !not_compared().any(|register| register.offset == offset);
        if compared && !self.busy && !self.resetting && hardware != model {
            let place = DifferencePlace::Register { offset };
            return self.differs(place, self.cycle, [model, hardware]);
        }
        Ok(hardware)
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), ExternalError> {
        let starts = offset == AP_CTRL.offset && ap_ctrl::START.is_set(value) && !self.busy;
        if starts {
            self.forget_beats();
            self.sent = self.sent_by_step()?;
            self.history.start();
            self.cycle = 0;
            self.busy = true;
            self.model_busy = true;
        }
        if offset == RESET.offset && reset::RESET.is_set(value) {
            self.forget_beats();
            self.busy = false;
            self.model_busy = false;
            self.resetting = true;
            self.cycle = 0;
        }
        self.history.write(offset, value, self.busy && !starts);
        self.hardware.write(offset, value)?;
        self.model.write(offset, value)
    }

    fn run(&mut self, limit: u32, offer: &Offer) -> Result<Clocked, ExternalError> {
        let clocked = self.hardware.run(limit, offer)?;
        self.history.run(&clocked, offer);
        for ((owed, beats), taken) in self.owed.iter_mut().zip(&offer.beats).zip(&clocked.taken) {
            owed.extend(beats.iter().take(*taken));
        }
        for (stream, results) in self.results.iter_mut().enumerate() {
            let sent = clocked.sent.get(stream).into_iter().flatten();
            let clocks = clocked.sent_at.get(stream).map_or(&[][..], Vec::as_slice);
            let clocks =
                clocks.iter().copied().chain(std::iter::repeat(clocked.clocks.saturating_sub(1)));
            let dated = sent.zip(clocks).map(|(beat, at)| (*beat, self.cycle + u64::from(at)));
            results.hardware.extend(dated);
        }
        self.cycle += u64::from(clocked.clocks);
        self.run_model(clocked.clocks)?;
        self.compare_results()?;
        let ended = self.busy && !clocked.busy;
        let waits_for_space = offer.space.contains(&0);
        if self.busy && !self.model_busy && !waits_for_space {
            self.alone += u64::from(clocked.clocks);
        }
        if self.alone > APART_CLOCKS {
            return self.differs(DifferencePlace::End, self.cycle, [0, 1]);
        }
        self.busy = clocked.busy;
        if ended {
            // A wrong beat stops the hardware as it arrives. The model comes to that beat with the
            // beats of the other streams, which the hardware has not taken any more.
            self.history.read(ERROR.offset);
            if self.hardware.read(ERROR.offset)? != 0 {
                let offered = offer.beats.iter().zip(&clocked.taken);
                for (owed, (beats, taken)) in self.owed.iter_mut().zip(offered) {
                    owed.extend(beats.iter().skip(*taken));
                }
            }
            self.catch_up()?;
            self.compare_step()?;
        }
        Ok(clocked)
    }
}
