//! This file gathers the points at which two bodies touch, before four of them are chosen.

use super::MARGIN;
use super::reduce::Candidate;

/// Points that two faces have in common at most: four corners of each, and each edge of one with each
/// of the other.
const MOST: usize = 4 + 4 + 16;

/// Points near enough, in the order in which they were found.
#[derive(Debug)]
pub(super) struct Points {
    candidates: [Candidate; MOST],
    on_b: [[f32; 3]; MOST],
    count: usize,
}

impl Default for Points {
    fn default() -> Self {
        let none = Candidate { point: [0.0; 3], distance: 0.0 };
        Self { candidates: [none; MOST], on_b: [[0.0; 3]; MOST], count: 0 }
    }
}

impl Points {
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// What the choice sees: where they are on A, and how far apart.
    pub(super) fn candidates(&self) -> &[Candidate] {
        &self.candidates[..self.count]
    }

    /// Where they are on B.
    pub(super) fn on_b(&self) -> &[[f32; 3]] {
        &self.on_b[..self.count]
    }

    /// Takes a point if it is near enough; of more than two faces can have, the first.
    #[inline]
    pub(super) fn take(&mut self, on_a: [f32; 3], on_b: [f32; 3], distance: f32) {
        // Written so that a NaN is no contact.
        let near = distance <= MARGIN && distance.is_finite();
        if near && on_b.iter().all(|value| value.is_finite()) && self.count < MOST {
            self.candidates[self.count] = Candidate { point: on_a, distance };
            self.on_b[self.count] = on_b;
            self.count += 1;
        }
    }
}
