//! The requests of a step, to play it again on a simulator that writes a waveform.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::super::{Clocked, ExternalAccelerator, ExternalError, Offer, SimulatorProcess};
use pgs_interface::control::{AP_CTRL, ISR, RESET};

/// Beats that are kept: with more in a step, it cannot be played again.
const BEATS_MAX: usize = 4 << 20;
/// Clocks that the waveform shows.
const SHOWN_CLOCKS: u64 = 400;

#[derive(Debug)]
enum Request {
    Read(u32),
    Write(u32, u32),
    Run(u32, Offer),
}

/// The registers as a step found them, and its requests.
#[derive(Debug, Default)]
pub(super) struct History {
    registers: BTreeMap<u32, u32>,
    step: Vec<Request>,
    beats: usize,
}

/// Why there is no waveform.
#[derive(Debug, thiserror::Error)]
pub(super) enum NoWaveform {
    #[error("the step has more than {BEATS_MAX} beats")]
    Long,
    #[error("the simulator has none; build it with `rtlgen simulator --waveform`")]
    NotBuilt,
    #[error(transparent)]
    Simulator(#[from] ExternalError),
}

impl History {
    /// A step begins.
    pub(super) fn start(&mut self) {
        self.step.clear();
        self.beats = 0;
    }

    pub(super) fn read(&mut self, offset: u32) {
        self.add(Request::Read(offset));
    }

    pub(super) fn write(&mut self, offset: u32, value: u32) {
        if ![AP_CTRL, ISR, RESET].map(|register| register.offset).contains(&offset) {
            self.registers.insert(offset, value);
        }
        self.add(Request::Write(offset, value));
    }

    /// Clocks that have passed, with the beats that were taken in them.
    pub(super) fn run(&mut self, clocked: &Clocked, offer: &Offer) {
        let beats = offer.beats.iter().zip(&clocked.taken).map(|(beats, taken)| {
            let taken = beats.len().min(*taken);
            beats[..taken].to_vec()
        });
        let beats: Vec<_> = beats.collect();
        self.beats += beats.iter().map(Vec::len).sum::<usize>();
        self.add(Request::Run(clocked.clocks, Offer { beats, space: offer.space.clone() }));
    }

    fn add(&mut self, request: Request) {
        if self.beats <= BEATS_MAX {
            self.step.push(request);
        }
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
        if self.beats > BEATS_MAX {
            return Err(NoWaveform::Long);
        }
        let waveform = simulator.with_extension("vcd");
        let arguments = ["0", "0", "1"].map(str::to_owned).into_iter();
        let arguments: Vec<_> = arguments.chain([waveform.display().to_string()]).collect();
        let mut process = SimulatorProcess::start_with(simulator, &arguments)?;
        // The registers as the step found them; a value that the step wrote itself comes again.
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
