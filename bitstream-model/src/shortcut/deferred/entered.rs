//! Keeps in mind when the last collisions of a pass entered, as long as none of them had to wait.
//!
//! Where no two collisions within a hazard window share a body that moves, none ever waits, and the
//! hazard bookkeeping is left out. Should the pass bring something else after all, the bookkeeping is
//! made up for from the collisions kept here.

use crate::accelerator::hazards::Pipeline;
use crate::shortcut::batch::Batch;

/// Issue slots of a hazard window that are kept in mind.
const SLOTS_MAX: usize = 512;

/// Collisions that entered, an issue an interval.
#[derive(Debug, Clone, Copy, Default)]
struct Run {
    clock: u64,
    first: usize,
    collisions: usize,
}

/// The last collisions that entered.
#[derive(Debug)]
pub(super) struct Entered {
    /// Collisions that enter together.
    together: usize,
    /// Cycles from one issue to the next.
    interval: u64,
    /// Issue slots from a collision to the first that sees its write-back.
    slots: usize,
    /// Whether every collision of the pass has entered as soon as it had come.
    even: bool,
    runs: Box<[Run]>,
    next: usize,
}

impl Entered {
    pub(super) fn new(together: usize, interval: u64) -> Self {
        let runs = vec![Run::default(); SLOTS_MAX].into();
        Self { together, interval, slots: 0, even: true, runs, next: 0 }
    }

    /// A pass begins, with a hazard window of `slots` issue slots. `distance` is the least number of
    /// issues between two collisions that share a body.
    pub(super) fn begin_pass(&mut self, slots: u64, distance: usize) {
        self.slots = usize::try_from(slots).unwrap_or(usize::MAX);
        self.runs.fill(Run::default());
        self.next = 0;
        self.even = self.slots <= SLOTS_MAX && distance >= self.slots;
    }

    /// Whether every collision of the pass has entered as soon as it had come.
    pub(super) fn even(&self) -> bool {
        self.even
    }

    /// Issue slots of the hazard window.
    pub(super) fn slots(&self) -> usize {
        self.slots
    }

    /// Cycles from one issue to the next that does not wait.
    pub(super) fn interval(&self) -> u64 {
        self.interval
    }

    /// Collisions enter, an issue an interval from that clock on; the first one begins an issue.
    pub(super) fn enter(&mut self, clock: u64, first: usize, collisions: usize) {
        self.runs[self.next] = Run { clock, first, collisions };
        self.next = (self.next + 1) % SLOTS_MAX;
    }

    /// More collisions are decoded: the least distance is known anew.
    pub(super) fn distance_is(&mut self, distance: usize, batch: &Batch, pipeline: &mut Pipeline) {
        if distance < self.slots {
            self.end_even(batch, pipeline);
        }
    }

    /// From now on collisions may have to wait for the ones that have entered.
    pub(super) fn end_even(&mut self, batch: &Batch, pipeline: &mut Pipeline) {
        if !std::mem::replace(&mut self.even, false) {
            return;
        }
        let (newer, older) = self.runs.split_at(self.next);
        for Run { clock, first, collisions } in older.iter().chain(newer) {
            for (at, index) in (*first..first + collisions).enumerate() {
                if let Some(entry) = batch.entry(index) {
                    let issue = (at / self.together) as u64;
                    pipeline.entered(clock + issue * self.interval, &entry);
                }
            }
        }
    }
}
