//! This file lets a long stretch of time pass in which nothing but collisions flows, or bodies: it is
//! counted in `pace.rs` or `body_pace.rs`, and then has happened.

use super::bodies::{BodyFlowed, BodyLimits, BodyPace, BodyPhase, BodyStanding};
use super::collisions::{Flowed, Limits, Pace, PerEngine, Rules, Standing, Supply};
use crate::accelerator::Coming;
use crate::accelerator::records::striping::{ROWS_IN, STREAMS_MAX, Turns};
use crate::board::{BURST_BEATS, Board};
use crate::config::Bandwidth;
use crate::memory::Source;
use pgs_interface::axi_dma::Direction;
use pgs_interface::record::BEAT_BYTES;

/// Where the beats are that are next on each stream, those in its FIFO before those that are about to
/// come, and how many.
type Sources = [(Source, usize); STREAMS_MAX];

impl Board {
    /// Lets whole slices pass until shortly before `until`, as far as it is known that nothing
    /// happens in them.
    pub(crate) fn stretch(&mut self, until: u64) {
        let plain = self.faults.none()
            && self.config.quirks.unconnected.is_none()
            && self.inputs.iter().chain(&self.outputs).all(|stream| !stream.marked())
            && self.interrupt.next_event().is_none()
            && self.cores.len() == self.inputs.len();
        if !plain {
            return;
        }
        match self.accelerator.flowing_bodies() {
            Some((phase, turns)) => self.stretch_of_bodies(phase, turns, until),
            None => self.stretch_of_collisions(until),
        }
    }

    fn stretch_of_collisions(&mut self, until: u64) {
        let Some(mut pace) = self.pace(until) else { return };
        self.accelerator.flow(&mut pace, &mut self.recurrence);
        let Flowed { cycles, beats, .. } = pace.flowed;
        if cycles == 0 {
            return;
        }
        for ((core, stream), beats) in self.cores.iter_mut().zip(&mut self.inputs).zip(beats) {
            let Some((at, _)) = core.flows(Direction::Mm2s, self.now) else { continue };
            let Ok(Some(source)) = self.memory.source(at, beats) else { continue };
            if beats > 0 {
                stream.push_span(source, beats);
                core.flowed(Direction::Mm2s, beats);
                self.moved.beats_read += beats as u64;
            }
        }
        for (core, ahead) in self.cores.iter_mut().zip(pace.standing.ahead) {
            core.has_come_to(self.now + cycles, ahead);
        }
        self.accelerator.flowed(&pace, &mut self.inputs);
        self.credit = pace.standing.credit;
        self.turn = pace.standing.turn;
        self.now += cycles;
        self.log.at(self.now);
    }

    /// What flows of the collisions, if nothing else can happen for some time.
    fn pace(&mut self, until: u64) -> Option<Pace> {
        let now = self.now;
        if self.outputs.iter().any(|stream| stream.len() > 0) {
            return None;
        }
        let (cores, memory) = (&self.cores, &self.memory);
        let mut left = [0; STREAMS_MAX];
        let coming = || {
            let mut coming = Coming::default();
            for (k, core) in cores.iter().enumerate() {
                let (at, beats) = core.flows(Direction::Mm2s, now)?;
                left[k] = beats;
                coming[k] = Some((memory.source(at, beats).ok()??, beats));
                if !core.rests_without_beats(now) {
                    return None;
                }
            }
            Some(coming)
        };
        let (issues, interval_max) = self.accelerator.flows(&self.inputs, coming, memory)?;
        let (mut held, mut ahead) = ([0; STREAMS_MAX], [0; STREAMS_MAX]);
        for (k, (core, stream)) in self.cores.iter().zip(&self.inputs).enumerate() {
            held[k] = stream.len();
            ahead[k] = core.ahead(now);
        }
        Some(Pace {
            rules: self.rules(interval_max),
            limits: Limits { cycles: until - now, issues, beats: left },
            standing: Standing { held, ahead, credit: self.credit, turn: self.turn },
            flowed: Flowed::default(),
        })
    }

    /// MM2S and S2MM of each core.
    fn engines(&self) -> usize {
        2 * self.cores.len()
    }

    fn supply(&self) -> Option<Supply> {
        let beat_cost = BEAT_BYTES as u64 * u64::from(self.config.profile.clock_khz);
        match self.config.bandwidth {
            Bandwidth::Unlimited => None,
            Bandwidth::BytesPerSecond(bytes) => {
                let reserve = BURST_BEATS * self.engines() as u64 * beat_cost;
                Some(Supply { income: bytes / 1000, beat_cost, reserve })
            }
        }
    }

    fn rules(&self, interval_max: u64) -> Rules {
        let mut beat_shift = [0; STREAMS_MAX];
        for (shift, core) in beat_shift.iter_mut().zip(&self.cores) {
            *shift = core.beat_shift();
        }
        Rules {
            share: self.accelerator.share(),
            beat_shift,
            depth: self.config.delays.fifo_beats,
            engines: self.engines(),
            interval: self.config.profile.initiation_interval.into(),
            interval_max,
            supply: self.supply(),
        }
    }

    fn stretch_of_bodies(&mut self, phase: BodyPhase, turns: Turns, until: u64) {
        let Some((mut pace, sources)) = self.body_pace(phase, turns, until) else { return };
        pace.run();
        let BodyFlowed { cycles, records, beats, .. } = pace.flowed;
        if cycles == 0 {
            return;
        }
        let first = pace.standing.body - records;
        let [before, after] = [first, first + records].map(|bodies| turns.counts(ROWS_IN * bodies));
        let mut reads = sources;
        let mut writes = [(0, 0); STREAMS_MAX];
        for (k, core) in self.cores.iter().enumerate() {
            reads[k].1 = after[k] - before[k];
            if let Some((at, _)) = core.flows(Direction::S2mm, self.now) {
                writes[k] = (at, beats[2 * k + 1]);
            }
        }
        let Some((views, places)) = self.memory.lend(reads, writes) else { return };
        for (k, (core, stream)) in self.cores.iter_mut().zip(&mut self.inputs).enumerate() {
            let (came, went) = (beats[2 * k], beats[2 * k + 1]);
            stream.push_span(sources[k].0.further(stream.len() as u64), came);
            core.flowed(Direction::Mm2s, came);
            core.flowed(Direction::S2mm, went);
            self.moved.beats_read += came as u64;
            self.moved.beats_written += went as u64;
        }
        let (inputs, outputs) = (&mut self.inputs, &mut self.outputs);
        self.accelerator.flowed_bodies(&pace, views, places, inputs, outputs);
        self.credit = pace.standing.credit;
        self.turn = pace.standing.turn;
        self.now += cycles;
        self.log.at(self.now);
    }

    /// What flows of the bodies, if nothing else can happen for some time, and where their beats are.
    fn body_pace(&self, phase: BodyPhase, turns: Turns, until: u64) -> Option<(BodyPace, Sources)> {
        let (now, memory) = (self.now, &self.memory);
        let mut left = PerEngine::default();
        let mut sources = Sources::default();
        for (k, (core, stream)) in self.cores.iter().zip(&self.inputs).enumerate() {
            let (at, beats) = core.flows(Direction::Mm2s, now)?;
            let (coming, there) = (memory.source(at, beats).ok()??, stream.len());
            // Together with those in the FIFO.
            let source = match stream.piece(0, there) {
                (0, _) => coming,
                (count, Some(source)) if count == there => source,
                _ => return None,
            };
            if source.further(there as u64) != coming {
                return None;
            }
            sources[k] = (source, there + beats);
            left[2 * k] = beats;
            match phase {
                BodyPhase::Load if core.rests_without_beats(now) => {}
                BodyPhase::Load => return None,
                BodyPhase::Integrate => {
                    let (at, beats) = core.flows(Direction::S2mm, now)?;
                    memory.may_write(at, beats).then_some(())?;
                    left[2 * k + 1] = beats;
                }
            }
        }
        let cycles = until - now;
        let (body, records) = self.accelerator.bodies_known(&sources, cycles, memory)?;
        let mut standing =
            BodyStanding { body, held: PerEngine::default(), credit: self.credit, turn: self.turn };
        for (k, (input, output)) in self.inputs.iter().zip(&self.outputs).enumerate() {
            (standing.held[2 * k], standing.held[2 * k + 1]) = (input.len(), output.len());
        }
        let pace = BodyPace {
            phase,
            turns,
            depth: self.config.delays.fifo_beats,
            engines: self.engines(),
            supply: self.supply(),
            limits: BodyLimits { cycles, records, beats: left },
            standing,
            flowed: BodyFlowed::default(),
        };
        Some((pace, sources))
    }
}
