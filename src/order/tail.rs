//! Brings forward collisions that would be left over at the end of a list.
//!
//! A body with `r` collisions to come needs `r` depths of issue slots, even if few other collisions
//! are left. A collision therefore stands at least that number of depths before the end, counted
//! for the busier of its bodies. Only the last few thousand collisions move: all others stand early
//! enough.

use super::groups::Listed;

/// Collisions are brought forward within this number of depths from the end.
const DEPTHS: usize = 16;
/// Depths beyond a body's own need: its neighbours need theirs in between.
const SLACK: usize = 4;

/// Memory for the tail of a list.
#[derive(Debug, Default)]
pub(super) struct Tail {
    /// Collisions that each body has from here to the end.
    left: Vec<u32>,
    /// The latest entry, and the place in the list.
    latest: Vec<(isize, usize)>,
    moved: Vec<Listed>,
}

impl Tail {
    /// Brings forward collisions of the last entries. A window has `depth` entries; the number
    /// `fixed` stands for every static body.
    pub(super) fn bring_forward(&mut self, list: &mut [Listed], depth: usize, fixed: u32) {
        let start = list.len().saturating_sub(DEPTHS * depth);
        let end = list.len();
        let tail = &mut list[start..];
        self.left.clear();
        self.left.resize(fixed as usize + 1, 0);
        self.latest.clear();
        for (place, listed) in tail.iter().enumerate().rev() {
            let mut most = 0;
            for body in listed.bodies {
                if body != fixed {
                    let left = &mut self.left[body as usize];
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
        self.moved.clear();
        self.moved.extend(self.latest.iter().map(|(_, place)| tail[*place]));
        tail.copy_from_slice(&self.moved);
    }
}
