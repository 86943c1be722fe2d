//! This file gathers the points at which two bodies touch, before four of them are chosen, of a pair in
//! each lane.

use super::MARGIN;
use super::lanes::{Mask, Numbers, Vector, mask};

/// Points that two faces have in common at most: four corners of each, and each edge of one with each
/// of the other.
pub(super) const MOST: usize = 4 + 4 + 16;

/// A point of some of the pairs.
#[derive(Clone, Copy)]
pub(super) struct Slot<N: Numbers> {
    /// Of which pairs it is one.
    pub(super) taken: N::Mask,
    pub(super) on_a: Vector<N>,
    pub(super) on_b: Vector<N>,
    pub(super) distance: N,
}

/// Points near enough, of each pair in the order in which they were found.
pub(super) struct Points<N: Numbers> {
    slots: [Slot<N>; MOST],
    count: usize,
}

impl<N: Numbers> Points<N> {
    /// None, whatever number `any` is.
    pub(super) fn none(any: N) -> Self {
        let (zero, nowhere) = (any.all(0.0), Vector::all(any, [0.0; 3]));
        let taken = zero.above(zero);
        let slot = Slot { taken, on_a: nowhere, on_b: nowhere, distance: zero };
        Self { slots: [slot; MOST], count: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn slots(&self) -> &[Slot<N>] {
        &self.slots[..self.count]
    }

    /// Takes a point of those pairs of which it is near enough; of more than two faces can have, the
    /// first.
    #[inline(always)]
    pub(super) fn take(&mut self, pairs: N::Mask, on_a: Vector<N>, on_b: Vector<N>, distance: N) {
        // Written so that a NaN is no contact.
        let near = distance.all(MARGIN).at_least(distance);
        let finite = distance.all(f32::INFINITY).above(distance.abs()).and(on_b.is_finite());
        let taken = pairs.and(near).and(finite);
        if taken.bits() != 0 && self.count < MOST {
            self.slots[self.count] = Slot { taken, on_a, on_b, distance };
            self.count += 1;
        }
    }

    /// Sets the point of one lane's pair in the slot of that number.
    pub(super) fn put(
        &mut self,
        number: usize,
        lane: usize,
        on_a: [f32; 3],
        on_b: [f32; 3],
        distance: f32,
    ) {
        while self.count <= number && self.count < MOST {
            let slot = &mut self.slots[self.count];
            slot.taken = slot.taken.without(slot.taken);
            self.count += 1;
        }
        if let Some(slot) = self.slots.get_mut(number) {
            let only = mask(slot.distance, 1 << lane);
            slot.taken = slot.taken.either(only);
            slot.on_a = Vector::all(slot.distance, on_a).or(only, slot.on_a);
            slot.on_b = Vector::all(slot.distance, on_b).or(only, slot.on_b);
            slot.distance = slot.distance.all(distance).or(only, slot.distance);
        }
    }
}
