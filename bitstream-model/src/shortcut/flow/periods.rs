//! This file finds out what comes to the same again where every issue takes an interval, and leaps
//! over it.

use super::collisions::{Flowed, Limits, Pace, Rules, Standing};
use crate::accelerator::records::striping::STREAMS_MAX;
use crate::board::STARVED_CYCLES;
use crate::cast::index;

/// The most slices of a period that are remembered.
const SLICES_MAX: usize = 1 << 11;

/// Slices in which a period may not be met, beside twice as many as it has, until it is forgotten.
const MISSED_MAX: usize = 16;

/// The slices of a period: how it stands at the beginning of each, and what has flowed until then.
#[derive(Debug, Default)]
pub(crate) struct Recurrence {
    /// For what it was found.
    rules: Option<Rules>,
    slices: Vec<(Standing, Flowed)>,
    /// The same sorted by the standing, with the number of the slice.
    places: Vec<(Standing, usize)>,
    /// What flows in a whole period.
    period: Flowed,
    /// What was seen some slices ago, how many, and after how many it is forgotten.
    seen: Option<(Standing, Flowed)>,
    since: usize,
    patience: usize,
    /// Slices of this run in which the known period was not met.
    missed: usize,
}

impl Flowed {
    /// So many times over, and then that.
    fn repeated(&self, times: u64, then: &Self) -> Self {
        let of = index(times);
        Self {
            cycles: times * self.cycles + then.cycles,
            waits: times * self.waits + then.waits,
            issues: of * self.issues + then.issues,
            beats: std::array::from_fn(|k| of * self.beats[k] + then.beats[k]),
        }
    }

    /// What has flowed since then.
    fn since(&self, then: &Self) -> Self {
        Self {
            cycles: self.cycles - then.cycles,
            waits: self.waits - then.waits,
            issues: self.issues - then.issues,
            beats: std::array::from_fn(|k| self.beats[k] - then.beats[k]),
        }
    }

    /// How often it fits into that.
    fn fits_into(&self, room: &Limits) -> u64 {
        let of_beats =
            (0..STREAMS_MAX).map(|k| (room.beats[k] as u64).checked_div(self.beats[k] as u64));
        let issues = (room.issues as u64).checked_div(self.issues as u64);
        let cycles = room.cycles.checked_div(self.cycles);
        of_beats.chain([issues, cycles]).flatten().min().unwrap_or(0)
    }
}

impl Recurrence {
    #[cfg(test)]
    pub(crate) fn is_known(&self) -> bool {
        !self.places.is_empty()
    }

    /// Forgets what it knows of other rules.
    pub(crate) fn suit(&mut self, rules: &Rules) {
        if self.rules != Some(*rules) {
            self.rules = Some(*rules);
            self.slices.clear();
            self.slices.reserve(SLICES_MAX);
            self.places.clear();
            self.places.reserve(SLICES_MAX);
        }
        self.seen = None;
        self.missed = 0;
    }

    /// Looks how it stands before a slice, until a period is known. One that is not met is forgotten
    /// for another: what flows may settle in several ways.
    pub(crate) fn look(&mut self, standing: &Standing, flowed: &Flowed) {
        if !self.places.is_empty() {
            self.missed += 1;
            if self.missed <= 2 * self.slices.len() + MISSED_MAX {
                return;
            }
            self.places.clear();
            self.seen = None;
        }
        let here = (*standing, *flowed);
        let Some(seen) = self.seen else {
            (self.seen, self.since, self.patience) = (Some(here), 0, 1);
            self.slices.clear();
            self.slices.push((*standing, Flowed::default()));
            return;
        };
        if seen.0 == *standing {
            self.period = flowed.since(&seen.1);
            self.places.extend((0..).zip(&self.slices).map(|(k, (standing, _))| (*standing, k)));
            self.places.sort_unstable();
            return;
        }
        // Each time it waits twice as long for the same to come again.
        self.since += 1;
        if self.since == self.patience && self.patience < SLICES_MAX {
            (self.seen, self.since, self.patience) = (Some(here), 0, 2 * self.patience);
            self.slices.clear();
        }
        if self.slices.len() < SLICES_MAX {
            let since = flowed.since(&self.seen.map_or(*flowed, |(_, flowed)| flowed));
            self.slices.push((*standing, since));
        }
    }

    /// Leaps over what is known, but for the last `last` issues before a limit; whether it is
    /// known.
    pub(crate) fn leap(&self, pace: &mut Pace, last: usize) -> bool {
        let place = self.places.binary_search_by_key(&pace.standing, |(standing, _)| *standing);
        let Ok(place) = place else { return false };
        let now = self.places[place].1;
        let (rules, limits, before) = (&pace.rules, &pace.limits, &self.slices[now].1);
        // What is left from the beginning of this period on, with room for a last slice.
        let left = |limit: u64, flowed: u64, before: u64, slice: u64| {
            (limit + before).checked_sub(flowed + slice + 1)
        };
        let beats = |limit: usize, flowed: usize, before: usize| {
            left(limit as u64, flowed as u64, before as u64, rules.depth as u64).map(index)
        };
        let room = || {
            let flowed = &pace.flowed;
            let slice = STARVED_CYCLES.max(rules.depth as u64 * rules.interval_max);
            let mut room = Limits {
                cycles: left(limits.cycles, flowed.cycles, before.cycles, slice)?,
                issues: beats(limits.issues, flowed.issues, before.issues)?,
                beats: [0; STREAMS_MAX],
            };
            for k in 0..STREAMS_MAX {
                if rules.share[k] > 0 {
                    room.beats[k] = beats(limits.beats[k], flowed.beats[k], before.beats[k])?;
                }
            }
            Some(room)
        };
        // The last slice that begins with room for it.
        let find = |room: &Limits| {
            let times = self.period.fits_into(room);
            let fits = |flowed: &Flowed| {
                let all = self.period.repeated(times, flowed);
                let beats = all.beats.iter().zip(room.beats).all(|(flowed, room)| *flowed <= room);
                beats && all.cycles <= room.cycles && all.issues <= room.issues
            };
            let behind = self.slices.partition_point(|(_, flowed)| fits(flowed));
            let slice = behind.checked_sub(1)?;
            Some((times, slice, self.period.repeated(times, &self.slices[slice].1)))
        };
        let target = || {
            let mut room = room()?;
            let (_, _, flowed) = find(&room)?;
            room.issues = flowed.issues.checked_sub(last)?;
            find(&room)
        };
        let Some((times, slice, flowed)) = target() else { return true };
        if times > 0 || slice > now {
            pace.flowed = flowed.since(before).repeated(1, &pace.flowed);
            pace.standing = self.slices[slice].0;
        }
        true
    }
}
