//! A windowed design cycle by cycle, from its rules alone: which cycle each entry issues in, when everything
//! is there from the start.

use bitstream_model::interface::profile::Window;

use super::scene::Step;
use bitstream_model::interface::record::live;

/// What a design needs to be known of.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    pub(crate) slot: u64,
    /// Window of each pass.
    pub(crate) windows: Vec<u64>,
    pub(crate) design: Window,
    /// Cycles between two bodies that leave.
    pub(crate) interval: u64,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counted {
    pub(crate) cycles: u64,
    pub(crate) stalls: u64,
    pub(crate) hazards: u32,
}

/// A place as the rules speak of it.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    taken: bool,
    /// Passes that are over, and the cycle since which the last one is.
    over: usize,
    over_at: u64,
    /// Its previous use in the pass that is not over.
    previous: Option<u64>,
}

impl Clock {
    /// Runs a step with those index words, of `moving` bodies; `None` if it never ends.
    pub(crate) fn run(&self, step: &Step, words: &[[u32; 2]], moving: usize) -> Option<Counted> {
        let passes = self.windows.len();
        let entries = if passes == 0 { 0 } else { words.len() };
        let mut issued: Vec<Vec<u64>> = vec![Vec::new(); passes];
        let mut held = vec![Held::default(); self.design.slots as usize];
        let mut leaving: Vec<(usize, u64)> = Vec::new();
        let (mut left, mut leave_due, mut came) = (0, 0, 0);
        let (mut stalls, mut hazards) = (0, 0);
        let mut waited = vec![false; passes];
        let mut idle_since = 0;
        for now in 0_u64.. {
            if now > idle_since + 10_000 {
                return None;
            }
            if now >= leave_due {
                if let Some((place, ready)) = leaving.first().copied() {
                    if now >= ready {
                        leaving.remove(0);
                        held[place].taken = false;
                        left += 1;
                        leave_due = now + self.interval;
                        idle_since = now;
                    }
                }
            }
            for pass in (0..passes).rev() {
                let n = issued[pass].len();
                let due = issued[pass].last().map_or(0, |last| last + self.slot);
                if n == entries || now < due {
                    continue;
                }
                let bubble = step.collisions[n].count == 0;
                let uses: Vec<u32> =
                    words[n].into_iter().filter(|w| !bubble && w & live::PLACE != 0).collect();
                let place = |word: u32| (word & live::PLACE) as usize;
                // Its own record.
                let mut ready = pass == 0
                    || issued[pass - 1].get(n).is_some_and(|at| now >= at + self.windows[pass - 1]);
                // Room behind.
                ready &=
                    pass + 1 == passes || n - issued[pass + 1].len() < self.design.lag as usize;
                let mut conflict = false;
                for word in &uses {
                    let of = &held[place(*word)];
                    if pass == 0 && word & live::FIRST != 0 {
                        ready &= !of.taken;
                        continue;
                    }
                    ready &= of.over == pass && (pass == 0 || now >= of.over_at);
                    conflict |= of.previous.is_some_and(|at| now < at + self.windows[pass])
                        && of.over == pass;
                }
                waited[pass] |= ready && conflict;
                if !ready || conflict {
                    stalls += u64::from(pass == 0);
                    continue;
                }
                for word in &uses {
                    let of = &mut held[place(*word)];
                    if pass == 0 && word & live::FIRST != 0 {
                        *of = Held { taken: true, ..Held::default() };
                        came += 1;
                    }
                    of.previous = Some(now);
                    if word & live::LAST != 0 {
                        of.over = pass + 1;
                        of.over_at = now + self.windows[pass];
                        of.previous = None;
                        if pass + 1 == passes {
                            leaving.push((place(*word), now + self.windows[pass]));
                        }
                    }
                }
                hazards += u32::from(std::mem::take(&mut waited[pass]));
                issued[pass].push(now);
                idle_since = now;
            }
            let all_issued = issued.last().is_none_or(|last| last.len() == entries);
            // What is left was in no collision.
            if all_issued && came == left && left < moving && now >= leave_due {
                came += 1;
                left += 1;
                leave_due = now + self.interval;
                idle_since = now;
            }
            if left == moving && all_issued {
                return Some(Counted { cycles: now.max(leave_due), stalls, hazards });
            }
        }
        None
    }
}
