//! The cost of a schedule: hazards, lost updates, empty entries, bodies alive, spans.

use zynq_pgs::order::{IssueWindow, OrderInput, Schedule};

/// The cost of a schedule on hardware with a given window.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cost {
    /// Entries with a collision.
    pub(super) collisions: usize,
    /// Entries without a collision.
    pub(super) empty: usize,
    /// Collisions that share a moving body with one of the `depth - 1` issue slots before, or with
    /// one before in its own slot: without an interlock they read a stale velocity.
    pub(super) hazards: usize,
    /// Write-backs that a later write-back of the same body overwrites without having read them:
    /// without an interlock these impulses are lost.
    pub(super) lost_updates: usize,
    /// Moving bodies alive in each issue slot (thesis, figure 4.13). A body is alive from its first
    /// use to its last.
    pub(super) alive: Vec<u32>,
    /// Longest span of a moving body, from its first use to its last, issue slots.
    pub(super) longest_span: usize,
    /// Mean span of the moving bodies that are used, issue slots.
    pub(super) mean_span: f64,
}

impl Cost {
    /// Measures a schedule of the collisions of an input that the driver has checked.
    pub(super) fn measure(
        schedule: &Schedule,
        input: &OrderInput<'_>,
        window: IssueWindow,
    ) -> Self {
        let (depth, per_issue) = (window.depth() as usize, window.per_issue() as usize);
        // First and last slot of each moving body that is used.
        let mut lives: Vec<Option<(usize, usize)>> = vec![None; input.moving.len()];
        let (mut hazards, mut lost_updates) = (0, 0);
        for (entry, found) in schedule.iter().enumerate() {
            let Some(found) = found else { continue };
            let slot = entry / per_issue;
            let pair = input.pairs[found as usize].into_iter();
            let mut stale = 0;
            for body in pair.filter(|body| super::is_moving(input, *body)) {
                let life = &mut lives[body as usize];
                stale += usize::from(life.is_some_and(|(_, last)| slot - last < depth));
                life.get_or_insert((slot, slot)).1 = slot;
            }
            hazards += usize::from(stale > 0);
            lost_updates += stale;
        }
        let slots = schedule.len().div_ceil(per_issue);
        let (mut born, mut died) = (vec![0_u32; slots], vec![0_u32; slots]);
        let (mut used, mut total, mut longest_span) = (0, 0, 0);
        for (first, last) in lives.into_iter().flatten() {
            born[first] += 1;
            died[last] += 1;
            (used, total) = (used + 1, total + last - first);
            longest_span = longest_span.max(last - first);
        }
        let mut alive = 0;
        let now = |(born, died)| {
            let now = alive + born;
            alive = now - died;
            now
        };
        Self {
            collisions: schedule.collisions(),
            empty: schedule.empty(),
            hazards,
            lost_updates,
            alive: born.into_iter().zip(died).map(now).collect(),
            longest_span,
            mean_span: share(total, used),
        }
    }

    /// Most moving bodies alive in one issue slot.
    pub(super) fn most_alive(&self) -> u32 {
        self.alive.iter().copied().max().unwrap_or(0)
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

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INPUT: OrderInput<'static> = OrderInput {
        pairs: &[[0, 1], [1, 2], [3, 4], [0, 3]],
        moving: &[false, true, true, true, true],
    };

    fn measured(entries: &[Option<u32>], depth: u32, per_issue: u32) -> Cost {
        let schedule: Schedule = entries.iter().copied().collect();
        let window = IssueWindow::new(depth, per_issue).expect("a window");
        Cost::measure(&schedule, &INPUT, window)
    }

    #[test]
    fn hazards_are_counted_by_collision_and_lost_updates_by_body() {
        // Uses: slot 0: 1; 1: 1 2; 2: empty; 3: 3 4; 4: 3.
        let entries = [Some(0), Some(1), None, Some(2), Some(3)];
        let report = measured(&entries, 2, 1);
        assert_eq!((report.hazards, report.lost_updates), (2, 2));
        assert_eq!((report.collisions, report.empty, report.alive.len()), (4, 1, 5));
        assert_eq!((report.most_alive(), report.longest_span), (2, 1));
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
        assert_eq!((report.hazards, report.alive.len()), (2, 2));
        let report = measured(&[Some(0), Some(2), Some(1), Some(3)], 1, 2);
        assert_eq!((report.hazards, report.alive.len(), report.most_alive()), (0, 2, 3));
    }

    #[test]
    fn both_bodies_stale_are_one_hazard_and_two_lost_updates() {
        let input = OrderInput { pairs: &[[1, 2], [2, 1]], ..INPUT };
        let schedule: Schedule = [Some(0), Some(1)].into_iter().collect();
        let window = IssueWindow::new(2, 1).expect("a window");
        let report = Cost::measure(&schedule, &input, window);
        assert_eq!((report.hazards, report.lost_updates), (1, 2));
    }

    #[test]
    fn the_curve_counts_a_body_from_its_first_use_to_its_last() {
        let schedule: Schedule = [Some(0), Some(2), Some(1), None, Some(3)].into_iter().collect();
        let window = IssueWindow::new(1, 1).expect("a window");
        // 1: slots 0 to 2, 2: slot 2, 3: slots 1 to 4, 4: slot 1.
        assert_eq!(Cost::measure(&schedule, &INPUT, window).alive, [1, 3, 3, 1, 1]);
    }
}
