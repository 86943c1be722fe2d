//! Finds where two bodies touch, and keeps the contacts while the bodies hardly move against each
//! other.
//!
//! [parry](super::parry) finds the contacts of a pair; [`reduce`](super::reduce) chooses four of
//! them. The points then stay on B, and the normal stays on A, until B has moved or turned on A by
//! more than the tolerances below; the distances follow each pose meanwhile. Each pose is compared
//! with the pose of the last search, so that contacts do not creep over an edge in small steps.
//! Bullet keeps its manifolds, too, and lets points drift by 2 cm (`btPersistentManifold`).

use parry3d::math::{Pose, Vector};
use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision, Contact};

use super::parry::{Parry, pose};
use super::reduce::reduce;
use super::{Geometries, MARGIN};

/// Tolerance of a normal's length: rounding is far below, a broken pose above.
const NORMAL_TOLERANCE: f32 = 5e-4;

/// The way of B along the normal up to which contacts are kept, m: points farther apart than
/// [`MARGIN`] are not known, and do not touch on that way.
const ALONG: f32 = 0.5 * MARGIN;

/// The squared way of B across the normal up to which contacts are kept, m² (1 mm).
const ACROSS_SQUARED: f32 = 1e-6;

/// Cosine of half the angle by which B may turn while contacts are kept (0.36 degrees).
const TURN: f32 = 0.999_995;

/// Where the bodies of a candidate touch, found by this detection or an earlier one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pair: (u32, u32),
    /// The shapes for which it was found.
    shapes: [u32; 2],
    /// The pose of B in the frame of A for which it was found.
    b_in_a: Pose,
    /// Unit vector from A to B along which they touch, in the frame of A.
    axis: Vector,
    /// The points in the frame of B, and their distances at that pose.
    contacts: [Contact; CONTACT_POINTS],
    /// The number of points; 0 if nothing is known.
    count: usize,
}

impl Touch {
    const fn unknown(pair: (u32, u32)) -> Self {
        Self {
            pair,
            shapes: [0; 2],
            b_in_a: Pose::IDENTITY,
            axis: Vector::ZERO,
            contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
            count: 0,
        }
    }

    /// Whether the contacts may be kept for these shapes at this pose; never if the pose has a NaN.
    fn holds(&self, shapes: [u32; 2], b_in_a: &Pose) -> bool {
        let way = b_in_a.translation - self.b_in_a.translation;
        let along = way.dot(self.axis);
        self.count > 0
            && self.shapes == shapes
            && along.abs() <= ALONG
            && (way - self.axis * along).length_squared() <= ACROSS_SQUARED
            && b_in_a.rotation.dot(self.b_in_a.rotation).abs() >= TURN
    }

    /// The collision of two bodies at their poses; `b_in_a` is that of B in the frame of A.
    fn collision(&self, [a, b]: [&Pose; 2], b_in_a: &Pose) -> Option<Collision> {
        let normal = -(a.rotation * self.axis);
        // In this form a NaN is no normal.
        let is_unit = (normal.length() - 1.0).abs() <= NORMAL_TOLERANCE;
        let (mut contacts, mut count) = ([Contact::default(); CONTACT_POINTS], 0);
        for contact in &self.contacts[..self.count] {
            let on_b = Vector::from_array(contact.point);
            let way = *b_in_a * on_b - self.b_in_a * on_b;
            let (point, distance) = (*b * on_b, contact.distance + way.dot(self.axis));
            if !point.is_finite() {
                return None;
            }
            if distance <= MARGIN {
                contacts[count] = Contact { point: point.to_array(), distance };
                count += 1;
            }
        }
        let (body_a, body_b) = self.pair;
        // At most four.
        let count = u32::try_from(count).ok().filter(|&count| count > 0 && is_unit)?;
        Some(Collision { body_a, body_b, normal: normal.to_array(), count, contacts })
    }
}

/// Makes one touch for each candidate. A pair that was a candidate before keeps its touch. Both
/// lists are sorted.
pub(super) fn follow(touches: &mut Vec<Touch>, candidates: &[(u32, u32)]) {
    let mut left = candidates.iter().copied().peekable();
    touches.retain(|touch| {
        while left.next_if(|pair| *pair < touch.pair).is_some() {}
        left.peek() == Some(&touch.pair)
    });
    let mut kept = touches.len();
    touches.resize(candidates.len(), Touch::unknown((0, 0)));
    // From the end, where no place is behind the touch that moves there.
    for (place, &pair) in candidates.iter().enumerate().rev() {
        if kept > 0 && touches[kept - 1].pair == pair {
            kept -= 1;
            touches[place] = touches[kept];
        } else {
            touches[place] = Touch::unknown(pair);
        }
    }
}

/// The narrow phase, with its buffers.
#[derive(Debug, Default)]
pub(super) struct Narrow {
    parry: Parry,
}

impl Narrow {
    /// The collision of a pair of `bodies`, if there is one.
    pub(super) fn collide(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        touch: &mut Touch,
    ) -> Option<Collision> {
        let (a, b) = (bodies.get(touch.pair.0 as usize)?, bodies.get(touch.pair.1 as usize)?);
        let (pose_a, pose_b, shapes) = (pose(a), pose(b), [a.shape, b.shape]);
        let b_in_a = pose_a.inv_mul(&pose_b);
        if !touch.holds(shapes, &b_in_a) {
            touch.count = 0;
            let (axis, places) = self.parry.ask(&b_in_a, [geometries.of(a)?, geometries.of(b)?])?;
            let (contacts, count) = reduce(places, axis);
            *touch = Touch { shapes, b_in_a, axis, contacts, count, ..*touch };
        }
        touch.collision([&pose_a, &pose_b], &b_in_a)
    }
}

#[cfg(test)]
mod tests;
