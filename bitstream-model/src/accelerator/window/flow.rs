//! Schedule of the passes: when each may issue its next entry.
//!
//! With w(k) the window of pass k, entry n can issue to pass k at the first cycle that is
//!
//! - not before the issue of entry n - 1 to pass k,
//! - w(k-1) or more after the issue of entry n to pass k - 1,
//! - w(k-1) or more after the last uses of its bodies in pass k - 1,
//! - w(k) or more after the previous uses of its bodies in pass k (waiting for this is a hazard),
//! - not before the issue of entry n - lag to pass k + 1, which makes room behind pass k,
//!
//! and in which the pass' unit is free. A unit takes `per_issue` entries in an initiation interval.
//! If several of its passes can issue, the pass issues whose last issue lies furthest back. When
//! all of them can, each issues an entry in every slot of T cycles.
//!
//! Pass 0 also needs the record, the velocities that come with it, and free places for them.

use std::collections::VecDeque;

use super::entry::{Entry, Use};
use super::place::{Leaving, Place};

/// A cycle that never comes.
pub(super) const NEVER: u64 = u64::MAX;

/// Parameters of the schedule that stay the same throughout a step.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    /// Cycles in which every pass issues one entry.
    pub(super) slot: u64,
    /// Cycles in which a unit takes `per_issue` entries.
    pub(super) interval: u64,
    pub(super) per_issue: usize,
    /// Most entries between one pass and the next.
    pub(super) lag: usize,
    pub(super) places: usize,
    pub(super) collisions: usize,
    /// Window of each pass.
    pub(super) windows: Vec<u64>,
    /// Unit of each pass.
    pub(super) units: Vec<usize>,
}

/// One unit.
#[derive(Debug, Clone)]
struct Unit {
    /// The cycles from which it can take its next entries, the earliest first.
    free: VecDeque<u64>,
}

/// An entry about to issue: its bodies, and the cycle from which it can be read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Next {
    pub(super) uses: [Use; 2],
    pub(super) written: u64,
}

/// One pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    /// Its next entry.
    pub(super) next: usize,
    /// One slot after its previous issue.
    pub(super) due: u64,
    window: u64,
    unit: usize,
    /// The cycle at which the next entry can issue if its unit is free; [`NEVER`] while
    /// something else has to happen first.
    pub(super) ready: u64,
    /// Whether the next entry has waited for a previous use in the same pass.
    pub(super) waited: bool,
}

/// Delay lines, places and the schedule of all passes.
#[derive(Debug)]
pub(super) struct Flow {
    pub(super) shape: Shape,
    pub(super) passes: Vec<Pass>,
    units: Vec<Unit>,
    /// Entries that have issued to the first pass and not to the last, the oldest first.
    entries: VecDeque<Entry>,
    pub(super) places: Vec<Place>,
    pub(super) leaving: VecDeque<Leaving>,
}

impl Flow {
    pub(super) fn new(shape: Shape) -> Self {
        let pass = |(window, unit): (&u64, &usize)| Pass {
            next: 0,
            due: 0,
            window: *window,
            unit: *unit,
            ready: NEVER,
            waited: false,
        };
        let units = shape.units.iter().max().map_or(0, |last| last + 1);
        let unit = Unit { free: std::iter::repeat_n(0, shape.per_issue.max(1)).collect() };
        Self {
            passes: shape.windows.iter().zip(&shape.units).map(pass).collect(),
            units: vec![unit; units],
            entries: VecDeque::new(),
            places: vec![Place::default(); shape.places],
            leaving: VecDeque::new(),
            shape,
        }
    }

    /// Whether every entry has issued to every pass.
    pub(super) fn issued_all(&self) -> bool {
        self.passes.last().is_none_or(|pass| pass.next == self.shape.collisions)
    }

    /// Whether there is room for the next entry of a pass behind it.
    pub(super) fn has_room(&self, pass: usize) -> bool {
        let behind = self.passes.get(pass + 1);
        behind.is_none_or(|behind| self.passes[pass].next - behind.next < self.shape.lag)
    }

    /// The cycle from which an entry whose records have all come can issue to a pass, if its unit
    /// is free.
    pub(super) fn when(&mut self, pass: usize, entry: Next, now: u64) -> u64 {
        let mut at = entry.written.max(now);
        let mut written = 0;
        let born = |of: &Use| pass == 0 && of.first;
        for of in entry.uses.iter().filter(|of| of.moves() && !born(of)) {
            let place = &self.places[of.place];
            if place.pass != pass {
                return NEVER;
            }
            if place.used {
                written = written.max(place.ready);
            } else {
                at = at.max(place.ready);
            }
        }
        self.passes[pass].waited |= written > at;
        at.max(written)
    }

    /// Computes again when a pass behind the first one can issue, after a change of its conditions.
    pub(super) fn reschedule(&mut self, pass: usize, now: u64) {
        if pass == 0 || pass >= self.passes.len() {
            return;
        }
        let next = self.passes[pass].next;
        self.passes[pass].ready = if next == self.passes[pass - 1].next || !self.has_room(pass) {
            NEVER
        } else {
            let Entry { uses, written, .. } = self.entries[self.at(next)];
            self.when(pass, Next { uses, written }, now)
        };
    }

    /// The cycle from which the unit of a pass can take its next entry.
    pub(super) fn free(&self, pass: &Pass) -> u64 {
        self.units[pass.unit].free.front().copied().unwrap_or(0)
    }

    /// The pass that issues first, and when.
    pub(super) fn earliest(&self) -> (u64, usize) {
        let mut earliest = ((NEVER, NEVER), 0);
        for (number, pass) in self.passes.iter().enumerate() {
            if pass.ready != NEVER {
                let at = (pass.ready.max(self.free(pass)), pass.due);
                if at < earliest.0 {
                    earliest = (at, number);
                }
            }
        }
        (earliest.0.0, earliest.1)
    }

    /// Index of an entry in the delay lines.
    fn at(&self, number: usize) -> usize {
        number - self.passes.last().map_or(0, |last| last.next)
    }

    /// An entry has issued to the first pass.
    pub(super) fn push(&mut self, entry: Entry) {
        self.entries.push_back(entry);
    }

    /// The next entry of a pass, if it has issued to the first pass, and the places.
    pub(super) fn parts(&mut self, pass: usize) -> Option<(&mut Entry, &mut [Place])> {
        let at = self.at(self.passes[pass].next);
        Some((self.entries.get_mut(at)?, &mut self.places))
    }

    /// Issues the next entry of a pass at cycle `now`. Returns whether it had waited for a previous
    /// use of a body in the same pass.
    pub(super) fn issue(&mut self, pass: usize, now: u64) -> bool {
        let written = now + self.passes[pass].window;
        let last_pass = pass + 1 == self.passes.len();
        let Some((entry, _)) = self.parts(pass) else { return false };
        entry.written = written;
        let uses = entry.uses;
        for of in uses.into_iter().filter(Use::moves) {
            self.places[of.place].issued(pass, of.last, written);
            if of.last && last_pass {
                self.leaving.push_back(Leaving { place: of.place, ready: written });
            }
        }
        if last_pass {
            self.entries.pop_front();
        }
        let this = &mut self.passes[pass];
        this.next += 1;
        this.due = now + self.shape.slot;
        let free = &mut self.units[this.unit].free;
        free.pop_front();
        free.push_back(now + self.shape.interval);
        std::mem::take(&mut this.waited)
    }

    /// The collision that waits for ever, when nothing can issue any more.
    pub(super) fn stuck(&self) -> usize {
        match self.passes.as_slice() {
            [first, second, ..] if first.next == self.shape.collisions || !self.has_room(0) => {
                second.next
            }
            [first, ..] => first.next.min(self.shape.collisions.saturating_sub(1)),
            [] => 0,
        }
    }
}
