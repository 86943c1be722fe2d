//! A windowed design cycle by cycle, from its rules alone: the cycle in which each entry issues if
//! all records are there from the start.

use pgs_interface::profile::Window;

use super::scene::Step;
use pgs_interface::record::live;

/// The parameters of a design that decide its cycles.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    pub(crate) slot: u64,
    /// Cycles in which a unit takes `per_issue` entries.
    pub(crate) interval: u64,
    pub(crate) per_issue: usize,
    /// Unit of each pass.
    pub(crate) units: Vec<u32>,
    /// Window of each pass.
    pub(crate) windows: Vec<u64>,
    pub(crate) design: Window,
    /// Cycles between two bodies that leave.
    pub(crate) leave_interval: u64,
}

/// The counters of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counted {
    pub(crate) cycles: u64,
    pub(crate) stalls: u64,
    pub(crate) hazards: u32,
}

/// A place with the state that the rules need.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    taken: bool,
    /// Passes that are over, and the cycle at which the last of them ended.
    over: usize,
    over_at: u64,
    /// Its previous use in the current pass.
    previous: Option<u64>,
}

impl Clock {
    /// Runs a step of `moving` bodies with the index words `words`; `None` if it never ends.
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
            let first = leaving.first().filter(|(_, ready)| now >= leave_due.max(*ready));
            if let Some((place, _)) = first.copied() {
                leaving.remove(0);
                held[place].taken = false;
                left += 1;
                leave_due = now + self.leave_interval;
                idle_since = now;
            }
            // Passes issue until none can in this cycle.
            loop {
                let mut next: Option<usize> = None;
                for pass in 0..passes {
                    let n = issued[pass].len();
                    if n == entries {
                        continue;
                    }
                    let uses = uses(step, words, n);
                    let (ready, conflict) = self.ready(pass, n, now, &uses, &issued, &held);
                    waited[pass] |= ready && conflict;
                    let last = |pass: usize| issued[pass].last().copied();
                    if ready
                        && !conflict
                        && self.unit_is_free(pass, now, &issued)
                        && next.is_none_or(|other| last(pass) < last(other))
                    {
                        next = Some(pass);
                    }
                }
                let Some(pass) = next else { break };
                let n = issued[pass].len();
                for word in uses(step, words, n) {
                    let of = &mut held[(word & live::PLACE) as usize];
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
                            leaving.push(((word & live::PLACE) as usize, of.over_at));
                        }
                    }
                }
                hazards += u32::from(std::mem::take(&mut waited[pass]));
                issued[pass].push(now);
                idle_since = now;
            }
            if let Some(first) = issued.first() {
                let late = first.last().is_none_or(|last| now >= last + self.slot);
                let idle = first.len() < entries && self.unit_is_free(0, now, &issued);
                stalls += u64::from(late && idle);
            }
            let all_issued = issued.last().is_none_or(|last| last.len() == entries);
            // The remaining bodies were in no collision.
            if all_issued && came == left && left < moving && now >= leave_due {
                came += 1;
                left += 1;
                leave_due = now + self.leave_interval;
                idle_since = now;
            }
            if left == moving && all_issued {
                return Some(Counted { cycles: now.max(leave_due), stalls, hazards });
            }
        }
        None
    }

    /// Whether an entry can issue but for its unit and its hazards, and whether it has a hazard: a
    /// previous use of one of its bodies in the same pass is under way.
    fn ready(
        &self,
        pass: usize,
        n: usize,
        now: u64,
        uses: &[u32],
        issued: &[Vec<u64>],
        held: &[Held],
    ) -> (bool, bool) {
        // Its own record, and room behind.
        let mut ready = pass == 0
            || issued[pass - 1].get(n).is_some_and(|at| now >= at + self.windows[pass - 1]);
        ready &= pass + 1 == issued.len() || n - issued[pass + 1].len() < self.design.lag as usize;
        let mut conflict = false;
        for word in uses {
            let of = &held[(word & live::PLACE) as usize];
            if pass == 0 && word & live::FIRST != 0 {
                ready &= !of.taken;
                continue;
            }
            ready &= of.over == pass && (pass == 0 || now >= of.over_at);
            let previous = of.previous.filter(|_| of.over == pass);
            conflict |= previous.is_some_and(|at| now < at + self.windows[pass]);
        }
        (ready, conflict)
    }

    /// Whether the unit of a pass can take one more entry in this interval.
    fn unit_is_free(&self, pass: usize, now: u64, issued: &[Vec<u64>]) -> bool {
        let of_unit = issued.iter().zip(&self.units).filter(|(_, unit)| **unit == self.units[pass]);
        let recent = |issues: &Vec<u64>| {
            issues.iter().rev().take_while(|at| **at + self.interval > now).count()
        };
        of_unit.map(|(issues, _)| recent(issues)).sum::<usize>() < self.per_issue
    }
}

/// The index words of an entry that name a moving body.
fn uses(step: &Step, words: &[[u32; 2]], n: usize) -> Vec<u32> {
    let moving = |word: &u32| word & live::PLACE != 0;
    match step.collisions[n].count {
        0 => Vec::new(),
        _ => words[n].into_iter().filter(moving).collect(),
    }
}
