//! Assigns each collision to a block, in the order of issue: the first block with an empty lane
//! behind all earlier collisions of its moving bodies.
//!
//! So the collisions of a body lie in different blocks in the order in which they issue, and taking
//! block after block gives the bits of taking collision after collision. In hazard-free order the
//! blocks are full and the order is the one received.

use pgs_support::lanes::LANES;

use super::block::{NONE, Words};
use crate::accelerator::hazards::Entry;
use crate::cast::register;

/// Empty lanes allowed in addition to one for every two collisions; where a scene needs more, one
/// collision after the other is faster.
const EMPTY_MAX: usize = 64 * LANES;

/// Where a moving body is used.
#[derive(Debug, Clone, Copy)]
struct Used {
    /// The first block that uses it.
    first: u32,
    /// The block behind the last that uses it, 0 if none does.
    behind: u32,
}

/// The blocks of a step.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// The collisions of each block, by lanes.
    pub(super) members: Vec<Words<u32>>,
    /// Block and lane of each collision as they issue; [`NONE`] of padding.
    pub(super) slots: Vec<u32>,
    used: Vec<Used>,
    taken: Vec<u8>,
    /// Where to look for an empty lane: the block itself while it has one, else a later block.
    next: Vec<u32>,
    collisions: usize,
}

impl Groups {
    /// Begins a step with this number of bodies.
    pub(super) fn begin(&mut self, bodies: usize) {
        let Self { members, slots, used, taken, next, collisions } = self;
        members.clear();
        slots.clear();
        taken.clear();
        next.clear();
        used.clear();
        used.resize(bodies, Used { first: NONE, behind: 0 });
        *collisions = 0;
    }

    /// Places the next collision that issues, or padding.
    #[inline]
    pub(super) fn place(&mut self, number: u32, entry: Option<Entry>) {
        let Some(Entry { bodies, moving }) = entry else { return self.slots.push(NONE) };
        let mut from = 0;
        for (body, moves) in bodies.into_iter().zip(moving) {
            if moves {
                from = from.max(self.used[body as usize].behind as usize);
            }
        }
        let block = self.with_empty_lane(from);
        if block == self.members.len() {
            self.members.push([NONE; LANES]);
            self.taken.push(0);
            self.next.push(register(block));
        }
        let lane = self.taken[block];
        self.members[block][usize::from(lane)] = number;
        self.slots.push(register(block * LANES) + u32::from(lane));
        self.taken[block] += 1;
        if usize::from(lane) + 1 == LANES {
            self.next[block] += 1;
        }
        self.collisions += 1;
        for (body, moves) in bodies.into_iter().zip(moving) {
            if moves {
                let used = &mut self.used[body as usize];
                used.first = used.first.min(register(block));
                used.behind = register(block) + 1;
            }
        }
    }

    /// Whether too many lanes are empty for lanes to save time.
    pub(super) fn wasteful(&self) -> bool {
        self.members.len() * LANES - self.collisions > EMPTY_MAX + self.collisions / 2
    }

    /// The first and the last block of each moving body that collides.
    pub(super) fn uses(&self) -> impl Iterator<Item = [u32; 2]> {
        let used = self.used.iter().filter(|used| used.behind > 0);
        used.map(|used| [used.first, used.behind - 1])
    }

    /// The first block from `at` on that has an empty lane, or the number of blocks.
    #[inline]
    fn with_empty_lane(&mut self, mut at: usize) -> usize {
        while at < self.next.len() {
            let next = self.next[at] as usize;
            if next == at {
                break;
            }
            // Shortens the path, so that full blocks are searched once.
            let beyond = self.next.get(next).copied().unwrap_or(register(next));
            self.next[at] = beyond;
            at = beyond as usize;
        }
        at
    }
}
