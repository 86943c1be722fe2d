//! Computes the accelerator's work on records that flow undisturbed, phase by phase.

use super::PerEngine;
use crate::accelerator::Accelerator;
use crate::accelerator::records::striping::{PerStream, ROWS_OUT, STREAMS_MAX, Turns};
use crate::shortcut::deferred::{Ahead, Deferred};
use pgs_interface::stripe::IMPULSES_STREAM;

/// Records that flow one after the other: the bodies of a phase, or the issues of a pass. They are
/// numbered from the first one of the flow.
pub(super) trait Records {
    /// Whether records give beats to the outputs; if not, these are empty.
    const RESULTS: bool;

    /// How many records can be taken, from record `first` on: the FIFOs hold all their beats, and
    /// have room for the beats that they give.
    fn ready(&self, first: usize, held: &PerEngine, depth: usize) -> usize;

    /// The most cycles that records take.
    fn cycles_max(&self, first: usize, records: usize) -> u64;

    /// The beats that records take from each input, and give to each output.
    fn beats(&self, first: usize, records: usize) -> (PerStream, PerStream);

    /// The accelerator takes records `cycles` after the flow began; returns the cycles that they take.
    fn enter(&mut self, first: usize, records: usize, cycles: u64) -> u64;
}

/// The issues of a pass, whose impulses may go out.
#[derive(Debug)]
pub(super) struct Issues<'a, const IMPULSES: bool> {
    pub(super) accelerator: &'a mut Accelerator,
    pub(super) deferred: &'a mut Deferred,
    pub(super) ahead: Ahead,
    /// Collisions of the pass before the flow.
    pub(super) done: usize,
}

/// Whole issues that the FIFOs hold, of `share` beats on each input.
pub(super) fn issues_held(share: &PerStream, held: &PerEngine) -> usize {
    let mut issues = usize::MAX;
    for k in 0..STREAMS_MAX {
        if let Some(held) = held[2 * k].checked_div(share[k]) {
            issues = issues.min(held);
        }
    }
    issues
}

impl<const IMPULSES: bool> Records for Issues<'_, IMPULSES> {
    const RESULTS: bool = IMPULSES;

    #[inline(always)]
    fn ready(&self, _first: usize, held: &PerEngine, depth: usize) -> usize {
        let issues = issues_held(&self.ahead.share, held);
        if !IMPULSES {
            return issues;
        }
        issues.min(depth - held[2 * IMPULSES_STREAM + 1])
    }

    #[inline(always)]
    fn cycles_max(&self, _first: usize, records: usize) -> u64 {
        records as u64 * self.ahead.interval_max
    }

    #[inline(always)]
    fn beats(&self, _first: usize, records: usize) -> (PerStream, PerStream) {
        let mut given = [0; STREAMS_MAX];
        if IMPULSES {
            given[IMPULSES_STREAM] = records;
        }
        (self.ahead.share.map(|share| records * share), given)
    }

    #[inline(always)]
    fn enter(&mut self, first: usize, records: usize, cycles: u64) -> u64 {
        let clock = self.accelerator.clock + cycles;
        self.deferred.issues_enter(self.accelerator, self.done, (first, records), clock)
    }
}

/// Bodies of `ROWS` rows each that are loaded, or leave with their results, on streams that take turns. The
/// number of streams divides every count of beats: it is a constant.
#[derive(Debug)]
pub(super) struct Bodies<const STREAMS: usize, const ROWS: usize, const RESULTS: bool> {
    /// Bodies of the phase before the flow.
    pub(super) done: usize,
}

impl<const STREAMS: usize, const ROWS: usize, const RESULTS: bool> Bodies<STREAMS, ROWS, RESULTS> {
    const TURNS: Turns = Turns { streams: STREAMS };

    /// `count` of the rows before the first of some bodies, and of the rows up to the last one.
    fn rows<T>(
        &self,
        first: usize,
        records: usize,
        rows: usize,
        count: impl Fn(usize) -> T,
    ) -> [T; 2] {
        [self.done + first, self.done + first + records].map(|bodies| count(rows * bodies))
    }

    fn beats_of(&self, first: usize, records: usize, rows: usize) -> PerStream {
        let [before, after] = self.rows(first, records, rows, |rows| Self::TURNS.counts(rows));
        std::array::from_fn(|k| after[k] - before[k])
    }
}

impl<const STREAMS: usize, const ROWS: usize, const RESULTS: bool> Records
    for Bodies<STREAMS, ROWS, RESULTS>
{
    const RESULTS: bool = RESULTS;

    #[inline(always)]
    fn ready(&self, first: usize, held: &PerEngine, depth: usize) -> usize {
        let body = self.done + first;
        let came = Self::TURNS.counts(ROWS * body);
        let there = Self::TURNS.contiguous(|k| came[k] + held[2 * k]) / ROWS - body;
        if !RESULTS {
            return there;
        }
        let went = Self::TURNS.counts(ROWS_OUT * body);
        let room = Self::TURNS.contiguous(|k| went[k] + depth - held[2 * k + 1]);
        there.min(room / ROWS_OUT - body)
    }

    /// A row a cycle on each stream: a result takes longer than its pose.
    #[inline(always)]
    fn cycles_max(&self, first: usize, records: usize) -> u64 {
        let rows = if RESULTS { ROWS_OUT } else { ROWS };
        let [before, after] = self.rows(first, records, rows, |rows| Self::TURNS.cycles(rows));
        after - before
    }

    #[inline(always)]
    fn beats(&self, first: usize, records: usize) -> (PerStream, PerStream) {
        let given =
            if RESULTS { self.beats_of(first, records, ROWS_OUT) } else { [0; STREAMS_MAX] };
        (self.beats_of(first, records, ROWS), given)
    }

    #[inline(always)]
    fn enter(&mut self, first: usize, records: usize, _cycles: u64) -> u64 {
        self.cycles_max(first, records)
    }
}
