//! Measures a schedule: hazards, lost updates, empty entries, bodies alive, spans.

use zynq_pgs::order::{IssueWindow, OrderInput, Schedule};

/// The cost of a schedule on hardware with a given window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OrderReport {
    /// Entries with a collision.
    pub(super) collisions: usize,
    /// Entries without a collision.
    pub(super) empty: usize,
    /// Issue slots.
    pub(super) slots: usize,
    /// Collisions that share a moving body with one of the `depth - 1` issue slots before, or with
    /// one before in its own slot: without an interlock they read a stale velocity.
    pub(super) hazards: usize,
    /// Write-backs that a later write-back of the same body overwrites without having read them:
    /// without an interlock these impulses are lost.
    pub(super) lost_updates: usize,
    /// Most moving bodies alive in one issue slot. A body is alive from its first use to its last.
    pub(super) most_alive: usize,
    /// Longest span of a moving body, from its first use to its last, issue slots.
    pub(super) longest_span: usize,
    /// Mean span of the moving bodies that are used, issue slots.
    pub(super) mean_span: f64,
}

impl OrderReport {
    /// Measures a schedule of the collisions of an input that the driver has checked.
    pub(super) fn measure(
        schedule: &Schedule,
        input: &OrderInput<'_>,
        window: IssueWindow,
    ) -> Self {
        let depth = window.depth() as usize;
        let mut last: Vec<Option<usize>> = vec![None; input.moving.len()];
        let (mut hazards, mut lost_updates) = (0, 0);
        let lives = lives(schedule, input, window.per_issue(), |slot, bodies| {
            let mut stale = 0;
            for body in bodies {
                let before = last[body as usize].replace(slot);
                stale += usize::from(before.is_some_and(|before| slot - before < depth));
            }
            hazards += usize::from(stale > 0);
            lost_updates += stale;
        });
        let spans = || lives.iter().flatten().map(|(first, last)| last - first);
        let used = spans().count();
        let total: usize = spans().sum();
        let slots = schedule.len().div_ceil(window.per_issue() as usize);
        let curve = curve(&lives, slots);
        Self {
            collisions: schedule.collisions(),
            empty: schedule.empty(),
            slots,
            hazards,
            lost_updates,
            most_alive: curve.into_iter().max().unwrap_or(0) as usize,
            longest_span: spans().max().unwrap_or(0),
            mean_span: share(total, used),
        }
    }

    /// Share of the collisions that meet a hazard, 0 to 1.
    pub(super) fn hazard_share(&self) -> f64 {
        share(self.hazards, self.collisions)
    }

    /// Empty entries per collision.
    pub(super) fn empty_share(&self) -> f64 {
        share(self.empty, self.collisions)
    }
}

/// Moving bodies alive in each issue slot (thesis, figure 4.13).
pub(super) fn live_curve(
    schedule: &Schedule,
    input: &OrderInput<'_>,
    window: IssueWindow,
) -> Vec<u32> {
    let lives = lives(schedule, input, window.per_issue(), |_, _| ());
    curve(&lives, schedule.len().div_ceil(window.per_issue() as usize))
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// First and last slot of each moving body that is used. Calls `each` with every collision's slot
/// and moving bodies.
fn lives(
    schedule: &Schedule,
    input: &OrderInput<'_>,
    per_issue: u32,
    mut each: impl FnMut(usize, &mut dyn Iterator<Item = u32>),
) -> Vec<Option<(usize, usize)>> {
    let mut lives: Vec<Option<(usize, usize)>> = vec![None; input.moving.len()];
    for (entry, found) in schedule.iter().enumerate() {
        let Some(found) = found else { continue };
        let pair = &input.pairs[found as usize];
        let slot = entry / per_issue as usize;
        // A collision without contact points has no bodies.
        let moves = |body: &u32| input.moving.get(*body as usize) == Some(&true);
        let moving = pair.iter().copied().filter(moves);
        for body in moving.clone() {
            let life = lives[body as usize].get_or_insert((slot, slot));
            life.1 = slot;
        }
        each(slot, &mut moving.into_iter());
    }
    lives
}

/// Bodies alive in each slot.
fn curve(lives: &[Option<(usize, usize)>], slots: usize) -> Vec<u32> {
    let (mut born, mut died) = (vec![0_u32; slots], vec![0_u32; slots]);
    for (first, last) in lives.iter().flatten() {
        born[*first] += 1;
        died[*last] += 1;
    }
    let mut alive = 0;
    born.into_iter()
        .zip(died)
        .map(|(born, died)| {
            let now = alive + born;
            alive = now - died;
            now
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const INPUT: OrderInput<'static> = OrderInput {
        pairs: &[[0, 1], [1, 2], [3, 4], [0, 3]],
        moving: &[false, true, true, true, true],
    };

    fn measured(entries: &[Option<u32>], depth: u32, per_issue: u32) -> OrderReport {
        let schedule: Schedule = entries.iter().copied().collect();
        let window = IssueWindow::new(depth, per_issue).expect("a window");
        OrderReport::measure(&schedule, &INPUT, window)
    }

    #[test]
    fn hazards_are_counted_by_collision_and_lost_updates_by_body() {
        // Uses: slot 0: 1; 1: 1 2; 2: empty; 3: 3 4; 4: 3.
        let entries = [Some(0), Some(1), None, Some(2), Some(3)];
        let report = measured(&entries, 2, 1);
        assert_eq!((report.hazards, report.lost_updates), (2, 2));
        assert_eq!((report.collisions, report.empty, report.slots), (4, 1, 5));
        assert_eq!((report.most_alive, report.longest_span), (2, 1));
        // Spans 1, 0, 1, 0.
        assert!((report.mean_span - 0.5).abs() < 1e-12);
        assert_eq!(measured(&entries, 1, 1).hazards, 0);
        // The second use of body 1 lies three slots behind the first.
        let apart = [Some(0), Some(2), None, Some(1), Some(3)];
        assert_eq!(measured(&apart, 3, 1).hazards, 0);
        assert_eq!(measured(&apart, 4, 1).hazards, 2);
    }

    #[test]
    fn collisions_of_one_issue_meet_too() {
        let report = measured(&[Some(0), Some(1), Some(2), Some(3)], 1, 2);
        assert_eq!((report.hazards, report.slots), (2, 2));
        let report = measured(&[Some(0), Some(2), Some(1), Some(3)], 1, 2);
        assert_eq!((report.hazards, report.slots, report.most_alive), (0, 2, 3));
    }

    #[test]
    fn both_bodies_stale_are_one_hazard_and_two_lost_updates() {
        let input = OrderInput { pairs: &[[1, 2], [2, 1]], ..INPUT };
        let schedule: Schedule = [Some(0), Some(1)].into_iter().collect();
        let window = IssueWindow::new(2, 1).expect("a window");
        let report = OrderReport::measure(&schedule, &input, window);
        assert_eq!((report.hazards, report.lost_updates), (1, 2));
    }

    #[test]
    fn the_curve_counts_a_body_from_its_first_use_to_its_last() {
        let schedule: Schedule = [Some(0), Some(2), Some(1), None, Some(3)].into_iter().collect();
        let window = IssueWindow::new(1, 1).expect("a window");
        let curve = live_curve(&schedule, &INPUT, window);
        // 1: slots 0 to 2, 2: slot 2, 3: slots 1 to 4, 4: slot 1.
        assert_eq!(curve, [1, 3, 3, 1, 1]);
    }
}
