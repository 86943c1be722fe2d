//! The requests of a step, to play it again on a simulator that writes a waveform.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::super::{Clocked, ExternalAccelerator, ExternalError, Offer, SimulatorProcess};
use pgs_interface::control::{AP_CTRL, GIE, IER, ISR, RESET, reset};

/// Beats and requests that are kept: with more in a step, it cannot be played again.
const BEATS_MAX: usize = 4 << 20;
const REQUESTS_MAX: usize = 1 << 20;
/// Clocks that the waveform shows.
const SHOWN_CLOCKS: u64 = 400;

#[derive(Debug)]
enum Request {
    Read(u32),
    Write(u32, u32),
    Run(u32, Offer),
}

/// The registers as a step found them, and the requests since its start.
#[derive(Debug)]
pub(super) struct History {
    kept: bool,
    registers: BTreeMap<u32, u32>,
    step: Vec<Request>,
    /// Values that were written at rest since the start; the next step finds them.
    written: BTreeMap<u32, u32>,
    beats: usize,
}

/// Why there is no waveform.
#[derive(Debug, thiserror::Error)]
pub(super) enum NoWaveform {
    #[error("the step has more than {BEATS_MAX} beats or {REQUESTS_MAX} requests")]
    Long,
    #[error(
        "the simulator writes none, or not beside itself; build it with `rtlgen simulator \
         --waveform` in a folder that can be written"
    )]
    NotBuilt,
    #[error(transparent)]
    Simulator(#[from] ExternalError),
}

impl History {
    /// A history that keeps requests, or one that forgets them at once.
    pub(super) fn new(kept: bool) -> Self {
        let (registers, written) = (BTreeMap::new(), BTreeMap::new());
        Self { kept, registers, step: Vec::new(), written, beats: 0 }
    }

    /// A step begins.
    pub(super) fn start(&mut self) {
        self.registers.append(&mut self.written);
        self.step.clear();
        self.beats = 0;
    }

    pub(super) fn read(&mut self, offset: u32) {
        self.add(Request::Read(offset));
    }

    /// A write. A busy accelerator takes writes of its interrupt enables alone.
    pub(super) fn write(&mut self, offset: u32, value: u32, busy: bool) {
        if offset == RESET.offset && reset::RESET.is_set(value) {
            self.registers.clear();
            self.written.clear();
        }
        let acts = [AP_CTRL, ISR, RESET].map(|register| register.offset).contains(&offset);
        let interrupt = [GIE, IER].map(|register| register.offset).contains(&offset);
        if self.kept && !acts && (!busy || interrupt) {
            self.written.insert(offset, value);
        }
        self.add(Request::Write(offset, value));
    }

    /// Clocks that have passed, with the beats that were taken in them.
    pub(super) fn run(&mut self, clocked: &Clocked, offer: &Offer) {
        if !self.kept {
            return;
        }
        let beats = offer.beats.iter().zip(&clocked.taken).map(|(beats, taken)| {
            let taken = beats.len().min(*taken);
            beats[..taken].to_vec()
        });
        let beats: Vec<_> = beats.collect();
        self.beats += beats.iter().map(Vec::len).sum::<usize>();
        self.add(Request::Run(clocked.clocks, Offer { beats, space: offer.space.clone() }));
    }

    fn add(&mut self, request: Request) {
        if self.kept && !self.is_full() {
            self.step.push(request);
        }
    }

    fn is_full(&self) -> bool {
        self.beats > BEATS_MAX || self.step.len() >= REQUESTS_MAX
    }

    /// The first request that the waveform shows.
    fn shown_from(&self) -> usize {
        let mut clocks = 0;
        let before = self.step.iter().rposition(|request| {
            if let Request::Run(more, _) = request {
                clocks += u64::from(*more);
            }
            clocks > SHOWN_CLOCKS
        });
        before.unwrap_or(0)
    }

    /// Plays the step again; the path of the waveform of its last clocks.
    pub(super) fn waveform(&self, simulator: &Path) -> Result<PathBuf, NoWaveform> {
        if self.is_full() {
            return Err(NoWaveform::Long);
        }
        let waveform = simulator.with_extension("vcd");
        let arguments = ["0", "0", "1"].map(str::to_owned).into_iter();
        let arguments: Vec<_> = arguments.chain([waveform.display().to_string()]).collect();
        let mut process = SimulatorProcess::start_with(simulator, &arguments)?;
        for (offset, value) in &self.registers {
            process.write(*offset, *value)?;
        }
        let shown_from = self.shown_from();
        for (number, request) in self.step.iter().enumerate() {
            if number == shown_from && !process.record(true)? {
                return Err(NoWaveform::NotBuilt);
            }
            match request {
                Request::Read(offset) => drop(process.read(*offset)?),
                Request::Write(offset, value) => process.write(*offset, *value)?,
                Request::Run(clocks, offer) => drop(process.run((*clocks).max(1), offer)?),
            }
        }
        process.record(false)?;
        Ok(waveform)
    }
}
