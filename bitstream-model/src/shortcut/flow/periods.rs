//! Passes over whole periods of a flow whose state recurs.
//!
//! What flows settles soon: FIFOs, the memory's credit and its turns come to the same state again, and
//! from then on the same slices follow.

use super::records::Records;
use super::{Flow, FlowState, Flowed, Limits};
use crate::board::STARVED_CYCLES;
use crate::cast::index;

/// A state that the flow may come to again (Brent's algorithm: it is looked out for twice as long
/// each time).
#[derive(Debug)]
pub(super) struct Periods {
    seen: Option<(FlowState, Flowed)>,
    /// Slices since then, and after how many of them a newer state is taken.
    since: usize,
    patience: usize,
}

impl Default for Periods {
    fn default() -> Self {
        Self { seen: None, since: 0, patience: 1 }
    }
}

impl Flowed {
    /// What has flowed since then.
    fn since(&self, then: &Self) -> Self {
        Self {
            cycles: self.cycles - then.cycles,
            waits: self.waits - then.waits,
            records: self.records - then.records,
            beats: std::array::from_fn(|k| self.beats[k] - then.beats[k]),
        }
    }

    /// The same `times` over.
    fn times(&self, times: u64) -> Self {
        let n = index(times);
        Self {
            cycles: times * self.cycles,
            waits: times * self.waits,
            records: n * self.records,
            beats: self.beats.map(|beats| n * beats),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            cycles: self.cycles + other.cycles,
            waits: self.waits + other.waits,
            records: self.records + other.records,
            beats: std::array::from_fn(|k| self.beats[k] + other.beats[k]),
        }
    }
}

impl Periods {
    /// Passes over the periods that fit before the limits, but not over the last `last` records, as
    /// soon as a period is known. Returns whether it is.
    pub(super) fn pass_over(
        &mut self,
        flow: &mut Flow,
        records: &impl Records,
        last: usize,
    ) -> bool {
        let Some((state, flowed)) = &self.seen else {
            self.seen = Some((flow.state, flow.flowed));
            return false;
        };
        if *state == flow.state {
            let period = flow.flowed.since(flowed);
            let times = fitting(flow, &period, records, last);
            flow.flowed = flow.flowed.plus(&period.times(times));
            return true;
        }
        self.since += 1;
        if self.since == self.patience {
            *self = Self {
                seen: Some((flow.state, flow.flowed)),
                since: 0,
                patience: 2 * self.patience,
            };
        }
        false
    }
}

/// How many periods fit, with room for a last slice, before the last `last` records.
fn fitting(flow: &Flow, period: &Flowed, records: &impl Records, last: usize) -> u64 {
    let Flow { rules, limits: Limits { cycles, records: most, beats }, flowed, .. } = flow;
    let slice = STARVED_CYCLES.max(records.cycles_max(0, rules.depth));
    // `Flow::slice` must not meet a limit in any slice of these periods.
    let fits = |limit: u64, flowed: u64, slice: u64, period: u64| {
        limit.saturating_sub(flowed + slice + 1).checked_div(period)
    };
    let of_beats = (0..beats.len()).map(|engine| {
        let [limit, flowed, depth, period] =
            [beats[engine], flowed.beats[engine], rules.depth, period.beats[engine]];
        fits(limit as u64, flowed as u64, depth as u64, period as u64)
    });
    let of_records =
        fits(*most as u64, flowed.records as u64, rules.depth as u64, period.records as u64);
    let of_cycles = fits(*cycles, flowed.cycles, slice, period.cycles);
    let times = of_beats.chain([of_records, of_cycles]).flatten().min().unwrap_or(0);
    let kept = last.div_ceil(period.records.max(1));
    times.saturating_sub(kept as u64)
}
