//! The distance that the uses of a body must have, counted in issue slots.

use pgs_interface::profile::{Depth, Profile, Variant};

use super::OrderError;
use crate::control_block::Capabilities;

/// Hazard window of a pipeline in issue slots, and number of collisions in each of them.
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

    /// The window of a step on a bitstream: the deeper of its two pipelines, since one order serves
    /// both.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(capabilities: &Capabilities) -> Result<Self, OrderError> {
        let Capabilities { variant, contact, friction, .. } = capabilities;
        // The values that the bitstream reports replace the values of its profile.
        let reported = Profile {
            initiation_interval: capabilities.initiation_interval,
            collisions_per_issue: capabilities.collisions_per_issue,
            ..*variant.profile
        };
        Self::of_depths(&reported, [*contact, *friction])
    }

    /// The window of a step on a design with the values of its profile; errors as
    /// [`new`](Self::new).
    pub(crate) fn of_variant(variant: &Variant) -> Result<Self, OrderError> {
        let depths = [variant.contact(), variant.friction()];
        Self::of_depths(variant.profile, depths)
    }

    fn of_depths(profile: &Profile, depths: [Depth; 2]) -> Result<Self, OrderError> {
        let [contact, friction] = depths.map(|depth| depth.window);
        let cycles = contact.max(friction);
        let slots = cycles.div_ceil(profile.initiation_interval.max(1));
        Self::new(slots.max(1), profile.collisions_per_issue)
    }

    /// Issue slots from a use of a body to the first slot that reads its write-back.
    #[must_use]
    pub const fn depth(self) -> u32 {
        self.depth
    }

    /// Collisions that enter together.
    #[must_use]
    pub const fn per_issue(self) -> u32 {
        self.per_issue
    }

    /// Entries of a schedule from a use of a body to the first entry of the slot that reads its
    /// write-back.
    pub(super) const fn entries(self) -> usize {
        // At most 2^18.
        self.depth as usize * self.per_issue as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile;

    #[test]
    fn a_window_without_slots_is_refused() {
        assert_eq!(IssueWindow::new(0, 1), Err(OrderError::Depth { found: 0, most: 16_384 }));
        assert_eq!(IssueWindow::new(1, 0), Err(OrderError::PerIssue { found: 0, most: 16 }));
        assert!(IssueWindow::new(16_385, 1).is_err() && IssueWindow::new(1, 17).is_err());
        let window = IssueWindow::new(158, 2).expect("a window");
        assert_eq!((window.depth(), window.per_issue(), window.entries()), (158, 2, 316));
    }

    /// 316, 324 and 255 cycles, by the interval of each: 28, 2, 3.
    #[test]
    fn the_window_of_a_profile_is_that_of_its_deeper_pipeline() {
        let windows = profile::PROFILES.iter().map(|profile| {
            let window = IssueWindow::of_variant(&profile.default_variant()).expect("a window");
            (window.depth(), window.per_issue())
        });
        assert_eq!(windows.collect::<Vec<_>>(), [(12, 1), (162, 1), (85, 2)]);
    }
}
