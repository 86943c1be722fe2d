//! Passes over whole periods of a flow whose state recurs.
//!
//! A flow settles soon: FIFOs, the memory's credit and its turns come to the same state again, and
//! from then on the same slices follow. A period that is found serves the flows after it, which settle
//! in the same way as a rule.

use super::records::Records;
use super::{Flow, FlowState, Flowed, Limits};
use crate::board::STARVED_CYCLES;
use crate::cast::index;

/// The most slices of a period.
const SLICES_MAX: usize = 1 << 11;

/// Finds periods (by Brent's algorithm) in flows of one kind of record on one board.
#[derive(Debug)]
pub(super) struct Periods {
    /// The states of the last period found, sorted, and what flows in it.
    known: Vec<FlowState>,
    period: Flowed,
    /// A state of this flow that may recur.
    seen: Option<(FlowState, Flowed)>,
    /// The states from it on, and after how many a newer one is looked out for.
    since: Vec<FlowState>,
    patience: usize,
}

impl Flowed {
    /// The flow since then.
    fn since(&self, then: &Self) -> Self {
        Self {
            cycles: self.cycles - then.cycles,
            waits: self.waits - then.waits,
            records: self.records - then.records,
            beats: std::array::from_fn(|k| self.beats[k] - then.beats[k]),
        }
    }

    /// This, and then `period` some `times` over.
    fn with(&self, period: &Self, times: u64) -> Self {
        let n = index(times);
        Self {
            cycles: self.cycles + times * period.cycles,
            waits: self.waits + times * period.waits,
            records: self.records + n * period.records,
            beats: std::array::from_fn(|k| self.beats[k] + n * period.beats[k]),
        }
    }
}

impl Periods {
    /// Nothing is known. All memory is allocated here: a step allocates none.
    pub(super) fn new() -> Self {
        Self {
            known: Vec::with_capacity(SLICES_MAX),
            period: Flowed::default(),
            seen: None,
            since: Vec::with_capacity(SLICES_MAX),
            patience: 1,
        }
    }

    /// A flow begins.
    pub(super) fn begin(&mut self) {
        self.seen = None;
        self.patience = 1;
    }

    /// Passes over the periods that fit before the limits, but not over the last `last` records, as
    /// soon as the flow is in a period. Returns whether it is.
    pub(super) fn pass_over(
        &mut self,
        flow: &mut Flow,
        records: &impl Records,
        last: usize,
    ) -> bool {
        let met = self.known.binary_search(&flow.state).is_ok();
        if !met && !self.recurs(flow) {
            return false;
        }
        let times = fitting(flow, &self.period, records, last);
        flow.flowed = flow.flowed.with(&self.period, times);
        true
    }

    /// Whether the state of a flow has recurred for the first time: then the period is known.
    fn recurs(&mut self, flow: &Flow) -> bool {
        match &self.seen {
            Some((state, flowed)) if *state == flow.state => {
                self.period = flow.flowed.since(flowed);
                std::mem::swap(&mut self.known, &mut self.since);
                self.known.sort_unstable();
                return true;
            }
            Some(_) if self.since.len() < self.patience => {}
            // Each time it waits twice as long for the same state.
            _ if self.patience < SLICES_MAX => {
                self.seen = Some((flow.state, flow.flowed));
                self.since.clear();
                self.patience *= 2;
            }
            _ => return false,
        }
        self.since.push(flow.state);
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
