//! This file says how far apart the uses of a body must be, counted in issue slots.

use super::OrderError;
use crate::accelerator::Capabilities;

/// Hazard window of a pipeline in issue slots, and how many collisions enter in one of them.
///
/// Two uses of a moving body are free of hazards if their issue slots are at least
/// [`depth`](Self::depth) apart. Collisions of one issue slot are zero apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IssueWindow {
    depth: u32,
    per_issue: u32,
}

impl IssueWindow {
    /// Largest depth, issue slots.
    pub const DEPTH_MAX: u32 = 1 << 14;
    /// Most collisions an issue.
    pub const PER_ISSUE_MAX: u32 = 16;

    /// A window of `depth` issue slots with `per_issue` collisions each.
    ///
    /// # Errors
    /// [`OrderError::Depth`], [`OrderError::PerIssue`] if either is zero or above its limit.
    pub const fn new(depth: u32, per_issue: u32) -> Result<Self, OrderError> {
        if depth == 0 || depth > Self::DEPTH_MAX {
            return Err(OrderError::Depth { found: depth, most: Self::DEPTH_MAX });
        }
        if per_issue == 0 || per_issue > Self::PER_ISSUE_MAX {
            return Err(OrderError::PerIssue { found: per_issue, most: Self::PER_ISSUE_MAX });
        }
        Ok(Self { depth, per_issue })
    }

    /// The window of a bitstream: the deeper of its two pipelines, since one order serves both.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(capabilities: &Capabilities) -> Result<Self, OrderError> {
        let cycles = capabilities.contact.window.max(capabilities.friction.window);
        let depth = cycles.div_ceil(capabilities.initiation_interval.max(1)).max(1);
        Self::new(depth, capabilities.collisions_per_issue)
    }

    /// Issue slots from a use of a body to the first that sees what it wrote.
    #[must_use]
    pub const fn depth(self) -> u32 {
        self.depth
    }

    /// Collisions that enter together.
    #[must_use]
    pub const fn per_issue(self) -> u32 {
        self.per_issue
    }

    /// Entries of a schedule between one use of a body and the first of the slot that sees it.
    pub(super) const fn entries(self) -> usize {
        // At most 2^18.
        self.depth as usize * self.per_issue as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_without_slots_is_refused() {
        assert_eq!(IssueWindow::new(0, 1), Err(OrderError::Depth { found: 0, most: 16_384 }));
        assert_eq!(IssueWindow::new(1, 0), Err(OrderError::PerIssue { found: 0, most: 16 }));
        assert!(IssueWindow::new(16_385, 1).is_err() && IssueWindow::new(1, 17).is_err());
        let window = IssueWindow::new(158, 2).expect("a window");
        assert_eq!((window.depth(), window.per_issue(), window.entries()), (158, 2, 316));
    }
}
