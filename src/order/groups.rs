//! Places collisions in issue slots so that no hazard can occur, near to where they were given.
//!
//! Slots are taken in groups of an eighth of the depth. A body is used at most once in any nine
//! groups in a row. A whole depth therefore lies between two uses, wherever in their groups they
//! stand, and nothing is compared within a group.
//!
//! ```text
//! group      base                                    base + 63
//! full       1 1 0 1 0 0 0 0 0 0 0 ...  0 0 0 1 1 1 1 1 1 1 1   the last eight: beyond reach
//! body A     0 0 0 0 1 1 1 1 1 1 1 ...  each use closes the groups around it
//! body B     1 1 1 0 0 0 0 0 0 0 0 ...
//!                    ^ the first group that is closed for neither and not full: taken
//! ```
//!
//! A set of groups is a 64-bit word, and finding the group a few instructions. The window of groups
//! moves on when its first is full. A collision that fits nowhere in it waits in a queue of bounded
//! length and is tried again at every move; if the queue is full, the window moves on although
//! slots stay empty.

use super::schedule::EMPTY;
use super::tail::Tail;
use super::{IssueWindow, OrderError, OrderInput, Schedule};

/// Number of groups that a depth is divided into.
const PARTS: usize = 8;
/// Groups in the window.
const GROUPS: usize = u64::BITS as usize;
/// Largest number of waiting collisions.
const WAITING_MAX: usize = 256;

/// A collision that waits for its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Listed {
    /// Its bodies, and for a static one the number of all bodies.
    pub(super) bodies: [u32; 2],
    /// Its index in the given order.
    index: u32,
}

/// Which groups are closed for a body: bit `i` is group `base + i`.
#[derive(Debug, Clone, Copy, Default)]
struct Closed {
    groups: u64,
    base: u64,
}

impl Closed {
    /// The same groups, counted from a later base.
    #[inline]
    fn from(self, base: u64) -> u64 {
        let moved = base - self.base;
        if moved < u64::from(u64::BITS) { self.groups >> moved } else { 0 }
    }
}

/// Memory of the placement. It is kept from order to order.
#[derive(Debug, Default)]
pub(super) struct Groups {
    list: Vec<Listed>,
    tail: Tail,
    /// The last one is for all static bodies, and never closed.
    bodies: Vec<Closed>,
    waiting: Vec<Listed>,
}

impl Groups {
    /// Places every collision with contact points of an input that was checked.
    ///
    /// # Errors
    /// [`OrderError::TooLong`] if the placement takes more than `limit` entries.
    pub(super) fn place(
        &mut self,
        input: &OrderInput<'_>,
        window: IssueWindow,
        limit: usize,
        schedule: &mut Schedule,
    ) -> Result<(), OrderError> {
        #[allow(clippy::cast_possible_truncation, reason = "an index of a body is a u32: checked")]
        let fixed = input.moving.len() as u32;
        let number = |body: u32| if input.moving[body as usize] { body } else { fixed };
        self.list.clear();
        let listed = |(index, pair): (u32, [u32; 2])| Listed { bodies: pair.map(number), index };
        self.list.extend(input.taking_part().map(listed));
        self.tail.bring_forward(&mut self.list, window.entries(), fixed);
        self.bodies.clear();
        self.bodies.resize(fixed as usize + 1, Closed::default());
        self.waiting.clear();
        schedule.clear();
        let too_long =
            OrderError::TooLong { depth: window.depth(), limit, collisions: self.list.len() };
        let mut open = Open::new(window, fixed, &mut self.bodies, &mut schedule.entries);
        for listed in &self.list {
            while open.first_is_full() {
                open.advance();
                open.retry(&mut self.waiting);
            }
            if !open.place(listed) {
                self.waiting.push(*listed);
                while self.waiting.len() > WAITING_MAX {
                    open.advance();
                    open.retry(&mut self.waiting);
                    if open.entries.len() > limit.saturating_add(open.window_entries()) {
                        return Err(too_long);
                    }
                }
            }
        }
        while !self.waiting.is_empty() {
            open.advance();
            open.retry(&mut self.waiting);
            if open.entries.len() > limit.saturating_add(open.window_entries()) {
                return Err(too_long);
            }
        }
        let entries = &mut schedule.entries;
        while entries.last() == Some(&EMPTY) {
            entries.pop();
        }
        schedule.empty = entries.len() - self.list.len();
        if entries.len() > limit { Err(too_long) } else { Ok(()) }
    }
}

/// The groups that are open.
struct Open<'a> {
    /// Entries of a group.
    size: usize,
    /// Groups on either side of a use that it closes.
    reach: usize,
    /// The groups that a use closes, with the first of them at bit `reach`.
    around: u64,
    /// The groups that are too near the end of the window to be used yet.
    beyond: u64,
    full: u64,
    base: u64,
    /// Where the first group begins.
    start: usize,
    /// Number of entries taken in each group, by its number modulo 64.
    taken: [u32; GROUPS],
    fixed: usize,
    bodies: &'a mut [Closed],
    entries: &'a mut Vec<u32>,
}

impl<'a> Open<'a> {
    fn new(
        window: IssueWindow,
        fixed: u32,
        bodies: &'a mut [Closed],
        entries: &'a mut Vec<u32>,
    ) -> Self {
        let depth = window.depth() as usize;
        let slots = depth.div_ceil(PARTS);
        // With `reach` groups in between, `reach * slots + 1 >= depth` slots lie between two uses.
        let reach = (depth - 1).div_ceil(slots);
        let size = slots * window.per_issue() as usize;
        let beyond = !(u64::MAX >> reach);
        entries.resize(GROUPS * size, EMPTY);
        Self {
            size,
            reach,
            around: (1 << (2 * reach + 1)) - 1,
            beyond,
            full: beyond,
            base: 0,
            start: 0,
            taken: [0; GROUPS],
            fixed: fixed as usize,
            bodies,
            entries,
        }
    }

    fn window_entries(&self) -> usize {
        GROUPS * self.size
    }

    fn first_is_full(&self) -> bool {
        self.full & 1 == 1
    }

    /// Moves the window on by one group.
    fn advance(&mut self) {
        self.full = ((self.full & !self.beyond) >> 1) | self.beyond;
        self.taken[ring(self.base)] = 0;
        self.base += 1;
        self.start += self.size;
        self.entries.resize(self.start + GROUPS * self.size, EMPTY);
    }

    /// Places a collision in the first group that can take it, if there is one.
    #[inline]
    fn place(&mut self, listed: &Listed) -> bool {
        let [a, b] = listed.bodies.map(|body| body as usize);
        let closed = [self.bodies[a].from(self.base), self.bodies[b].from(self.base)];
        let free = !(closed[0] | closed[1] | self.full);
        if free == 0 {
            return false;
        }
        let group = free.trailing_zeros();
        let around = (u128::from(self.around) << group) >> self.reach;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a group that is taken is at least `reach` groups before the end"
        )]
        let around = around as u64;
        self.bodies[a] = Closed { groups: closed[0] | around, base: self.base };
        self.bodies[b] = Closed { groups: closed[1] | around, base: self.base };
        self.bodies[self.fixed] = Closed::default();
        let taken = &mut self.taken[ring(self.base + u64::from(group))];
        self.entries[self.start + group as usize * self.size + *taken as usize] = listed.index;
        *taken += 1;
        if *taken as usize == self.size {
            self.full |= 1 << group;
        }
        true
    }

    /// Tries the waiting collisions again, in their order.
    fn retry(&mut self, waiting: &mut Vec<Listed>) {
        waiting.retain(|listed| !self.place(listed));
    }
}

/// The position of a group's count in `taken`.
#[allow(clippy::cast_possible_truncation, reason = "below 64")]
fn ring(group: u64) -> usize {
    (group % GROUPS as u64) as usize
}
