//! Shares the memory's bandwidth between the DMA engines: a burst each in turn.

use crate::cast::index;
use crate::config::{Bandwidth, BoardConfig};
use pgs_interface::record::BEAT_BYTES;

/// Beats that an engine moves before the next one has its turn: an AXI burst.
const BURST_BEATS: u64 = 16;

/// The memory's bandwidth, in bytes times the clock in kHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Supply {
    /// Income of a cycle.
    income: u64,
    /// Cost of a beat.
    beat_cost: u64,
    /// Largest credit that one stretch of cycles leaves to the next.
    reserve: u64,
}

/// The turns of the engines at the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Arbiter {
    /// MM2S and S2MM of each core, in that order.
    engines: usize,
    /// `None` if the bandwidth has no limit.
    supply: Option<Supply>,
}

/// The arbiter's state between two stretches of cycles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Turn {
    /// Bandwidth that is left over.
    credit: u64,
    /// The engine that has the first turn.
    engine: usize,
}

impl Arbiter {
    pub(crate) fn new(config: &BoardConfig, cores: usize) -> Self {
        let engines = 2 * cores;
        let beat_cost = BEAT_BYTES as u64 * u64::from(config.profile.clock_khz);
        let supply = match config.bandwidth {
            Bandwidth::Unlimited => None,
            Bandwidth::BytesPerSecond(bytes) => Some(Supply {
                income: bytes / 1000,
                beat_cost,
                reserve: BURST_BEATS * engines as u64 * beat_cost,
            }),
        };
        Self { engines, supply }
    }

    /// Cycles in which the bandwidth carries some beats.
    pub(crate) fn cycles(&self, beats: usize) -> u64 {
        self.supply.map_or(0, |Supply { income, beat_cost, .. }| {
            (beats as u64).saturating_mul(beat_cost).div_ceil(income.max(1))
        })
    }

    /// Cycles of bandwidth that are saved up while nobody moves beats.
    pub(crate) fn saved_cycles(&self) -> u64 {
        self.supply.map_or(0, |Supply { income, reserve, .. }| reserve / income.max(1))
    }

    /// Gives every engine a burst in turn for some cycles, until no engine has beats to move or the
    /// bandwidth is used up. `burst(engine, limit)` moves up to `limit` beats and returns their
    /// number. Returns whether the bandwidth holds the engines up.
    #[inline(always)]
    pub(crate) fn share(
        &self,
        turn: &mut Turn,
        cycles: u64,
        mut burst: impl FnMut(usize, usize) -> usize,
    ) -> bool {
        let Some(Supply { income, beat_cost, reserve }) = self.supply else {
            for engine in 0..self.engines {
                burst(engine, usize::MAX);
            }
            return false;
        };
        let mut credit = turn.credit.min(reserve).saturating_add(cycles.saturating_mul(income));
        let mut engine = turn.engine;
        let mut without_beats = 0;
        while without_beats < self.engines && credit >= beat_cost {
            // A division takes long, and is seldom needed.
            let whole = credit >= BURST_BEATS * beat_cost;
            let beats = if whole { BURST_BEATS } else { credit / beat_cost };
            let moved = burst(engine, index(beats));
            credit -= moved as u64 * beat_cost;
            engine = if engine + 1 == self.engines { 0 } else { engine + 1 };
            without_beats = if moved == 0 { without_beats + 1 } else { 0 };
        }
        *turn = Turn { credit, engine };
        without_beats < self.engines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::FLOAT;

    fn arbiter(bandwidth: Bandwidth) -> Arbiter {
        Arbiter::new(&BoardConfig { bandwidth, profile: &FLOAT, ..BoardConfig::default() }, 2)
    }

    /// Shares cycles among engines with these beats; returns the beats that each has left.
    fn share(arbiter: Arbiter, turn: &mut Turn, cycles: u64, mut left: [usize; 4]) -> [usize; 4] {
        arbiter.share(turn, cycles, |engine, limit| {
            let moved = limit.min(left[engine]);
            left[engine] -= moved;
            moved
        });
        left
    }

    #[test]
    fn without_a_limit_every_engine_moves_all_it_has() {
        let left = share(arbiter(Bandwidth::Unlimited), &mut Turn::default(), 1, [900, 0, 3, 7]);
        assert_eq!(left, [0; 4]);
    }

    #[test]
    fn engines_that_have_beats_share_the_bandwidth_burst_by_burst() {
        // Two beats a cycle.
        let bytes = 2 * 16 * u64::from(FLOAT.clock_khz) * 1000;
        let arbiter = arbiter(Bandwidth::BytesPerSecond(bytes));
        let mut turn = Turn::default();
        // 40 beats: 16 and 16, then 8 of the first engine.
        assert_eq!(share(arbiter, &mut turn, 20, [100, 0, 100, 0]), [76, 0, 84, 0]);
        // The next engine has its turn.
        assert_eq!(share(arbiter, &mut turn, 8, [100, 0, 100, 0]), [100, 0, 84, 0]);
    }

    #[test]
    fn what_nobody_takes_is_kept_up_to_a_burst_for_each_engine() {
        let bytes = 16 * u64::from(FLOAT.clock_khz) * 1000;
        let arbiter = arbiter(Bandwidth::BytesPerSecond(bytes));
        let mut turn = Turn::default();
        share(arbiter, &mut turn, 1_000, [0; 4]);
        assert_eq!(share(arbiter, &mut turn, 1, [100, 0, 0, 0]), [100 - 4 * 16 - 1, 0, 0, 0]);
    }
}
