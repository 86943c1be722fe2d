//! This file counts beats instead of moving them: how far the engines and the accelerator come, slice
//! by slice, while nothing but the collisions of one pass flows.
//!
//! It is what `board.rs` does with everything that can happen in between left out, to the beat: the
//! same slices, the same turns at the memory. What flows settles soon and then recurs, so that most of
//! it is a known stretch so many times over.

use crate::accelerator::striping::STREAMS_MAX;
use crate::board::{BURST_BEATS, STARVED_CYCLES};

/// What the memory delivers; bytes times the clock in kHz.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Supply {
    /// Each cycle.
    pub(crate) income: u64,
    /// For a beat.
    pub(crate) beat_cost: u64,
    /// What is kept from one slice to the next, at most.
    pub(crate) reserve: u64,
}

/// What stays the same.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    /// Beats of a collision on each stream that has any.
    pub(crate) share: [usize; STREAMS_MAX],
    /// Beats that a FIFO holds.
    pub(crate) depth: usize,
    /// Engines that have their turns: two for each core, of which the first one flows.
    pub(crate) engines: usize,
    /// Cycles from one collision to the next, unless it waits for its bodies, and then at most.
    pub(crate) interval: u64,
    pub(crate) interval_max: u64,
    /// Nothing, where the bandwidth has no limit.
    pub(crate) supply: Option<Supply>,
}

/// How far it may go: what ends something is not for here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Cycles, collisions, and beats on each stream; none of them is reached.
    pub(crate) cycles: u64,
    pub(crate) records: usize,
    pub(crate) beats: [usize; STREAMS_MAX],
}

/// What has flowed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Flowed {
    pub(crate) cycles: u64,
    /// Cycles of them in which no collision was there.
    pub(crate) waits: u64,
    pub(crate) records: usize,
    pub(crate) beats: [usize; STREAMS_MAX],
}

/// What decides how it goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Standing {
    /// Beats in each FIFO.
    pub(crate) held: [usize; STREAMS_MAX],
    /// What the memory can deliver at once.
    pub(crate) credit: u64,
    /// The engine that has the first turn.
    pub(crate) turn: usize,
}

/// Everything that flows.
#[derive(Debug, Clone)]
pub(crate) struct Pace {
    pub(crate) rules: Rules,
    pub(crate) limits: Limits,
    pub(crate) standing: Standing,
    pub(crate) flowed: Flowed,
}

/// Which slice it was, told once for each in which collisions were taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slice {
    /// Cycles and collisions since the beginning.
    pub(crate) cycles: u64,
    pub(crate) first: usize,
    pub(crate) records: usize,
}

impl Pace {
    /// Collisions of which all beats are there.
    fn there(&self) -> usize {
        let mut there = usize::MAX;
        for (held, share) in self.standing.held.iter().zip(self.rules.share) {
            if let Some(records) = held.checked_div(share) {
                there = there.min(records);
            }
        }
        there
    }

    /// Goes on for whole slices, as far as no limit can be reached. `enter` says how many cycles the
    /// collisions of a slice take.
    pub(crate) fn run(&mut self, mut enter: impl FnMut(Slice) -> u64) {
        while self.slice(&mut enter).is_some() {}
    }

    /// The same where every collision takes an interval: what recurs is not gone through again, but
    /// for the last `last` collisions at least.
    pub(crate) fn run_evenly(&mut self, last: usize, mut enter: impl FnMut(Slice)) {
        let interval = self.rules.interval;
        let mut enter = |slice: Slice| {
            enter(slice);
            slice.records as u64 * interval
        };
        // Looks for the standing of some slices ago, each time of twice as many.
        let (mut then, mut since, mut patience) = ((self.standing, self.flowed), 0, 1_u32);
        while self.slice(&mut enter).is_some() {
            since += 1;
            if self.standing == then.0 {
                self.repeat(&then.1, last);
                break;
            }
            if since == patience {
                (then, since, patience) = ((self.standing, self.flowed), 0, patience * 2);
            }
        }
        self.run(&mut enter);
    }

    /// Goes through what has flowed since then as often as the limits leave room for, but for the
    /// collisions that come last.
    fn repeat(&mut self, then: &Flowed, last: usize) {
        let (flowed, limits) = (self.flowed, self.limits);
        let cycles = flowed.cycles - then.cycles;
        let records = flowed.records - then.records;
        let mut times = u64::MAX;
        let mut room = |left: u64, each: u64| {
            if let Some(fit) = left.checked_div(each) {
                times = times.min(fit);
            }
        };
        room(limits.cycles - flowed.cycles, cycles);
        room((limits.records - flowed.records) as u64, records as u64);
        for k in 0..STREAMS_MAX {
            let each = flowed.beats[k] - then.beats[k];
            room((limits.beats[k] - flowed.beats[k]) as u64, each as u64);
        }
        // Once more than fits the end, and those that are to be gone through.
        let kept = 1 + last.div_ceil(records.max(1)) as u64;
        let times = times.saturating_sub(kept);
        let of = crate::cast::index(times);
        self.flowed = Flowed {
            cycles: flowed.cycles + times * cycles,
            waits: flowed.waits + times * (flowed.waits - then.waits),
            records: flowed.records + of * records,
            beats: std::array::from_fn(|k| {
                flowed.beats[k] + of * (flowed.beats[k] - then.beats[k])
            }),
        };
    }

    /// One slice: the accelerator works on what is there, then the engines refill for as long as that
    /// took. Nothing, and no change, if a limit could be reached in it.
    #[inline]
    fn slice(&mut self, enter: &mut impl FnMut(Slice) -> u64) -> Option<()> {
        let there = self.there();
        let longest = match there {
            0 => STARVED_CYCLES,
            _ => there as u64 * self.rules.interval_max,
        };
        let Flowed { cycles, records, beats, .. } = self.flowed;
        if cycles + longest >= self.limits.cycles || records + there >= self.limits.records {
            return None;
        }
        let share = self.rules.share;
        for k in 0..STREAMS_MAX {
            let space = self.rules.depth - self.standing.held[k] + there * share[k];
            if share[k] > 0 && beats[k] + space >= self.limits.beats[k] {
                return None;
            }
        }
        let slice = if there == 0 {
            self.flowed.waits += STARVED_CYCLES;
            STARVED_CYCLES
        } else {
            for (held, share) in self.standing.held.iter_mut().zip(share) {
                *held -= there * share;
            }
            self.flowed.records += there;
            enter(Slice { cycles, first: records, records: there })
        };
        self.flowed.cycles += slice;
        self.refill(slice);
        Some(())
    }

    /// Lets the engines put beats into the FIFOs for that many cycles, each a burst in turn until the
    /// memory has no more.
    #[inline]
    fn refill(&mut self, cycles: u64) {
        let Rules { share, depth, engines, supply, .. } = self.rules;
        let Standing { held, credit, turn } = &mut self.standing;
        // An engine moves a beat a cycle.
        let most = usize::try_from(cycles).unwrap_or(usize::MAX);
        let mut room = [0; STREAMS_MAX];
        for k in 0..STREAMS_MAX {
            if share[k] > 0 {
                room[k] = most.min(depth - held[k]);
            }
        }
        let mut put = |k: usize, beats: usize| {
            held[k] += beats;
            self.flowed.beats[k] += beats;
        };
        let Some(Supply { income, beat_cost, reserve }) = supply else {
            for (k, beats) in room.into_iter().enumerate() {
                put(k, beats);
            }
            return;
        };
        *credit = (*credit).min(reserve).saturating_add(cycles.saturating_mul(income));
        let mut without_beats = 0;
        while without_beats < engines && *credit >= beat_cost {
            let moved = if turn.is_multiple_of(2) {
                let burst = if *credit >= BURST_BEATS * beat_cost {
                    BURST_BEATS
                } else {
                    *credit / beat_cost
                };
                let moved = crate::cast::index(burst).min(room[*turn / 2]);
                room[*turn / 2] -= moved;
                put(*turn / 2, moved);
                *credit -= moved as u64 * beat_cost;
                moved
            } else {
                0
            };
            *turn = if *turn + 1 == engines { 0 } else { *turn + 1 };
            without_beats = if moved == 0 { without_beats + 1 } else { 0 };
        }
    }
}
