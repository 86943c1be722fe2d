//! Collects the contact points of two bodies before four of them are chosen, for one pair in each
//! lane.

use zynq_pgs::CONTACT_POINTS;

use super::MARGIN;
use super::lanes::{Mask, Numbers, Vector};

/// Most points of two faces: four corners of each, and each edge of one with each of the other.
pub(super) const MOST: usize = 4 + 4 + 16;

/// One point of each pair.
#[derive(Clone, Copy)]
pub(super) struct Slot<N: Numbers> {
    /// The pairs that have it.
    pub(super) taken: N::Mask,
    pub(super) on_a: Vector<N>,
    pub(super) on_b: Vector<N>,
    pub(super) distance: N,
}

impl<N: Numbers> Slot<N> {
    /// Selects this point for the pairs in the mask, and the other elsewhere.
    #[inline(always)]
    pub(super) fn or(&self, mask: N::Mask, other: &Self) -> Self {
        Self {
            taken: self.taken.and(mask).either(other.taken.without(mask)),
            on_a: self.on_a.or(mask, other.on_a),
            on_b: self.on_b.or(mask, other.on_b),
            distance: self.distance.or(mask, other.distance),
        }
    }
}

/// Near enough points, for each pair in the order of discovery and without gaps.
pub(super) struct Points<N: Numbers> {
    /// Slots beyond the count are unused.
    slots: [Slot<N>; MOST],
    count: usize,
}

impl<N: Numbers> Points<N> {
    /// No points; `any` serves only as proof of the instructions.
    pub(super) fn none(any: N) -> Self {
        let (zero, nowhere) = (any.all(0.0), Vector::all(any, [0.0; 3]));
        let taken = zero.above(zero);
        let slot = Slot { taken, on_a: nowhere, on_b: nowhere, distance: zero };
        Self { slots: [slot; MOST], count: 0 }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        for slot in &mut self.slots[..self.count] {
            slot.taken = slot.taken.without(slot.taken);
        }
        self.count = 0;
    }

    /// The slots that some pair uses.
    pub(super) fn slots(&self) -> &[Slot<N>] {
        &self.slots[..self.count]
    }

    /// The first slots, and the pairs that have more points.
    #[inline(always)]
    pub(super) fn first(&self) -> ([Slot<N>; CONTACT_POINTS], N::Mask) {
        let [a, b, c, d, fifth, ..] = &self.slots;
        ([*a, *b, *c, *d], fifth.taken)
    }

    /// Adds a point for the pairs in which it is near enough; points beyond the most of two faces
    /// are dropped.
    #[inline(always)]
    pub(super) fn take(&mut self, pairs: N::Mask, on_a: Vector<N>, on_b: Vector<N>, distance: N) {
        // In this form a NaN is no contact.
        let near = distance.all(MARGIN).at_least(distance);
        let finite = distance.all(f32::INFINITY).above(distance.abs()).and(on_b.is_finite());
        let taken = pairs.and(near).and(finite);
        let point = Slot { taken, on_a, on_b, distance };
        let mut left = taken;
        for (number, slot) in self.slots.iter_mut().enumerate() {
            if left.bits() == 0 {
                break;
            }
            // The pairs whose next slot is this one.
            let free = left.without(slot.taken);
            left = left.and(slot.taken);
            if free.bits() != 0 {
                *slot = point.or(free, slot);
                self.count = self.count.max(number + 1);
            }
        }
    }
}
