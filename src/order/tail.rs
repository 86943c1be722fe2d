//! This file brings forward what would be left over at the end of a sweep.
//!
//! A body with `r` collisions to come needs `r` depths of issue slots, however few other collisions
//! are left. So a collision stands no later than so many depths before the end as its busier body
//! still needs. This touches the last few thousand collisions only: all before stand early enough.

use super::sweep::Swept;

/// How many depths from the end on collisions are brought forward.
const DEPTHS: usize = 16;
/// Depths beyond those that a body needs for itself: its neighbours need theirs in between.
const SLACK: usize = 4;

/// Room for the tail of a sweep.
#[derive(Debug, Default)]
pub(super) struct Tail {
    /// Collisions that each body has from here to the end.
    left: Vec<u32>,
    /// The latest entry, and the place in the sweep.
    latest: Vec<(isize, usize)>,
    swept: Vec<Swept>,
}

impl Tail {
    /// Brings forward collisions of the last entries, `depth` of which make up a window; `moving`
    /// is the rank of what does not move.
    pub(super) fn bring_forward(&mut self, sweep: &mut [Swept], depth: usize, moving: u32) {
        let start = sweep.len().saturating_sub(DEPTHS * depth);
        let end = sweep.len();
        let tail = &mut sweep[start..];
        self.left.clear();
        self.left.resize(moving as usize + 1, 0);
        self.latest.clear();
        for (place, swept) in tail.iter().enumerate().rev() {
            let mut most = 0;
            for rank in swept.ranks {
                if rank != moving {
                    let left = &mut self.left[rank as usize];
                    *left += 1;
                    most = most.max(*left);
                }
            }
            // Negative where a body can hardly be done in time: the busiest come first.
            let needed = (most as usize + SLACK) * depth;
            let latest =
                (start + place).cast_signed().min(end.cast_signed() - needed.cast_signed());
            self.latest.push((latest, place));
        }
        // No two are equal.
        self.latest.sort_unstable();
        self.swept.clear();
        self.swept.extend(self.latest.iter().map(|(_, place)| tail[*place]));
        tail.copy_from_slice(&self.swept);
    }
}
