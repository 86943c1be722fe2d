//! The issue queue: which of the waiting collisions enters the pipeline next.
//!
//! It decides in slots and knows neither clocks nor beats (bitstream-model/README.md §8). The
//! reference asks it beat by beat, [`fast`](crate::fast) once a step for all passes. It keeps who
//! waits; the records stay where its owner has them, at the [`place`](Issued::place) of each.

use std::collections::VecDeque;

use super::hazards::Entry;
use crate::cast::register;
use pgs_interface::control::QUEUE_PATIENCE;

/// A collision in the queue.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    number: u32,
    place: u32,
    /// Its moving bodies; the number of all bodies stands for one that does not move.
    bodies: [u32; 2],
}

/// A collision that issues.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Issued {
    /// Its number in the stream.
    pub(crate) number: u32,
    /// Its place among the records of the queue, below the depth. No other collision had it at the
    /// same time.
    pub(crate) place: u32,
    /// Slots that idled before.
    pub(crate) idle: u64,
    /// Whether it was not free in the first slot in which it was the oldest.
    pub(crate) hazard: bool,
}

/// A collision that leaves the queue.
struct Leaving {
    collision: Waiting,
    is_oldest: bool,
}

/// The slot from which a collision is free of hazards, by the slots from which bodies are.
#[inline(always)]
fn free_from(free: &[u64], collision: &Waiting) -> u64 {
    let [a, b] = collision.bodies.map(|body| free[body as usize]);
    a.max(b)
}

/// The queue of a board.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    depth: usize,
    /// Slots from a collision to the next that has a body in common with it.
    window: u64,
    /// The next slot that decides, counted over all passes of a step.
    slot: u64,
    /// The slot from which on the bodies of the oldest collision are left to it.
    patient_until: u64,
    /// Collisions that were not free in some slot, in the order of the stream. The fresh ones stand behind them in
    /// the stream, and no slot has looked at one yet: most slots look at one collision.
    blocked: Vec<Waiting>,
    fresh: VecDeque<Waiting>,
    /// A slot before which each of the blocked ones cannot issue, and one for all of them.
    until: Vec<u64>,
    blocked_until: u64,
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
        self.blocked.clear();
        self.until.clear();
        self.fresh.clear();
        self.slot += self.window;
        self.patient_until = self.slot + self.patience();
        (self.entered, self.left) = (0, 0);
    }

    pub(crate) fn len(&self) -> usize {
        self.blocked.len() + self.fresh.len()
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len() == self.depth
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
    #[inline(always)]
    pub(crate) fn enter(&mut self, entry: Option<Entry>) -> u32 {
        debug_assert!(!self.is_full(), "a collision enters when another has left");
        let nobody = register(self.free.len() - 1);
        let bodies = entry.map_or([nobody; 2], |Entry { bodies: [a, b], moving }| {
            [if moving[0] { a } else { nobody }, if moving[1] { b } else { nobody }]
        });
        let place = if self.fills() { self.entered } else { self.left };
        let number = self.entered;
        self.entered += 1;
        self.fresh.push_back(Waiting { number, place, bodies });
        place
    }

    /// The next collision to issue leaves. The queue is full, or the stream has ended. `None`: it
    /// is empty.
    #[inline(always)]
    pub(crate) fn issue(&mut self) -> Option<Issued> {
        let before = self.slot;
        let Leaving { collision, is_oldest } = self.leaves()?;
        let last = self.free.len() - 1;
        for body in collision.bodies {
            self.free[body as usize] = self.slot + self.window;
        }
        self.free[last] = 0;
        let Waiting { number, place, .. } = collision;
        let idle = self.slot - before;
        // The oldest one that is free goes at once.
        let hazard = is_oldest && self.slot + self.patience() > self.patient_until;
        self.slot += 1;
        self.left = place;
        if is_oldest {
            self.patient_until = self.slot + self.patience();
        }
        Some(Issued { number, place, idle, hazard })
    }

    /// Slots for which others may pass the oldest collision.
    fn patience(&self) -> u64 {
        u64::from(QUEUE_PATIENCE) * self.window
    }

    /// Takes the oldest collision that is free, idling until one is.
    #[inline(always)]
    fn leaves(&mut self) -> Option<Leaving> {
        loop {
            if self.slot >= self.patient_until {
                return self.leaves_by_patience();
            }
            if self.slot >= self.blocked_until
                && let Some(at) = self.unblocked()
            {
                return Some(self.take_blocked(at));
            }
            while let Some(collision) = self.fresh.pop_front() {
                let free = free_from(&self.free, &collision);
                if free <= self.slot {
                    let is_oldest = self.blocked.is_empty();
                    return Some(Leaving { collision, is_oldest });
                }
                self.block(collision, free);
            }
            if self.blocked.is_empty() {
                return None;
            }
            self.slot = self.blocked_until;
        }
    }

    #[inline(never)]
    fn block(&mut self, collision: Waiting, until: u64) {
        let others = if self.blocked.is_empty() { until } else { self.blocked_until };
        self.blocked_until = others.min(until);
        self.blocked.push(collision);
        self.until.push(until);
    }

    #[inline(never)]
    fn take_blocked(&mut self, at: usize) -> Leaving {
        self.until.remove(at);
        let collision = self.blocked.remove(at);
        Leaving { collision, is_oldest: at == 0 }
    }

    /// The oldest blocked collision that is free now.
    #[inline(never)]
    fn unblocked(&mut self) -> Option<usize> {
        let mut soonest = u64::MAX;
        for (at, until) in self.until.iter_mut().enumerate() {
            if *until <= self.slot {
                // Another one may have taken its bodies meanwhile.
                *until = free_from(&self.free, &self.blocked[at]);
                if *until <= self.slot {
                    return Some(at);
                }
            }
            soonest = soonest.min(*until);
        }
        self.blocked_until = soonest;
        None
    }

    /// The same when the oldest one has waited for so long that its bodies are left to it.
    #[cold]
    fn leaves_by_patience(&mut self) -> Option<Leaving> {
        while let Some(collision) = self.fresh.pop_front() {
            self.block(collision, self.slot);
        }
        let oldest = *self.blocked.first()?;
        let nobody = register(self.free.len() - 1);
        let shares = |other: &Waiting| {
            oldest.bodies.iter().any(|body| *body != nobody && other.bodies.contains(body))
        };
        let (mut first, mut soonest) = (0, free_from(&self.free, &oldest).max(self.slot));
        for (at, collision) in self.blocked.iter().enumerate().skip(1) {
            let free = free_from(&self.free, collision).max(self.slot);
            if free < soonest && !shares(collision) {
                (first, soonest) = (at, free);
            }
        }
        self.slot = soonest;
        Some(self.take_blocked(first))
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
            let Some(Issued { number, place, idle, hazard }) = queue.issue() else { break };
            places.retain(|other| *other != place);
            issues.push((slot + idle, number));
            hazards.extend(hazard.then_some(number));
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

    /// Collision 1 needs bodies 0 and 1. The other collisions take body 0 in slots 0, 3, 6, 9 and
    /// 12, and body 1 in slots 1, 4, 7 and 10. Collision 1 is the oldest from slot 1 on. In slot 13,
    /// four windows later, no other collision may take body 1. Body 0 is free again in slot 15.
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
            assert_eq!(hazards, [1, 10], "the others pass the oldest, or go at once");
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

    /// The same by looking at every collision in every slot, as the specification has it.
    fn by_search(depth: usize, window: u64, pairs: &[[u32; 2]]) -> (Vec<(u64, u32)>, Vec<u32>) {
        let moving = |number: u32| {
            pairs[number as usize].into_iter().filter(|body| *body != GROUND).collect::<Vec<_>>()
        };
        let mut last: Vec<Option<u64>> = vec![None; 32];
        let mut coming = 0..register(pairs.len());
        let mut waiting: Vec<u32> = coming.by_ref().take(depth).collect();
        let (mut slot, mut oldest_waits, mut issues) = (0, 0, Vec::new());
        let mut hazards = std::collections::BTreeSet::new();
        while let Some(oldest) = waiting.first().copied() {
            let taken = |number: u32| {
                moving(number)
                    .iter()
                    .any(|body| last[*body as usize].is_some_and(|issued| slot - issued < window))
            };
            hazards.extend((oldest_waits == 0 && taken(oldest)).then_some(oldest));
            let shares = |number: u32| moving(number).iter().any(|b| moving(oldest).contains(b));
            let kept =
                |number: u32| oldest_waits >= 4 * window && number != oldest && shares(number);
            let next = waiting.iter().position(|number| !taken(*number) && !kept(*number));
            if let Some(at) = next {
                let number = waiting.remove(at);
                moving(number).iter().for_each(|body| last[*body as usize] = Some(slot));
                issues.push((slot, number));
                waiting.extend(coming.next());
            }
            oldest_waits = if next == Some(0) { 0 } else { oldest_waits + 1 };
            slot += 1;
        }
        (issues, hazards.into_iter().collect())
    }

    proptest::proptest! {
        #[test]
        fn every_slot_decides_as_the_specification_does(
            (depth, window) in (1..12_u32, 1..9_u64),
            hubs in 1..6_u32,
            pairs in proptest::collection::vec((0..32_u32, 0..32_u32, 0..4_u8), 0..120),
        ) {
            // One side is often a hub, so that collisions wait for long.
            let pairs: Vec<[u32; 2]> = pairs
                .into_iter()
                .map(|(a, b, how)| if how > 0 { [a % hubs, b] } else { [a, b] })
                .map(|[a, b]| if a == b { [GROUND; 2] } else { [a, b] })
                .collect();
            let mut queue = queue(depth, window);
            for _ in 0..2 {
                let expected = by_search(depth as usize, window, &pairs);
                proptest::prop_assert_eq!(pass(&mut queue, &pairs), expected);
            }
        }
    }
}
