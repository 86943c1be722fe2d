//! The built-in model behind the interface of an external accelerator: registers, beats in, beats
//! out, without a board around it.

use super::{Clocked, ExternalAccelerator, ExternalError, Offer, StreamBeat};
use crate::accelerator::Accelerator;
use crate::config::{BoardConfig, ConfigError};
use crate::fault::Faults;
use crate::stream::Stream;
use crate::violation::Log;
use pgs_interface::record::Beat;

/// The model as an accelerator by itself. It computes as the reference does.
#[derive(Debug)]
pub struct ModelAccelerator {
    accelerator: Accelerator,
    inputs: Vec<Stream>,
    outputs: Vec<Stream>,
    log: Log,
    faults: Faults,
    now: u64,
}

impl ModelAccelerator {
    /// Builds the accelerator of a board.
    ///
    /// # Errors
    /// [`ConfigError`] if a number is outside its range.
    pub fn new(config: &BoardConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let streams = |widths: &[u32]| {
            widths.iter().map(|_| Stream::new(config.delays.fifo_beats)).collect::<Vec<_>>()
        };
        Ok(Self {
            accelerator: Accelerator::new(config),
            inputs: streams(config.profile.mm2s_widths),
            outputs: streams(config.profile.s2mm_widths),
            log: Log::new(),
            faults: Faults::default(),
            now: 0,
        })
    }

    fn pass(&mut self, clocks: u64) {
        self.now += clocks;
        if self.accelerator.tick(self.now) {
            self.inputs.iter_mut().chain(&mut self.outputs).for_each(Stream::clear);
        }
    }
}

impl ExternalAccelerator for ModelAccelerator {
    fn read(&mut self, offset: u32) -> Result<u32, ExternalError> {
        Ok(self.accelerator.read(offset).unwrap_or(0))
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), ExternalError> {
        self.accelerator.write(self.now, offset, value, &mut self.log, &mut self.faults);
        Ok(())
    }

    fn run(&mut self, limit: u32, offer: &Offer) -> Result<Clocked, ExternalError> {
        let mut taken = Vec::new();
        for (stream, beats) in self.inputs.iter_mut().zip(&offer.beats) {
            let room = stream.space().min(beats.len());
            for StreamBeat { beat, last, partial } in &beats[..room] {
                stream.push(&[*beat]);
                if *last {
                    stream.mark_last();
                }
                if *partial {
                    stream.mark_partial();
                }
            }
            taken.push(room);
        }
        let mut cycles = 0;
        loop {
            let left = u64::from(limit) - cycles;
            let (inputs, outputs) = (&mut self.inputs, &mut self.outputs);
            let ran = self.accelerator.run(left, inputs, outputs, &mut self.faults);
            cycles += ran.cycles;
            if !ran.loaded {
                break;
            }
        }
        let idle = u64::from(limit) - cycles;
        if self.accelerator.running() {
            self.accelerator.starve(idle);
        }
        self.pass(limit.into());
        let mut sent = Vec::new();
        for (stream, space) in self.outputs.iter_mut().zip(&offer.space) {
            let beats = stream.marked_beats(stream.len().min(*space));
            let mut dropped = vec![Beat::default(); beats.len()];
            stream.pop_into(&mut dropped);
            sent.push(beats);
        }
        Ok(Clocked {
            clocks: limit,
            interrupt: self.accelerator.interrupt(),
            busy: self.accelerator.running(),
            taken,
            sent,
            sent_at: Vec::new(),
        })
    }
}
