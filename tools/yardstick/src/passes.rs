//! Solves the collisions one after the other, in passes.

use super::rows::{ContactRows, FrictionRows};
use super::vector::{Vec3, add, cross, dot, negate, scale, subtract, times};
use super::{Moving, index};

/// 1 minus the factor by which a friction pass damps the spin about the normal, as in Bullet's pipeline
/// and in `StepParameters::thesis`.
const SPIN_DAMPING: f32 = 0.1;

/// A direction and the moments about it.
#[derive(Clone, Copy)]
struct Row {
    direction: Vec3,
    moment_a: Vec3,
    moment_b: Vec3,
}

impl Row {
    #[inline]
    fn new(direction: Vec3, arm_a: Vec3, arm_b: Vec3) -> Self {
        let moment_b = negate(cross(arm_b, direction));
        Self { direction, moment_a: cross(arm_a, direction), moment_b }
    }

    /// The relative velocity along it.
    #[inline]
    fn speed(&self, a: &Moving, b: &Moving) -> f32 {
        let of_a = dot(self.direction, a.linear) + dot(self.moment_a, a.angular);
        (of_a + dot(negate(self.direction), b.linear)) + dot(self.moment_b, b.angular)
    }

    #[inline]
    fn apply(&self, impulse: f32, a: &mut Moving, b: &mut Moving) {
        let n = self.direction;
        a.linear = add(a.linear, scale(scale(n, a.inverse_mass), impulse));
        a.angular = add(a.angular, scale(times(a.inverse_inertia, self.moment_a), impulse));
        b.linear = add(b.linear, scale(scale(negate(n), b.inverse_mass), impulse));
        b.angular = add(b.angular, scale(times(b.inverse_inertia, self.moment_b), impulse));
    }
}

/// Writes back what a collision changes.
#[inline]
fn store(bodies: &mut [Moving], at: usize, body: &Moving) {
    let stored = &mut bodies[at];
    (stored.linear, stored.angular) = (body.linear, body.angular);
}

/// One contact pass.
#[inline(never)]
pub(super) fn contact(rows: &mut [ContactRows], bodies: &mut [Moving]) {
    for rows in rows {
        let (at_a, at_b) = (index(rows.body_a), index(rows.body_b));
        let (mut a, mut b) = (bodies[at_a], bodies[at_b]);
        for i in 0..index(rows.count).min(4) {
            let jacobian = rows.jacobians[i];
            if jacobian == 0.0 {
                continue;
            }
            let point = rows.points[i];
            let row = Row::new(
                rows.normal,
                subtract(point, rows.position_a),
                subtract(point, rows.position_b),
            );
            let before = rows.impulses[i];
            let wanted = before + (row.speed(&a, &b) + rows.biases[i]) * jacobian;
            let after = if wanted > 0.0 { wanted } else { 0.0 };
            rows.impulses[i] = after;
            row.apply(after - before, &mut a, &mut b);
        }
        store(bodies, at_a, &a);
        store(bodies, at_b, &b);
    }
}

/// The limit of friction, from the normal impulses of the contact passes.
#[inline(never)]
pub(super) fn limits(friction: f32, contacts: &[ContactRows], rows: &mut [FrictionRows]) {
    for (contact, rows) in contacts.iter().zip(rows) {
        let [l0, l1, l2, l3] = contact.impulses;
        rows.limit = friction * (((l0 + l1) + l2) + l3);
    }
}

/// One friction pass.
#[inline(never)]
pub(super) fn friction(rows: &mut [FrictionRows], bodies: &mut [Moving]) {
    for rows in rows {
        if rows.jacobians[0] == 0.0 {
            continue;
        }
        let (at_a, at_b) = (index(rows.body_a), index(rows.body_b));
        let (mut a, mut b) = (bodies[at_a], bodies[at_b]);
        let limit = rows.limit;
        for k in 0..2 {
            let row = Row::new(rows.directions[k], rows.arm_a, rows.arm_b);
            let before = rows.impulses[k];
            let wanted = before + row.speed(&a, &b) * rows.jacobians[k];
            let above = if wanted > -limit { wanted } else { -limit };
            let after = if above < limit { above } else { limit };
            rows.impulses[k] = after;
            row.apply(after - before, &mut a, &mut b);
        }
        if rows.damps_spin {
            let n = rows.normal;
            let (spin_a, spin_b) = (dot(n, a.angular), dot(n, b.angular));
            a.angular = subtract(a.angular, scale(n, spin_a * SPIN_DAMPING));
            b.angular = subtract(b.angular, scale(n, spin_b * SPIN_DAMPING));
        }
        store(bodies, at_a, &a);
        store(bodies, at_b, &b);
    }
}
