//! Axis-aligned bounds of a body.

use zynq_pgs::Body;

use super::MARGIN;
use crate::{Geometry, rotation};

/// Allowance for rounding in the gap between two boxes, m; the narrow phase decides.
const SLACK: f32 = 1e-3;

/// Largest gap between the boxes of two bodies that are a pair, m.
pub(super) const GAP: f32 = MARGIN + SLACK;

/// An upper bound of the relative rounding error of a sum.
const ROUNDING: f32 = 1e-5;

/// The axis-aligned box around a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Centre of mass, m.
    pub(super) centre: [f32; 3],
    /// Half extents along the world's axes, m.
    pub(super) reach: [f32; 3],
}

impl Bounds {
    /// The bounds of a body that takes no part.
    pub(super) const NONE: Self = Self { centre: [f32::NAN; 3], reach: [f32::NAN; 3] };

    /// The bounds of a body; NaN if its pose is not finite.
    pub(super) fn of(body: &Body, geometry: Geometry) -> Self {
        let centre = body.pose.position;
        let rows = rotation::matrix(body.pose.orientation);
        let reach = match geometry {
            Geometry::Box { half_extents: [hx, hy, hz] } => {
                rows.map(|[x, y, z]| (x.abs() * hx + y.abs() * hy) + z.abs() * hz)
            }
            Geometry::Sphere { radius } => [radius; 3],
            Geometry::Capsule { half_height, radius } => {
                rows.map(|[_, y, _]| y.abs() * half_height + radius)
            }
            Geometry::Cylinder { half_height, radius } => rows.map(|[_, y, _]| {
                let across = 1.0 - y * y;
                let across = if across > 0.0 { across.sqrt() } else { 0.0 };
                y.abs() * half_height + across * radius
            }),
            Geometry::Hull { points } => rows.map(|[rx, ry, rz]| {
                let along = |[x, y, z]: &[f32; 3]| ((rx * x + ry * y) + rz * z).abs();
                points.iter().map(along).fold(0.0, f32::max)
            }),
        };
        let finite = centre.iter().chain(&reach).all(|value| value.is_finite());
        if finite { Self { centre, reach } } else { Self::NONE }
    }

    /// Whether the body takes part.
    pub(super) fn takes_part(&self) -> bool {
        // All components are finite, or none is.
        !self.reach[0].is_nan()
    }

    /// Whether two boxes are at most `gap` m apart; false if a body takes no part.
    #[inline]
    pub(super) fn near(&self, other: &Self, gap: f32) -> bool {
        (0..3).all(|axis| {
            (self.centre[axis] - other.centre[axis]).abs()
                <= (self.reach[axis] + other.reach[axis]) + gap
        })
    }

    /// Whether the body is certainly too high to touch the ground.
    pub(super) fn off_the_ground(&self) -> bool {
        let (centre, reach) = (self.centre[1], self.reach[1]);
        centre - reach > GAP + (centre.abs() + reach) * ROUNDING
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::ground;
    use super::*;
    use crate::fixtures::body;

    const HULL: [[f32; 3]; 12] = crate::hull::cuboctahedron([0.9, 0.5, 0.6]);

    #[test]
    fn what_is_not_finite_takes_no_part() {
        let level = [0.0, 0.0, 0.0, 1.0];
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let place = [0.0, value, 0.0];
            for body in [body(place, level), body([0.0; 3], [0.0, 0.0, value, 1.0])] {
                let bounds = Bounds::of(&body, Geometry::CUBE);
                assert!(!bounds.takes_part(), "{body:?}");
                assert!(!bounds.near(&bounds, f32::INFINITY) && !bounds.off_the_ground());
            }
        }
        assert!(Bounds::of(&body([1e30; 3], level), Geometry::CUBE).takes_part());
    }

    proptest! {
        #[test]
        fn what_is_off_the_ground_does_not_touch_it(
            above in -0.03_f32..0.06,
            far in -4e3_f32..4e3,
            q in prop::array::uniform4(-1.0_f32..1.0),
            kind in 0..5,
        ) {
            let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
            prop_assume!(length > 0.1);
            let geometry = match kind {
                0 => Geometry::Box { half_extents: [1.0, 0.3, 0.7] },
                1 => Geometry::Sphere { radius: 0.6 },
                2 => Geometry::Capsule { half_height: 0.5, radius: 0.4 },
                3 => Geometry::Cylinder { half_height: 0.5, radius: 0.4 },
                _ => Geometry::Hull { points: &HULL },
            };
            let mut body = body([far, 0.0, -far], q.map(|value| value / length));
            body.pose.position[1] = Bounds::of(&body, geometry).reach[1] + above;
            let off = Bounds::of(&body, geometry).off_the_ground();
            let touches = ground::collide(1, &body, geometry).is_some();
            prop_assert!(!(off && touches), "{body:?}");
            prop_assert!(off || touches || above < MARGIN + 2.0 * SLACK, "{body:?}");
        }
    }
}
