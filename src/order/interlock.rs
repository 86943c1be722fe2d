//! Predicts the cycles of a pipeline that waits on hazards for an order of the collisions.
//!
//! A collision issues when the one before it has issued and the velocities of its moving bodies are
//! written back, a window after their last use. One walk over the order gives both kinds of pass,
//! which differ in their window alone. Memory is left out: an order changes the stalls, and not the
//! streams.
//!
//! Source: interface specification, hazards.

use super::OrderInput;
use crate::control_block::Capabilities;
use crate::scene::StepParameters;

/// A pipeline that waits on hazards, as the passes of one step use it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Interlock {
    /// Cycles from one issue to the next.
    interval: u64,
    /// Collisions that enter in one issue.
    per_issue: usize,
    /// Hazard windows of a contact and of a friction pass, cycles.
    windows: [u64; 2],
    /// Passes of each kind.
    passes: [u64; 2],
}

impl Interlock {
    /// The pipeline of a bitstream, in a step with these parameters.
    pub(crate) fn of(capabilities: &Capabilities, parameters: &StepParameters) -> Self {
        let Capabilities { contact, friction, .. } = capabilities;
        Self {
            interval: capabilities.initiation_interval.into(),
            per_issue: usize::try_from(capabilities.collisions_per_issue.max(1)).unwrap_or(1),
            windows: [contact.window.into(), friction.window.into()],
            passes: [parameters.passes().contact.into(), parameters.passes().friction.into()],
        }
    }

    /// Cycles of all passes over `entries` entries without a hazard.
    pub(crate) fn cycles_without_hazards(&self, entries: usize) -> u64 {
        let passes: u64 = self.passes.iter().sum();
        let issues = entries.div_ceil(self.per_issue) as u64;
        issues.saturating_mul(self.interval).saturating_mul(passes)
    }

    /// The least number of cycles that the passes spend on a body with `uses` collisions: each one
    /// waits for the one before.
    pub(crate) fn cycles_of_one_body(&self, uses: usize) -> u64 {
        let between = uses.saturating_sub(1) as u64;
        let window = self.of_all_passes(self.windows);
        between.saturating_mul(window)
    }

    /// Cycles of all passes, from the cycles of one pass of each kind.
    fn of_all_passes(&self, cycles: [u64; 2]) -> u64 {
        let [contact, friction] = [0, 1].map(|kind| cycles[kind].saturating_mul(self.passes[kind]));
        contact.saturating_add(friction)
    }
}

/// Counts cycles. Its memory is kept from order to order.
#[derive(Debug, Default)]
pub(super) struct StallCounter {
    /// By body, and by kind of pass: the cycle from which its velocity can be read.
    ready: Vec<[u64; 2]>,
}

impl StallCounter {
    /// Cycles of all passes over the collisions `entries` of the input, in this order, stalls
    /// included.
    ///
    /// Counting ends early above `limit`; the result is then a lower bound that is above `limit`.
    pub(super) fn cycles(
        &mut self,
        input: &OrderInput<'_>,
        entries: impl IntoIterator<Item = u32>,
        pipeline: &Interlock,
        limit: u64,
    ) -> u64 {
        self.ready.clear();
        self.ready.resize(input.moving.len(), [0; 2]);
        // The pass of each kind begins at cycle 0.
        let mut now = [0_u64; 2];
        let mut entered = 0;
        for index in entries {
            if entered == pipeline.per_issue {
                now = now.map(|cycle| cycle + pipeline.interval);
                entered = 0;
                if pipeline.of_all_passes(now) > limit {
                    return pipeline.of_all_passes(now);
                }
            }
            entered += 1;
            let [a, b] = input.pairs[index as usize].map(|body| body as usize);
            let ready = [self.ready[a], self.ready[b]];
            now = [0, 1].map(|kind| now[kind].max(ready[0][kind]).max(ready[1][kind]));
            let written = [0, 1].map(|kind| now[kind] + pipeline.windows[kind]);
            for body in [a, b] {
                if input.moving[body] {
                    self.ready[body] = written;
                }
            }
        }
        if entered > 0 {
            now = now.map(|cycle| cycle + pipeline.interval);
        }
        pipeline.of_all_passes(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Interval 2; windows 10 and 6 cycles; one contact pass and two friction passes.
    const PIPELINE: Interlock =
        Interlock { interval: 2, per_issue: 1, windows: [10, 6], passes: [1, 2] };

    const INPUT: OrderInput<'static> = OrderInput {
        pairs: &[[0, 1], [1, 2], [0, 3], [3, 4]],
        moving: &[false, true, true, true, true],
    };

    fn cycles(entries: &[u32], pipeline: Interlock, limit: u64) -> u64 {
        StallCounter::default().cycles(&INPUT, entries.iter().copied(), &pipeline, limit)
    }

    #[test]
    fn a_collision_waits_for_the_last_use_of_its_moving_bodies() {
        // As given: issues at 0, 10, 12, 22 and at 0, 6, 8, 14.
        assert_eq!(cycles(&[0, 1, 2, 3], PIPELINE, u64::MAX), 24 + 2 * 16);
        // Issues at 0, 2, 10, 12 and at 0, 2, 6, 8.
        assert_eq!(cycles(&[0, 2, 1, 3], PIPELINE, u64::MAX), 14 + 2 * 10);
        assert_eq!(cycles(&[], PIPELINE, u64::MAX), 0);
    }

    #[test]
    fn collisions_of_one_issue_enter_in_the_same_cycle_unless_they_share_a_body() {
        let two = Interlock { per_issue: 2, ..PIPELINE };
        // 0 and 2 at 0; 1 and 3 at 10, at 6.
        assert_eq!(cycles(&[0, 2, 1, 3], two, u64::MAX), 12 + 2 * 8);
        // 0 at 0, 1 at 10; 2 at 12, 3 at 22. In friction 0, 6; 8, 14.
        assert_eq!(cycles(&[0, 1, 2, 3], two, u64::MAX), 24 + 2 * 16);
    }

    #[test]
    fn counting_ends_above_the_limit() {
        let found = cycles(&[0, 1, 2, 3], PIPELINE, 20);
        assert!((21..56).contains(&found), "{found}");
        assert_eq!(cycles(&[0, 1, 2, 3], PIPELINE, 56), 56);
    }

    #[test]
    fn bounds_follow_from_entries_and_from_the_busiest_body() {
        assert_eq!(PIPELINE.cycles_without_hazards(5), 5 * 2 * 3);
        let two = Interlock { per_issue: 2, ..PIPELINE };
        assert_eq!(two.cycles_without_hazards(5), 3 * 2 * 3);
        assert_eq!(PIPELINE.cycles_of_one_body(4), 3 * (10 + 2 * 6));
        assert_eq!(PIPELINE.cycles_of_one_body(0), 0);
    }
}
