//! Assigns each collision to a block: the first with an empty slot behind all earlier collisions of
//! its moving bodies.
//!
//! So the collisions of a body lie in different blocks in the order in which they came, and taking
//! block after block gives the bits of taking collision after collision. In hazard-free order the
//! blocks are full and the order is the one received.

use super::block::{LANES, Words, kind};
use super::records::Head;
use crate::cast::register;
use pgs_interface::control::ErrorCode;
use pgs_interface::record::CONTACT_POINTS;
use pgs_support::lanes::prefetch;

/// No block, no collision.
const NONE: u32 = u32::MAX;
/// The number of first collisions with static bodies that form a run.
const RUN: u8 = 4;
/// Empty lanes allowed in addition to one for every two collisions: it keeps serial blocks rare in
/// small scenes, and the memory of any scene below three times that of full blocks.
const EMPTY_MAX: usize = 64 * LANES;

/// A body and where it is used; a static one is used nowhere.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
struct Body {
    /// The first block that uses it.
    first: u32,
    /// The block behind the last that uses it, 0 if none does.
    behind: u32,
    /// The issue of the last collision.
    issue: u32,
    moves: bool,
}

/// Where a collision goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) block: usize,
    pub(crate) lane: usize,
    /// The block holds an earlier collision of one of its bodies.
    pub(crate) serial: bool,
}

/// The blocks so far.
#[derive(Debug, Default)]
pub(crate) struct Places {
    bodies: Vec<Body>,
    /// Lanes taken of each block.
    taken: Vec<u8>,
    /// Lanes of each block taken by the first collision of a body with a static one.
    firsts: Vec<u8>,
    /// Where to look for an empty lane: the block itself while it has one, else a later block.
    next: Vec<u32>,
    /// The first later block that uses a body of each block again, from the second entry on.
    again: Vec<u32>,
    /// The first block with an empty lane, or the number of blocks.
    open: usize,
    collisions: usize,
    /// Binary logarithm of the collisions that enter together.
    together: u32,
    distance: u32,
}

impl Places {
    /// No blocks, for collisions of which `together`, a power of two, enter as one issue.
    pub(crate) fn of_issues(together: usize) -> Self {
        Self { together: together.ilog2(), ..Self::default() }
    }

    /// Begins a step.
    pub(crate) fn begin(&mut self, collisions: usize) {
        self.bodies.clear();
        self.taken.clear();
        self.firsts.clear();
        self.next.clear();
        self.again.clear();
        let blocks = collisions.div_ceil(LANES);
        self.taken.reserve(blocks);
        self.firsts.reserve(blocks);
        self.next.reserve(blocks);
        self.again.reserve(blocks + 1);
        self.again.push(NONE);
        self.open = 0;
        self.collisions = 0;
        self.distance = u32::MAX;
    }

    /// Makes room for `bodies` bodies; `moves` tells whether a body moves.
    pub(crate) fn bodies(&mut self, bodies: usize, moves: impl Fn(usize) -> bool) {
        let body = |body| Body { first: NONE, behind: 0, issue: 0, moves: moves(body) };
        self.bodies.extend((self.bodies.len()..bodies).map(body));
    }

    /// Blocks that hold a collision.
    pub(crate) fn blocks(&self) -> usize {
        self.taken.len()
    }

    /// For each block the first later one that uses one of its bodies again.
    pub(crate) fn again(&self) -> &[u32] {
        self.again.get(1..).unwrap_or(&[])
    }

    /// The smallest distance, in issues, of two collisions with a moving body in common; `u32::MAX`
    /// without.
    pub(crate) fn distance(&self) -> u32 {
        self.distance
    }

    /// Where each body that moves and collides is used.
    pub(crate) fn uses(&self) -> impl Iterator<Item = [u32; 2]> {
        let used = self.bodies.iter().filter(|body| body.behind > 0);
        used.map(|body| [body.first, body.behind - 1])
    }

    /// Prefetches two bodies. An index past the end is ignored.
    #[inline(always)]
    pub(crate) fn fetch(&self, bodies: [u32; 2]) {
        for body in bodies {
            prefetch(self.bodies.as_ptr().wrapping_add(body as usize));
        }
    }

    /// Which bodies of a collision with a contact move, or what is wrong with it.
    #[inline(always)]
    pub(crate) fn moving(&self, count: u32, bodies: [u32; 2]) -> Result<[bool; 2], ErrorCode> {
        if count as usize > CONTACT_POINTS {
            return Err(ErrorCode::ContactCount);
        }
        let [a, b] = bodies.map(|body| self.bodies.get(body as usize));
        let (Some(a), Some(b)) = (a, b) else {
            return Err(ErrorCode::BodyIndex);
        };
        if bodies[0] == bodies[1] {
            return Err(ErrorCode::SelfCollision);
        }
        if !a.moves && !b.moves {
            return Err(ErrorCode::StaticPair);
        }
        Ok([a.moves, b.moves])
    }

    /// Places the next collisions, from `number` on, in one block until one shares a body with an
    /// earlier one or is invalid. Their kinds are added to
    /// `kinds`. Returns the block and the number of collisions placed, or `None` if another block has an
    /// empty lane.
    #[inline]
    pub(crate) fn place_together(
        &mut self,
        number: u32,
        heads: impl Iterator<Item = Head>,
        kinds: &mut Words<u32>,
    ) -> Option<(usize, usize)> {
        if self.open < self.taken.len() {
            return None;
        }
        let block = register(self.open);
        let (bodies, again) = (&mut self.bodies[..], &mut self.again[..]);
        let after_firsts = self.firsts.last().is_some_and(|firsts| usize::from(*firsts) == LANES);
        let run = if after_firsts { 1 } else { RUN };
        let (mut lanes, mut firsts, mut distance) = (0_u8, 0_u8, self.distance);
        let together = self.together;
        for ((number, head), kind) in (number..).zip(heads).zip(kinds) {
            let Head { count, friction, bodies: [a, b] } = head;
            let (Some(&body_a), Some(&body_b)) = (bodies.get(a as usize), bodies.get(b as usize))
            else {
                break;
            };
            let wrong = count.wrapping_sub(1) as usize >= CONTACT_POINTS || a == b;
            let static_pair = !(body_a.moves || body_b.moves);
            let shared = body_a.behind.max(body_b.behind) > block;
            let first = body_a.behind | body_b.behind == 0 && body_a.moves != body_b.moves;
            let elsewhere = !first && firsts == lanes && firsts >= run;
            if wrong || static_pair || shared || elsewhere {
                break;
            }
            let issue = number >> together;
            for (at, body) in [(a, body_a), (b, body_b)] {
                let since = if body.behind > 0 { issue - body.issue } else { u32::MAX };
                distance = distance.min(since);
                if body.moves {
                    let again = &mut again[body.behind as usize];
                    *again = (*again).min(block);
                    let first = body.first.min(block);
                    bodies[at as usize] = Body { first, behind: block + 1, issue, moves: true };
                }
            }
            *kind = kind::of(count | friction, [body_a.moves, body_b.moves], false);
            firsts += u8::from(first);
            lanes += 1;
        }
        if lanes > 0 {
            let full = usize::from(lanes) == LANES;
            self.taken.push(lanes);
            self.firsts.push(firsts);
            self.next.push(block + u32::from(full));
            self.again.push(NONE);
            self.open += usize::from(full);
            self.collisions += usize::from(lanes);
            self.distance = distance;
        }
        Some((block as usize, usize::from(lanes)))
    }

    /// Places collision `number` between two bodies. Numbers must rise from call to call.
    #[inline]
    pub(crate) fn place(&mut self, number: u32, bodies: [u32; 2], moving: [bool; 2]) -> Place {
        let mut from = 0;
        let issue = number >> self.together;
        for body in bodies {
            let body = &self.bodies[body as usize];
            if body.behind > 0 {
                from = from.max(body.behind);
                self.distance = self.distance.min(issue - body.issue);
            }
        }
        let first = from == 0 && moving != [true; 2];
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
        for body in bodies {
            let body = &mut self.bodies[body as usize];
            if body.moves {
                let behind = register(block) + 1;
                if body.behind != behind {
                    let again = &mut self.again[body.behind as usize];
                    *again = (*again).min(register(block));
                }
                body.first = body.first.min(register(block));
                body.behind = behind;
                body.issue = issue;
            }
        }
        Place { block, lane, serial }
    }

    /// Whether a block holds a run of first collisions with static bodies only, which can be put off.
    #[inline]
    fn of_firsts(&self, block: usize) -> bool {
        let full = |firsts: u8| usize::from(firsts) == LANES;
        let Some((firsts, taken)) = self.firsts.get(block).zip(self.taken.get(block)) else {
            return false;
        };
        let run = *firsts >= RUN || block > 0 && full(self.firsts[block - 1]);
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
            // Shortens the path, so that full blocks are searched once.
            let beyond = self.next.get(next).copied().unwrap_or(register(next));
            self.next[at] = beyond;
            at = beyond as usize;
        }
        at
    }
}
