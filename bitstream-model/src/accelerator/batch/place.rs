//! This file finds each collision its block: the first with an empty lane behind all earlier
//! collisions of its moving bodies.
//!
//! So the collisions of a body lie in different blocks in the order in which they came, and taking
//! block after block gives the bits of taking collision after collision. In hazard-free order the
//! blocks are full and the order is the one received.

use super::block::LANES;
use crate::cast::register;

/// No block, no collision.
const NONE: u32 = u32::MAX;
/// Empty lanes that may be left behind beside one for every two collisions: few serial blocks in
/// small scenes, at most three times the memory of full blocks in any.
const EMPTY_MAX: usize = 64 * LANES;

#[derive(Debug, Clone, Copy)]
struct Body {
    first: u32,
    last: u32,
    /// The last collision.
    collision: u32,
}

/// Where a collision goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) block: usize,
    pub(super) lane: usize,
    /// The block holds an earlier collision of one of its bodies.
    pub(super) serial: bool,
}

/// The blocks so far.
#[derive(Debug, Default)]
pub(super) struct Places {
    bodies: Vec<Body>,
    /// Lanes taken of each block.
    taken: Vec<u8>,
    /// And how many of them by the first collision of a body with a static one.
    firsts: Vec<u8>,
    /// Where to look for an empty lane: the block itself while it has one, else one behind it.
    next: Vec<u32>,
    /// The first later block that uses a body of each block again.
    again: Vec<u32>,
    /// The first block with an empty lane, or the number of blocks.
    open: usize,
    collisions: usize,
    distance: Option<u32>,
}

impl Places {
    /// Begins a step.
    pub(super) fn begin(&mut self, collisions: usize) {
        self.bodies.clear();
        self.taken.clear();
        self.firsts.clear();
        self.next.clear();
        self.again.clear();
        let blocks = collisions.div_ceil(LANES);
        self.taken.reserve(blocks);
        self.firsts.reserve(blocks);
        self.next.reserve(blocks);
        self.again.reserve(blocks);
        self.open = 0;
        self.collisions = 0;
        self.distance = None;
    }

    /// Makes room for so many bodies.
    pub(super) fn bodies(&mut self, bodies: usize) {
        if self.bodies.len() < bodies {
            self.bodies.resize(bodies, Body { first: NONE, last: NONE, collision: NONE });
        }
    }

    /// Blocks that hold a collision.
    pub(super) fn blocks(&self) -> usize {
        self.taken.len()
    }

    /// For each block the first later one that uses one of its bodies again.
    pub(super) fn again(&self) -> &[u32] {
        &self.again
    }

    /// The smallest distance of two collisions with a moving body in common.
    pub(super) fn distance(&self) -> Option<u32> {
        self.distance
    }

    /// Where each body that moves and collides is used.
    pub(super) fn uses(&self) -> impl Iterator<Item = [u32; 2]> {
        self.bodies.iter().filter(|body| body.first != NONE).map(|body| [body.first, body.last])
    }

    /// Places collision `number`, larger than those before, between two bodies below the number
    /// given to [`bodies`](Self::bodies).
    #[inline]
    pub(super) fn place(&mut self, number: u32, bodies: [u32; 2], moving: [bool; 2]) -> Place {
        let mut from = 0;
        let mut used = false;
        for side in 0..2 {
            let body = &self.bodies[bodies[side] as usize];
            if moving[side] && body.first != NONE {
                from = from.max(body.last + 1);
                used = true;
                let distance = number - body.collision;
                self.distance = Some(self.distance.map_or(distance, |least| least.min(distance)));
            }
        }
        let first = !used && moving != [true; 2];
        let mut block = self.open;
        if from as usize > block {
            block = self.with_empty_lane(from as usize);
        }
        while !first && self.of_firsts(block) {
            block = self.with_empty_lane(block + 1);
        }
        let mut serial = false;
        if block == self.taken.len() {
            let last = block.wrapping_sub(1);
            let empty = block * LANES - self.collisions;
            let wasteful = empty > EMPTY_MAX + self.collisions / 2;
            if wasteful && usize::from(self.taken[last]) < LANES {
                block = last;
                serial = true;
            } else {
                self.taken.push(0);
                self.firsts.push(0);
                self.next.push(register(block));
                self.again.push(NONE);
            }
        }
        let lane = usize::from(self.taken[block]);
        self.taken[block] += 1;
        self.firsts[block] += u8::from(first);
        if lane + 1 == LANES {
            self.next[block] = register(block) + 1;
            if block == self.open {
                self.open = self.with_empty_lane(block + 1);
            }
        }
        self.collisions += 1;
        for side in 0..2 {
            if moving[side] {
                let body = &mut self.bodies[bodies[side] as usize];
                if body.first == NONE {
                    body.first = register(block);
                } else if body.last != register(block) {
                    let again = &mut self.again[body.last as usize];
                    *again = (*again).min(register(block));
                }
                body.last = register(block);
                body.collision = number;
            }
        }
        Place { block, lane, serial }
    }

    /// Whether a block is for first collisions with static bodies alone: such a run of them can be
    /// put off.
    #[inline]
    fn of_firsts(&self, block: usize) -> bool {
        let full = |firsts: u8| usize::from(firsts) == LANES;
        let Some((firsts, taken)) = self.firsts.get(block).zip(self.taken.get(block)) else {
            return false;
        };
        let run = *firsts >= 4 || block > 0 && full(self.firsts[block - 1]);
        run && *firsts > 0 && firsts == taken
    }

    /// The first block from `at` on that has an empty lane, or the number of blocks.
    #[inline]
    fn with_empty_lane(&mut self, mut at: usize) -> usize {
        while at < self.next.len() {
            let next = self.next[at] as usize;
            if next == at {
                break;
            }
            // What lies behind is looked through once.
            let beyond = self.next.get(next).copied().unwrap_or(register(next));
            self.next[at] = beyond;
            at = beyond as usize;
        }
        at
    }
}
