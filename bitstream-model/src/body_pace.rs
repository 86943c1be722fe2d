//! This file counts beats instead of moving them while nothing but bodies flows, to be loaded or to be
//! integrated: `pace.rs` for what comes and goes once in a step.

use crate::accelerator::striping::beats_of_bodies;
use crate::board::STARVED_CYCLES;
use crate::pace::{PerEngine, Supply};

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
        while let Some(next) = self.slice() {
            (self.standing, self.flowed) = next;
        }
    }

    /// Bodies of which all beats are there, and all beats of their results have room.
    fn there(&self) -> usize {
        let BodyStanding { body, held: [a, to_a, b, to_b, c, to_c, d, to_d], .. } = self.standing;
        let (even, odd) = (a.min(b), c.min(d));
        let (next, other) = if body.is_multiple_of(2) { (even, odd) } else { (odd, even) };
        let there = if next <= other { 2 * next } else { 2 * other + 1 };
        match self.phase {
            BodyPhase::Load => there,
            BodyPhase::Integrate => there.min(self.depth - to_a.max(to_b).max(to_c).max(to_d)),
        }
    }

    /// What a slice leaves behind: the accelerator works on what is there, then the engines go on for as
    /// long as that took. Nothing if a limit could be reached in it, or nothing happens.
    fn slice(&self) -> Option<(BodyStanding, BodyFlowed)> {
        let Self { depth, engines, supply, limits, .. } = self;
        let (mut standing, mut flowed) = (self.standing, self.flowed);
        let there = self.there();
        let slice = if there == 0 {
            flowed.waits += STARVED_CYCLES;
            STARVED_CYCLES
        } else {
            let (before, after) =
                (beats_of_bodies(standing.body), beats_of_bodies(standing.body + there));
            standing.body += there;
            for ((held, before), after) in
                standing.held.iter_mut().step_by(2).zip(before).zip(after)
            {
                *held -= after - before;
            }
            match self.phase {
                // A beat a cycle on each stream.
                BodyPhase::Load => (after[0] - before[0]) as u64,
                BodyPhase::Integrate => {
                    standing.held.iter_mut().skip(1).step_by(2).for_each(|held| *held += there);
                    there as u64
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
        for (room, held) in room.iter_mut().zip(standing.held).step_by(2) {
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
            if engine.is_multiple_of(2) {
                standing.held[engine] += moved;
            } else {
                standing.held[engine] -= moved;
            }
        }
        (there > 0 || room != left).then_some((standing, flowed))
    }
}
