//! This file lets a long stretch of time pass in which nothing but collisions flows: it is counted
//! in `pace.rs`, and then has happened.

use crate::accelerator::striping::STREAMS_MAX;
use crate::accelerator::{Coming, SHARE};
use crate::board::{BURST_BEATS, Board};
use crate::config::Bandwidth;
use crate::interface::record::BEAT_BYTES;
use crate::pace::{Flowed, Limits, Pace, Rules, Standing, Supply};

impl Board {
    /// Lets whole slices pass until shortly before `until`, as far as it is known that nothing
    /// happens in them.
    pub(crate) fn stretch(&mut self, until: u64) {
        let Some(mut pace) = self.pace(until) else { return };
        self.accelerator.flow(&mut pace, &mut self.recurrence);
        let Flowed { cycles, beats, .. } = pace.flowed;
        if cycles == 0 {
            return;
        }
        for ((core, stream), beats) in self.cores.iter_mut().zip(&mut self.inputs).zip(beats) {
            if let Some((at, _)) = core.flows(self.now)
                && let Ok(Some(source)) = self.memory.source(at, beats)
                && beats > 0
            {
                stream.push_span(source, beats);
                core.flowed(beats);
                self.moved.beats_read += beats as u64;
            }
        }
        self.accelerator.flowed(&pace, &mut self.inputs);
        self.credit = pace.standing.credit;
        self.turn = pace.standing.turn;
        self.now += cycles;
        self.log.at(self.now);
    }

    /// What flows, if nothing else can happen for some time.
    fn pace(&mut self, until: u64) -> Option<Pace> {
        let now = self.now;
        let plain = self.faults.none()
            && self.config.quirks.unconnected.is_none()
            && self.inputs.iter().all(|stream| !stream.marked())
            && self.outputs.iter().all(|stream| stream.len() == 0)
            && self.interrupt.next_event().is_none()
            && self.cores.len() == self.inputs.len();
        if !plain {
            return None;
        }
        let (cores, memory) = (&self.cores, &self.memory);
        let mut left = [0; STREAMS_MAX];
        let coming = || {
            let mut coming = Coming::default();
            for (k, core) in cores.iter().enumerate() {
                let (at, beats) = core.flows(now)?;
                left[k] = beats;
                coming[k] = Some((memory.source(at, beats).ok()??, beats));
                if !core.rests_without_beats(now) {
                    return None;
                }
            }
            Some(coming)
        };
        let (records, interval_max) = self.accelerator.flows(&self.inputs, coming, memory)?;
        let mut held = [0; STREAMS_MAX];
        for (held, stream) in held.iter_mut().zip(&self.inputs) {
            *held = stream.len();
        }
        let beat_cost = BEAT_BYTES as u64 * u64::from(self.config.profile.clock_khz);
        let engines = 2 * cores.len();
        let supply = match self.config.bandwidth {
            Bandwidth::Unlimited => None,
            Bandwidth::BytesPerSecond(bytes) => {
                let reserve = BURST_BEATS * engines as u64 * beat_cost;
                Some(Supply { income: bytes / 1000, beat_cost, reserve })
            }
        };
        Some(Pace {
            rules: Rules {
                share: SHARE,
                depth: self.config.delays.fifo_beats,
                engines,
                interval: self.config.profile.initiation_interval.into(),
                interval_max,
                supply,
            },
            limits: Limits { cycles: until - now, records, beats: left },
            standing: Standing { held, credit: self.credit, turn: self.turn },
            flowed: Flowed::default(),
        })
    }
}
