//! The thesis' order: collisions body by body, to keep few bodies alive at once.
//!
//! All collisions of one body come first. Then come all remaining collisions of the active body
//! with the fewest remaining, and so on. A body becomes active with its first collision. If no body
//! is active, the algorithm begins again with the next moving body of the lowest index.
//!
//! The thesis leaves three points open, and this code chooses: it begins with the moving body of
//! the lowest index, it takes a body's collisions in ascending order, and it never makes static
//! bodies active. A tie rule decides between bodies with equally few collisions left.
//!
//! Source: thesis §4.7, Algorithm 3.

use std::collections::BTreeSet;

use zynq_pgs::order::OrderInput;

/// The rule that picks one of several active bodies with the fewest collisions left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ties {
    /// The body of the lowest index.
    LowestIndex,
    /// The body that became active first.
    Oldest,
    /// The body that became active last.
    Newest,
}

impl Ties {
    fn rank(self, age: u32) -> u32 {
        match self {
            Self::LowestIndex => 0,
            Self::Oldest => age,
            Self::Newest => u32::MAX - age,
        }
    }
}

/// The state of the algorithm.
struct Bodies<'a> {
    input: &'a OrderInput<'a>,
    ties: Ties,
    /// Collisions left of each body.
    left: Vec<u32>,
    /// When each body became active.
    age: Vec<Option<u32>>,
    activated: u32,
    /// Collisions left, tie rank and index of the active bodies.
    active: BTreeSet<(u32, u32, u32)>,
}

impl Bodies<'_> {
    fn key(&self, body: u32) -> Option<(u32, u32, u32)> {
        let age = self.age[body as usize]?;
        Some((self.left[body as usize], self.ties.rank(age), body))
    }

    /// Counts one collision of the body as done.
    fn take_one(&mut self, body: u32) {
        if !self.input.moving[body as usize] {
            return;
        }
        if let Some(key) = self.key(body) {
            self.active.remove(&key);
        } else {
            self.age[body as usize] = Some(self.activated);
            self.activated += 1;
        }
        self.left[body as usize] -= 1;
        if self.left[body as usize] > 0 {
            self.active.extend(self.key(body));
        }
    }

    fn activate(&mut self, body: u32) {
        if self.age[body as usize].is_none() {
            self.age[body as usize] = Some(self.activated);
            self.activated += 1;
        }
    }
}

/// Orders the collisions of an input that was checked.
pub(crate) fn order(input: &OrderInput<'_>, ties: Ties) -> Vec<u32> {
    let count = input.moving.len();
    // The collisions of body `b` are `of[starts[b]..starts[b + 1]]`, in ascending order.
    let mut starts = vec![0_usize; count + 1];
    for body in input.taking_part().flat_map(|(_, pair)| pair) {
        starts[body as usize + 1] += 1;
    }
    let left = (0..count).map(|body| u32::try_from(starts[body + 1]).unwrap_or(u32::MAX)).collect();
    for body in 0..count {
        starts[body + 1] += starts[body];
    }
    let mut next = starts.clone();
    let mut of = vec![0_u32; 2 * input.pairs.len()];
    for (index, pair) in input.taking_part() {
        for body in pair.map(|body| body as usize) {
            of[next[body]] = index;
            next[body] += 1;
        }
    }

    let mut bodies =
        Bodies { input, ties, left, age: vec![None; count], activated: 0, active: BTreeSet::new() };
    let mut done = vec![false; input.pairs.len()];
    let mut order = Vec::with_capacity(input.pairs.len());
    let lowest = (0..).zip(input.moving).filter(|(_, moving)| **moving).map(|(body, _)| body);
    for first in lowest {
        let mut current = Some(first).filter(|body: &u32| bodies.left[*body as usize] > 0);
        while let Some(body) = current {
            bodies.activate(body);
            for index in &of[starts[body as usize]..starts[body as usize + 1]] {
                if !std::mem::replace(&mut done[*index as usize], true) {
                    let [a, b] = input.pairs[*index as usize];
                    order.push(*index);
                    bodies.take_one(body);
                    bodies.take_one(if a == body { b } else { a });
                }
            }
            current = bodies.active.first().map(|(_, _, body)| *body);
        }
    }
    // Pairs of two static bodies belong to no body's turn and come last.
    order
        .extend(input.taking_part().map(|(index, _)| index).filter(|index| !done[*index as usize]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_taken_by_fewest_left_then_by_the_tie_rule() {
        // 1 meets 2, 3, 4; then 2, 3 and 4 have 1, 1 and 2 left.
        let input = OrderInput {
            pairs: &[[1, 4], [1, 3], [1, 2], [2, 5], [3, 6], [4, 7], [4, 8], [0, 9]],
            moving: &[false, true, true, true, true, true, true, true, true, true],
        };
        let ordered = |ties| order(&input, ties);
        // Active in the order 1, 4, 3, 2.
        assert_eq!(ordered(Ties::LowestIndex), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(ordered(Ties::Oldest), [0, 1, 2, 4, 3, 5, 6, 7]);
        assert_eq!(ordered(Ties::Newest), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
