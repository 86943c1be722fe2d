//! The issue queue: which of the waiting collisions enters the pipeline next.
//!
//! It decides in slots and knows neither clocks nor beats (bitstream-model/README.md §8). The
//! reference asks it beat by beat, [`fast`](crate::fast) once a step for all passes. It keeps who
//! waits; the records stay where its owner has them, at the [`place`](Waiting::place) of each.

use std::collections::VecDeque;

use super::hazards::Entry;
use crate::cast::register;
use pgs_interface::control::QUEUE_PATIENCE;

/// A collision in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Waiting {
    /// Its number in the stream.
    pub(crate) number: u32,
    /// Its place among the records of the queue, below the depth. No other collision has it at the
    /// same time.
    pub(crate) place: u32,
    /// Its moving bodies; the number of all bodies stands for one that does not move.
    bodies: [u32; 2],
    /// The first slot in which it could issue.
    since: u64,
}

/// A collision that issues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Issued {
    pub(crate) collision: Waiting,
    /// Slots that idled before.
    pub(crate) idle: u64,
    /// Whether it met a hazard while it waited.
    pub(crate) hazard: bool,
}

/// The queue of a board.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    depth: usize,
    /// Slots from a collision to the next that has a body in common with it.
    window: u64,
    /// The next slot that decides, counted over all passes of a step.
    slot: u64,
    /// The first slot in which the oldest collision was the oldest.
    oldest_since: u64,
    /// In the order of the stream.
    waiting: VecDeque<Waiting>,
    /// The slot from which each body is free.
    free: Vec<u64>,
    /// Collisions that have entered in this pass.
    entered: u32,
    /// The place of the last collision that issued.
    left: u32,
}

impl Queue {
    pub(crate) fn new(depth: u32) -> Self {
        Self { depth: depth as usize, ..Self::default() }
    }

    /// A step begins. A collision occupies its bodies for `window` slots.
    pub(crate) fn start_step(&mut self, bodies: usize, window: u64) {
        (self.window, self.slot) = (window, 0);
        self.free.clear();
        // The last one is nobody's.
        self.free.resize(bodies + 1, 0);
    }

    /// A pass begins: the queue is empty, and everything is written back.
    pub(crate) fn start_pass(&mut self) {
        self.waiting.clear();
        self.slot += self.window;
        (self.oldest_since, self.entered, self.left) = (self.slot, 0, 0);
    }

    pub(crate) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(crate) fn is_full(&self) -> bool {
        self.waiting.len() == self.depth
    }

    /// Whether the next collision that enters takes a slot to do so.
    pub(crate) fn fills(&self) -> bool {
        (self.entered as usize) < self.depth
    }

    /// The next slot that decides.
    pub(crate) fn slot(&self) -> u64 {
        self.slot
    }

    /// The next collision of the stream enters a queue that is not full; padding has no entry.
    /// Returns its place.
    pub(crate) fn enter(&mut self, entry: Option<Entry>) -> u32 {
        debug_assert!(!self.is_full(), "a collision enters when another has left");
        let nobody = register(self.free.len() - 1);
        let bodies = entry.map_or([nobody; 2], |Entry { bodies: [a, b], moving }| {
            [if moving[0] { a } else { nobody }, if moving[1] { b } else { nobody }]
        });
        let place = if self.fills() { self.entered } else { self.left };
        let number = self.entered;
        self.entered += 1;
        self.waiting.push_back(Waiting { number, place, bodies, since: self.slot });
        place
    }

    /// The slot from which a collision is free of hazards.
    #[inline(always)]
    fn free_from(&self, collision: &Waiting) -> u64 {
        let [a, b] = collision.bodies.map(|body| self.free[body as usize]);
        a.max(b)
    }

    /// The next collision to issue leaves. The queue is full, or the stream has ended. `None`: it
    /// is empty.
    #[inline]
    pub(crate) fn issue(&mut self) -> Option<Issued> {
        let oldest = *self.waiting.front()?;
        let (mut at, mut slot) = (0, self.free_from(&oldest).max(self.slot));
        if slot > self.slot {
            (at, slot) = self.younger(&oldest, slot);
        }
        let collision = self.waiting.remove(at)?;
        // In a window of one slot no collision finds its body taken.
        let hazard = self.window > 1 && self.free_from(&collision) > collision.since;
        let idle = slot - self.slot;
        let last = self.free.len() - 1;
        for body in collision.bodies.map(|body| body as usize) {
            if body < last {
                self.free[body] = slot + self.window;
            }
        }
        (self.slot, self.left) = (slot + 1, collision.place);
        if at == 0 {
            self.oldest_since = self.slot;
        }
        Some(Issued { collision, idle, hazard })
    }

    /// The collision that issues first and its slot, where the oldest one has to wait until `slot`.
    fn younger(&self, oldest: &Waiting, slot: u64) -> (usize, u64) {
        let mut first = (0, slot);
        let nobody = register(self.free.len() - 1);
        let shares = |other: &Waiting| {
            oldest.bodies.iter().any(|body| *body != nobody && other.bodies.contains(body))
        };
        // From this slot on the bodies of the oldest one are left to it.
        let patient_until = self.oldest_since + u64::from(QUEUE_PATIENCE) * self.window;
        for (at, collision) in self.waiting.iter().enumerate().skip(1) {
            let free = self.free_from(collision).max(self.slot);
            if free < first.1 && (free < patient_until || !shares(collision)) {
                first = (at, free);
                if free == self.slot {
                    break;
                }
            }
        }
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that does not move.
    const GROUND: u32 = 31;

    /// The slot and the number of each issue, and the collisions that met a hazard.
    fn pass(queue: &mut Queue, pairs: &[[u32; 2]]) -> (Vec<(u64, u32)>, Vec<u32>) {
        queue.start_pass();
        let (mut slot, mut issues, mut hazards) = (0, Vec::new(), Vec::new());
        let mut places = Vec::new();
        let mut coming = pairs.iter();
        loop {
            if !queue.is_full()
                && let Some(bodies) = coming.next()
            {
                let moving = bodies.map(|body| body != GROUND);
                let entry = moving.contains(&true).then_some(Entry { bodies: *bodies, moving });
                let place = queue.enter(entry);
                assert!(!places.contains(&place), "a place is one collision's");
                places.push(place);
                continue;
            }
            let Some(Issued { collision, idle, hazard }) = queue.issue() else { break };
            places.retain(|place| *place != collision.place);
            issues.push((slot + idle, collision.number));
            hazards.extend(hazard.then_some(collision.number));
            slot += idle + 1;
        }
        hazards.sort_unstable();
        (issues, hazards)
    }

    fn queue(depth: u32, window: u64) -> Queue {
        let mut queue = Queue::new(depth);
        queue.start_step(32, window);
        queue
    }

    #[test]
    fn collisions_without_a_common_moving_body_issue_in_the_order_of_the_stream() {
        let pairs = [[GROUND, 0], [1, 2], [3, GROUND], [GROUND, GROUND], [4, 5], [6, 7]];
        for depth in [1, 2, 3, 64] {
            let (issues, hazards) = pass(&mut queue(depth, 100), &pairs);
            assert_eq!(issues, [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5)], "{depth}");
            assert!(hazards.is_empty());
        }
    }

    #[test]
    fn the_oldest_free_collision_passes_the_ones_that_meet_a_hazard() {
        // The second and the third wait for the first, the third for the second, too.
        let pairs = [[0, 1], [1, 2], [2, 0], [3, 4], [5, 6], [7, 8]];
        let (issues, hazards) = pass(&mut queue(4, 5), &pairs);
        assert_eq!(issues, [(0, 0), (1, 3), (2, 4), (3, 5), (5, 1), (10, 2)]);
        assert_eq!(hazards, [1, 2]);
        // With room for two the others come up when the second has gone.
        let (issues, hazards) = pass(&mut queue(2, 5), &pairs);
        assert_eq!(issues, [(0, 0), (5, 1), (6, 3), (7, 4), (8, 5), (10, 2)]);
        assert_eq!(hazards, [1, 2]);
    }

    #[test]
    fn the_collisions_of_a_hub_issue_a_window_apart_in_their_order() {
        let pairs: Vec<[u32; 2]> = (1..=6).map(|body| [0, body]).collect();
        let (issues, hazards) = pass(&mut queue(4, 3), &pairs);
        assert_eq!(issues, [(0, 0), (3, 1), (6, 2), (9, 3), (12, 4), (15, 5)]);
        assert_eq!(hazards, [1, 2, 3, 4, 5]);
    }

    /// Number 1 needs bodies 0 and 1, of which the others take one in turn: body 0 in slots 0, 3,
    /// 6, 9 and 12, body 1 in slots 1, 4, 7 and 10. It is the oldest from slot 1 on, so that in
    /// slot 13, four windows later, body 1 is left to it; body 0 is free again in slot 15.
    #[test]
    fn alternating_pairs_do_not_starve_a_collision_beyond_its_patience() {
        let mut pairs = vec![[0, 2], [0, 1]];
        pairs.extend((0..10).map(|k| [1 - k % 2, 3 + k]));
        let expected = [
            (0, 0),
            (1, 2),
            (3, 3),
            (4, 4),
            (6, 5),
            (7, 6),
            (9, 7),
            (10, 8),
            (12, 9),
            (15, 1),
            (18, 10),
            (19, 11),
        ];
        let mut queue = queue(8, 3);
        for _ in 0..3 {
            let (issues, hazards) = pass(&mut queue, &pairs);
            assert_eq!(issues, expected, "the same in every pass");
            assert_eq!(hazards, [1, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        }
    }

    #[test]
    fn a_window_of_one_slot_is_no_hazard() {
        let (issues, hazards) = pass(&mut queue(4, 1), &[[0, 1]; 6]);
        assert_eq!(issues, [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5)]);
        assert!(hazards.is_empty());
    }

    #[test]
    fn a_pass_that_was_cut_short_leaves_nothing() {
        let mut queue = queue(4, 3);
        queue.start_pass();
        queue.enter(Some(Entry { bodies: [0, 1], moving: [true; 2] }));
        queue.issue();
        queue.enter(Some(Entry { bodies: [0, 2], moving: [true; 2] }));
        queue.start_step(32, 3);
        let (issues, hazards) = pass(&mut queue, &[[0, 1], [2, 3]]);
        assert_eq!(issues, [(0, 0), (1, 1)]);
        assert!(hazards.is_empty());
    }
}
