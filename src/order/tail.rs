//! Brings forward collisions that would be left over at the end of a sweep.
//!
//! A body with `r` collisions to come needs `r` depths of issue slots, even if few other collisions
//! are left. A collision therefore stands at least that number of depths before the end, counted
//! for the busier of its bodies. Only the last few thousand collisions move: all others stand early
//! enough.

use super::sweep::Swept;

/// Collisions are brought forward within this number of depths from the end.
const DEPTHS: usize = 16;
/// Depths beyond a body's own need: its neighbours need theirs in between.
const SLACK: usize = 4;

/// Memory for the tail of a sweep.
#[derive(Debug, Default)]
pub(super) struct Tail {
    /// Collisions that each body has from here to the end.
    left: Vec<u32>,
    /// The latest entry, and the place in the sweep.
    latest: Vec<(isize, usize)>,
    swept: Vec<Swept>,
}

impl Tail {
    /// Brings forward collisions of the last entries. A window has `depth` entries.
    pub(super) fn bring_forward(&mut self, sweep: &mut [Swept], depth: usize, static_rank: u32) {
        let start = sweep.len().saturating_sub(DEPTHS * depth);
        let end = sweep.len();
        let tail = &mut sweep[start..];
        self.left.clear();
        self.left.resize(static_rank as usize + 1, 0);
        self.latest.clear();
        for (place, swept) in tail.iter().enumerate().rev() {
            let mut most = 0;
            for rank in swept.ranks {
                if rank != static_rank {
                    let left = &mut self.left[rank as usize];
                    *left += 1;
                    most = most.max(*left);
                }
            }
            // Negative where a body can hardly be done in time: the busiest bodies come first.
            let needed = (most as usize + SLACK) * depth;
            let latest =
                (start + place).cast_signed().min(end.cast_signed() - needed.cast_signed());
            self.latest.push((latest, place));
        }
        // All keys differ.
        self.latest.sort_unstable();
        self.swept.clear();
        self.swept.extend(self.latest.iter().map(|(_, place)| tail[*place]));
        tail.copy_from_slice(&self.swept);
    }
}
