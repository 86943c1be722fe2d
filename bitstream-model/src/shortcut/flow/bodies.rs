//! This file counts beats instead of moving them while nothing but bodies flows, to be loaded or to be
//! integrated: `pace.rs` for what comes and goes once in a step.

use super::collisions::{PerEngine, Supply};
use crate::accelerator::records::striping::{ROWS_IN, ROWS_OUT, Turns};
use crate::board::STARVED_CYCLES;

/// What happens to the bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BodyPhase {
    /// Their velocities come.
    Load,
    /// Their poses come, and their results go.
    Integrate,
}

/// How far it may go: what ends something is not for here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyLimits {
    /// Cycles, bodies, and beats of each engine; none of them is reached.
    pub(crate) cycles: u64,
    pub(crate) records: usize,
    pub(crate) beats: PerEngine,
}

/// What has flowed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct BodyFlowed {
    pub(crate) cycles: u64,
    /// Cycles of them in which the accelerator had nothing to do.
    pub(crate) waits: u64,
    pub(crate) records: usize,
    pub(crate) beats: PerEngine,
}

/// What decides how it goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BodyStanding {
    /// The body that is next.
    pub(crate) body: usize,
    /// Beats in the FIFO of each engine, to or from the accelerator.
    pub(crate) held: PerEngine,
    /// What the memory can deliver at once, and the engine that has the first turn.
    pub(crate) credit: u64,
    pub(crate) turn: usize,
}

/// Everything that flows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyPace {
    pub(crate) phase: BodyPhase,
    /// How bodies lie on the streams.
    pub(crate) turns: Turns,
    /// Beats that a FIFO holds.
    pub(crate) depth: usize,
    /// Engines that have their turns: MM2S and S2MM of each core.
    pub(crate) engines: usize,
    /// Nothing, where the bandwidth has no limit.
    pub(crate) supply: Option<Supply>,
    pub(crate) limits: BodyLimits,
    pub(crate) standing: BodyStanding,
    pub(crate) flowed: BodyFlowed,
}

impl BodyPace {
    /// Goes on for whole slices, as far as no limit can be reached.
    pub(crate) fn run(&mut self) {
        match self.turns.streams {
            4 => self.run_on::<4>(),
            3 => self.run_on::<3>(),
            2 => self.run_on::<2>(),
            _ => self.run_on::<1>(),
        }
    }

    /// The same on so many streams, which numbers of beats are divided by again and again.
    fn run_on<const STREAMS: usize>(&mut self) {
        self.turns = Turns { streams: STREAMS };
        while let Some(next) = self.slice::<STREAMS>() {
            (self.standing, self.flowed) = next;
        }
    }

    /// Bodies of which all beats are there, and all beats of their results have room.
    fn there<const STREAMS: usize>(&self) -> usize {
        let Self { phase, depth, standing: BodyStanding { body, held, .. }, .. } = *self;
        let turns = Turns { streams: STREAMS };
        let came = turns.counts(ROWS_IN * body);
        let there = turns.contiguous(|k| came[k] + held[2 * k]) / ROWS_IN - body;
        match phase {
            BodyPhase::Load => there,
            BodyPhase::Integrate => {
                let went = turns.counts(ROWS_OUT * body);
                let room = turns.contiguous(|k| went[k] + depth - held[2 * k + 1]);
                there.min(room / ROWS_OUT - body)
            }
        }
    }

    /// What a slice leaves behind: the accelerator works on what is there, then the engines go on for as
    /// long as that took. Nothing if a limit could be reached in it, or nothing happens.
    fn slice<const STREAMS: usize>(&self) -> Option<(BodyStanding, BodyFlowed)> {
        let Self { depth, engines, supply, limits, .. } = self;
        let turns = Turns { streams: STREAMS };
        let (mut standing, mut flowed) = (self.standing, self.flowed);
        let there = self.there::<STREAMS>();
        let slice = if there == 0 {
            flowed.waits += STARVED_CYCLES;
            STARVED_CYCLES
        } else {
            let (body, after) = (standing.body, standing.body + there);
            let beats = |rows: usize| {
                let (before, after) = (turns.counts(rows * body), turns.counts(rows * after));
                (0..turns.streams).map(move |k| after[k] - before[k])
            };
            let cycles = |rows: usize| turns.cycles(rows * after) - turns.cycles(rows * body);
            standing.body = after;
            for (held, beats) in standing.held.iter_mut().step_by(2).zip(beats(ROWS_IN)) {
                *held -= beats;
            }
            // A beat a cycle on each stream.
            match self.phase {
                BodyPhase::Load => cycles(ROWS_IN),
                BodyPhase::Integrate => {
                    let held = standing.held.iter_mut().skip(1).step_by(2);
                    held.zip(beats(ROWS_OUT)).for_each(|(held, beats)| *held += beats);
                    cycles(ROWS_OUT)
                }
            }
        };
        flowed.records += there;
        flowed.cycles += slice;
        if flowed.records >= limits.records || flowed.cycles >= limits.cycles {
            return None;
        }
        // An engine moves a beat a cycle.
        let most = usize::try_from(slice).unwrap_or(usize::MAX);
        let mut room = standing.held.map(|held| held.min(most));
        let inputs = room.iter_mut().zip(standing.held).step_by(2).take(turns.streams);
        for (room, held) in inputs {
            *room = most.min(depth - held);
        }
        let reached = |((room, flowed), limit)| room > 0 && flowed + room >= limit;
        if room.into_iter().zip(flowed.beats).zip(limits.beats).any(reached) {
            return None;
        }
        let mut left = PerEngine::default();
        if let Some(supply) = supply {
            left = room;
            supply.share(*engines, (&mut standing.credit, &mut standing.turn), slice, &mut left);
        }
        for engine in 0..left.len() {
            let moved = room[engine] - left[engine];
            flowed.beats[engine] += moved;
            if engine % 2 == 0 {
                standing.held[engine] += moved;
            } else {
                standing.held[engine] -= moved;
            }
        }
        (there > 0 || room != left).then_some((standing, flowed))
    }
}
