//! Counts beats that flow undisturbed instead of moving them one by one.
//!
//! A [`Flow`] is `Board::advance` without everything that disturbs it: slice by slice the accelerator
//! takes the records that are there, then the engines go on for as long as that took. It agrees with
//! `Board::advance` to the beat. `records.rs` takes the records of each phase, `periods.rs` passes over
//! periods that recur, `fast_forward.rs` begins a flow on a board and makes the board as it is
//! afterwards.

pub(super) mod fast_forward;
mod periods;
mod records;
#[cfg(test)]
mod tests;

use crate::accelerator::records::striping::STREAMS_MAX;
use crate::board::STARVED_CYCLES;
use crate::board::arbiter::{Arbiter, Turn};
use periods::Periods;
use records::Records;

/// A count for each engine, in their order: MM2S and S2MM of each core.
type PerEngine = [usize; 2 * STREAMS_MAX];

/// The constants of a flow.
#[derive(Debug, Clone, Copy)]
struct Rules {
    /// The number of cores.
    cores: usize,
    /// Binary logarithm of the cycles that a beat takes on each input; on an output it takes one.
    beat_shift: [u32; STREAMS_MAX],
    /// Beats that a FIFO holds.
    depth: usize,
    arbiter: Arbiter,
}

/// Where the flow must end: none of these is reached.
#[derive(Debug, Clone, Copy)]
struct Limits {
    cycles: u64,
    records: usize,
    beats: PerEngine,
}

/// The progress of a flow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Flowed {
    cycles: u64,
    /// Cycles of them in which no record was there.
    waits: u64,
    records: usize,
    beats: PerEngine,
}

/// The state that decides how the flow goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct FlowState {
    /// Beats in the FIFO of each engine, to or from the accelerator.
    held: PerEngine,
    /// Cycles by which the clock of each MM2S is ahead: a beat is on its way.
    ahead: [u64; STREAMS_MAX],
    turn: Turn,
}

/// Beats and records that flow.
#[derive(Debug, Clone)]
struct Flow {
    rules: Rules,
    limits: Limits,
    state: FlowState,
    flowed: Flowed,
}

impl Flow {
    /// Goes on for whole slices, as far as no limit can be reached.
    fn run(&mut self, records: &mut impl Records) {
        while self.slice(records).is_some() {}
    }

    /// The same for records that always take equally long. Whole periods are passed over, but not
    /// the last `last` records.
    fn run_evenly(&mut self, records: &mut impl Records, last: usize, periods: &mut Periods) {
        periods.begin();
        while !periods.pass_over(self, records, last) {
            if self.slice(records).is_none() {
                return;
            }
        }
        self.run(records);
    }

    /// One slice: the accelerator takes the records that are there, then the engines go on for as
    /// long as that took. Nothing, and no change, if a limit could be reached in it.
    #[inline(always)]
    fn slice<R: Records>(&mut self, records: &mut R) -> Option<()> {
        let Self { rules, limits, state, flowed } = self;
        let first = flowed.records;
        let ready = records.ready(first, &state.held, rules.depth);
        let longest = if ready == 0 { STARVED_CYCLES } else { records.cycles_max(first, ready) };
        if flowed.cycles + longest >= limits.cycles || first + ready >= limits.records {
            return None;
        }
        let (taken, given) = records.beats(first, ready);
        let reached =
            |engine: usize, most| most > 0 && flowed.beats[engine] + most >= limits.beats[engine];
        for k in 0..rules.cores {
            let (input, output) = (2 * k, 2 * k + 1);
            if reached(input, rules.depth - state.held[input] + taken[k])
                || R::RESULTS && reached(output, state.held[output] + given[k])
            {
                return None;
            }
        }
        let cycles = if ready == 0 {
            flowed.waits += STARVED_CYCLES;
            STARVED_CYCLES
        } else {
            for k in 0..rules.cores {
                state.held[2 * k] -= taken[k];
                if R::RESULTS {
                    state.held[2 * k + 1] += given[k];
                }
            }
            records.enter(first, ready, flowed.cycles)
        };
        flowed.records += ready;
        flowed.cycles += cycles;
        if rules.beat_shift == [0; STREAMS_MAX] {
            self.move_beats::<R, false>(cycles);
        } else {
            self.move_beats::<R, true>(cycles);
        }
        Some(())
    }

    /// Lets the engines move beats for that many cycles. Without `NARROW` streams every beat takes a
    /// cycle.
    #[inline(always)]
    fn move_beats<R: Records, const NARROW: bool>(&mut self, cycles: u64) {
        let Rules { cores, beat_shift, depth, arbiter } = self.rules;
        let FlowState { held, ahead, turn } = &mut self.state;
        let mut room = PerEngine::default();
        let most = usize::try_from(cycles).unwrap_or(usize::MAX);
        for k in 0..cores {
            let most_in = if NARROW {
                // An engine begins a beat as soon as it is through with the last one.
                let last = (1 << beat_shift[k]) - 1;
                let beats = cycles.saturating_sub(ahead[k]).saturating_add(last) >> beat_shift[k];
                usize::try_from(beats).unwrap_or(usize::MAX)
            } else {
                most
            };
            room[2 * k] = most_in.min(depth - held[2 * k]);
            if R::RESULTS {
                room[2 * k + 1] = most.min(held[2 * k + 1]);
            }
        }
        let mut left = room;
        arbiter.share(turn, cycles, |engine, limit| {
            let moved = limit.min(left[engine]);
            left[engine] -= moved;
            moved
        });
        for k in 0..cores {
            let (input, output) = (2 * k, 2 * k + 1);
            let moved = room[input] - left[input];
            held[input] += moved;
            self.flowed.beats[input] += moved;
            if NARROW {
                let busy = ahead[k] + ((moved as u64) << beat_shift[k]);
                ahead[k] = busy.saturating_sub(cycles);
            }
            if R::RESULTS {
                let moved = room[output] - left[output];
                held[output] -= moved;
                self.flowed.beats[output] += moved;
            }
        }
    }
}
