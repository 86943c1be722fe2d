//! This file counts beats instead of moving them: how far the engines and the accelerator come, slice
//! by slice, while nothing but the collisions of one pass flows, an issue after the other: those that
//! enter together.
//!
//! It is what `board.rs` does with everything that can happen in between left out, to the beat: the
//! same slices, the same turns at the memory. What flows settles soon and then recurs, so that most of
//! it is a known stretch so many times over.

use super::periods::Recurrence;
use crate::accelerator::records::striping::STREAMS_MAX;
use crate::board::{BURST_BEATS, STARVED_CYCLES};
use crate::cast::index;

/// What the memory delivers; bytes times the clock in kHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Supply {
    /// Each cycle.
    pub(crate) income: u64,
    /// For a beat.
    pub(crate) beat_cost: u64,
    /// What is kept from one slice to the next, at most.
    pub(crate) reserve: u64,
}

/// A count for each engine, in their order: MM2S and S2MM of each core.
pub(crate) type PerEngine = [usize; 2 * STREAMS_MAX];

impl Supply {
    /// Gives every engine a burst in turn, for that many cycles, until the memory has no more. Each can
    /// move so many beats; those that it moves are taken from them.
    #[inline]
    pub(crate) fn share(
        &self,
        engines: usize,
        (credit, turn): (&mut u64, &mut usize),
        cycles: u64,
        beats: &mut PerEngine,
    ) {
        let Self { income, beat_cost, reserve } = *self;
        *credit = (*credit).min(reserve).saturating_add(cycles.saturating_mul(income));
        let mut without_beats = 0;
        while without_beats < engines && *credit >= beat_cost {
            let burst =
                if *credit >= BURST_BEATS * beat_cost { BURST_BEATS } else { *credit / beat_cost };
            let left = &mut beats[*turn];
            let moved = index(burst).min(*left);
            *left -= moved;
            *credit -= moved as u64 * beat_cost;
            *turn = if *turn + 1 == engines { 0 } else { *turn + 1 };
            without_beats = if moved == 0 { without_beats + 1 } else { 0 };
        }
    }
}

/// What stays the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rules {
    /// Beats of an issue on each stream that has any.
    pub(crate) share: [usize; STREAMS_MAX],
    /// Binary logarithm of the cycles that a beat takes on each.
    pub(crate) beat_shift: [u32; STREAMS_MAX],
    /// Beats that a FIFO holds.
    pub(crate) depth: usize,
    /// Engines that have their turns: two for each core, of which only the MM2S flows.
    pub(crate) engines: usize,
    /// Cycles from one issue to the next, unless it waits for its bodies, and then at most.
    pub(crate) interval: u64,
    pub(crate) interval_max: u64,
    /// Nothing, where the bandwidth has no limit.
    pub(crate) supply: Option<Supply>,
}

/// How far it may go: what ends something is not for here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Cycles, issues, and beats on each stream; none of them is reached.
    pub(crate) cycles: u64,
    pub(crate) issues: usize,
    pub(crate) beats: [usize; STREAMS_MAX],
}

/// What has flowed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Flowed {
    pub(crate) cycles: u64,
    /// Cycles of them in which no issue was there.
    pub(crate) waits: u64,
    pub(crate) issues: usize,
    pub(crate) beats: [usize; STREAMS_MAX],
}

/// What decides how it goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Standing {
    /// Beats in each FIFO.
    pub(crate) held: [usize; STREAMS_MAX],
    /// Cycles by which the clock of each stream's engine is ahead: a beat is on its way.
    pub(crate) ahead: [u64; STREAMS_MAX],
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

/// Which slice it was, told once for each in which issues were taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slice {
    /// Cycles and issues since the beginning.
    pub(crate) cycles: u64,
    pub(crate) first: usize,
    pub(crate) issues: usize,
}

impl Pace {
    /// Issues of which all beats are there.
    fn there(&self) -> usize {
        let mut there = usize::MAX;
        for (held, share) in self.standing.held.iter().zip(self.rules.share) {
            if let Some(issues) = held.checked_div(share) {
                there = there.min(issues);
            }
        }
        there
    }

    /// Goes on for whole slices, as far as no limit can be reached. `enter` says how many cycles the
    /// issues of a slice take.
    pub(crate) fn run(&mut self, mut enter: impl FnMut(Slice) -> u64) {
        while self.slice(&mut enter).is_some() {}
    }

    /// The same where every issue takes an interval: what recurs is not gone through again, but
    /// for the last `last` issues at least. What is known to recur is kept for another time.
    pub(crate) fn run_evenly(
        &mut self,
        last: usize,
        known: &mut Recurrence,
        mut enter: impl FnMut(Slice),
    ) {
        let interval = self.rules.interval;
        let mut enter = |slice: Slice| {
            enter(slice);
            slice.issues as u64 * interval
        };
        known.suit(&self.rules);
        while !known.leap(self, last) {
            known.look(&self.standing, &self.flowed);
            if self.slice(&mut enter).is_none() {
                return;
            }
        }
        self.run(&mut enter);
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
        let Flowed { cycles, issues, beats, .. } = self.flowed;
        if cycles + longest >= self.limits.cycles || issues + there >= self.limits.issues {
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
            self.flowed.issues += there;
            enter(Slice { cycles, first: issues, issues: there })
        };
        self.flowed.cycles += slice;
        self.refill(slice);
        Some(())
    }

    /// Lets the engines put beats into the FIFOs for that many cycles, each a burst in turn until the
    /// memory has no more.
    #[inline]
    fn refill(&mut self, cycles: u64) {
        if self.rules.beat_shift == [0; STREAMS_MAX] {
            self.refill_of::<false>(cycles);
        } else {
            self.refill_of::<true>(cycles);
        }
    }

    /// The same; without narrow streams every beat takes a cycle.
    #[inline(always)]
    fn refill_of<const NARROW: bool>(&mut self, cycles: u64) {
        let Rules { share, beat_shift, depth, engines, supply, .. } = self.rules;
        let Standing { held, ahead, credit, turn } = &mut self.standing;
        let mut room = PerEngine::default();
        for k in 0..STREAMS_MAX {
            if share[k] > 0 {
                let most = if NARROW {
                    // An engine begins a beat as soon as it is through with the last one.
                    let last = (1 << beat_shift[k]) - 1;
                    cycles.saturating_sub(ahead[k]).saturating_add(last) >> beat_shift[k]
                } else {
                    cycles
                };
                let most = usize::try_from(most).unwrap_or(usize::MAX);
                room[2 * k] = most.min(depth - held[k]);
            }
        }
        let mut left = PerEngine::default();
        if let Some(supply) = supply {
            left = room;
            supply.share(engines, (credit, turn), cycles, &mut left);
        }
        for k in 0..STREAMS_MAX {
            let moved = room[2 * k] - left[2 * k];
            held[k] += moved;
            if NARROW {
                let busy = ahead[k] + ((moved as u64) << beat_shift[k]);
                ahead[k] = busy.saturating_sub(cycles);
            }
            self.flowed.beats[k] += moved;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The beats of an issue and the logarithm of their cycles, the engines, the interval and the clock
    /// of a design.
    type Design = ([usize; STREAMS_MAX], [u32; STREAMS_MAX], usize, u64, u64);
    const FLOAT: Design = ([2, 2, 2, 1], [0; STREAMS_MAX], 8, 2, 275_000);
    const HALF: Design = ([3, 3, 1, 0], [0, 0, 1, 0], 6, 3, 250_000);
    const MIXED: Design = ([1, 1, 1, 0], [0; STREAMS_MAX], 6, 1, 250_000);

    /// A design with that bandwidth in bytes a second.
    fn pace(design: Design, bandwidth: Option<u64>, depth: usize, standing: Standing) -> Pace {
        let (share, beat_shift, engines, interval, clock) = design;
        let beat_cost = 16 * clock;
        Pace {
            rules: Rules {
                share,
                beat_shift,
                depth,
                engines,
                interval,
                interval_max: interval,
                supply: bandwidth.map(|bytes| Supply {
                    income: bytes / 1000,
                    beat_cost,
                    reserve: BURST_BEATS * engines as u64 * beat_cost,
                }),
            },
            limits: Limits {
                cycles: 1_000_000,
                issues: 127_746,
                beats: share.map(|share| 127_746 * share),
            },
            standing,
            flowed: Flowed::default(),
        }
    }

    const EMPTY: Standing =
        Standing { held: [0; STREAMS_MAX], ahead: [0; STREAMS_MAX], credit: 0, turn: 0 };

    #[test]
    fn what_recurs_is_what_each_slice_would_have_given() {
        let bandwidths = [
            None,
            Some(12_800_000_000),
            Some(17_070_000_000),
            Some(3_700_000_000),
            Some(7_123_456_789),
            Some(100_000_000),
        ];
        for (design, bandwidth) in
            bandwidths.iter().flat_map(|b| [(FLOAT, *b), (HALF, *b), (MIXED, *b)])
        {
            for (depth, held) in [(512, [0; 4]), (16, [3, 1, 0, 9]), (64, [0, 7, 64, 2])] {
                // Nothing is where nothing comes.
                let held = std::array::from_fn(|k| if design.0[k] > 0 { held[k] } else { 0 });
                let standing = Standing { held, ..EMPTY };
                let mut each = pace(design, bandwidth, depth, standing);
                let mut slices = 0;
                let mut last = [(0, 0, 0); 4];
                each.run(|Slice { cycles, first, issues }| {
                    slices += 1;
                    last.rotate_left(1);
                    last[3] = (cycles, first, issues);
                    design.3 * issues as u64
                });
                let case = (design, bandwidth, depth);
                let mut known = Recurrence::default();
                for again in [false, true] {
                    let mut even = pace(design, bandwidth, depth, standing);
                    let (mut gone_through, mut last_even) = (0, [(0, 0, 0); 4]);
                    even.run_evenly(158, &mut known, |Slice { cycles, first, issues }| {
                        gone_through += 1;
                        last_even.rotate_left(1);
                        last_even[3] = (cycles, first, issues);
                    });
                    assert_eq!(even.flowed, each.flowed, "{case:?}");
                    assert_eq!(even.standing, each.standing, "{case:?}");
                    assert_eq!(last_even, last, "{case:?}");
                    assert!(!known.is_known() || gone_through < slices, "{case:?}");
                    // The board that everybody has: most of a pass is leapt over.
                    if again && (bandwidth, depth) == (Some(12_800_000_000), 512) {
                        assert!(gone_through < slices / 4, "{gone_through} of {slices}: {case:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_settles_in_another_way_is_found_too() {
        // As the first pass over a pile found it, which came with its descriptors, and the next ones.
        let first = Standing { held: [215, 139, 64, 0], credit: 435_200_000, turn: 1, ..EMPTY };
        let next = Standing { held: [512, 503, 428, 0], credit: 994_400_000, turn: 5, ..EMPTY };
        let mut known = Recurrence::default();
        for (standing, share) in [(first, 8), (next, 4), (next, 16), (first, 8), (next, 4)] {
            let each = &mut pace(MIXED, Some(12_800_000_000), 512, standing);
            let (mut slices, mut gone_through) = (0, 0);
            each.run(|slice| {
                slices += 1;
                slice.issues as u64
            });
            let even = &mut pace(MIXED, Some(12_800_000_000), 512, standing);
            even.run_evenly(158, &mut known, |_| gone_through += 1);
            assert_eq!((even.flowed, even.standing), (each.flowed, each.standing));
            assert!(gone_through < slices / share, "{gone_through} of {slices}");
        }
    }
}
