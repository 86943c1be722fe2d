//! This folder finds where two boxes touch, with the bits of parry3d's and in less of its time.
//!
//! Nearly all pairs of a pile are boxes. parry computes their manifold in `contact_manifold_cuboid_cuboid`
//! one axis and one point at a time; here the same operations are done on four at once, in the same
//! order, so that not a bit differs: see the tests, which compare. What parry keeps for its own callers
//! (features, manifolds of earlier steps) is left away. Where two boxes are apart along two normals of one
//! at once, which pairs of a pile hardly ever are, parry is asked.

mod axis;
mod clip;
mod lanes;

use parry3d::math::Pose;

use axis::Found;
use lanes::{Rotation, Vec3};

use super::MARGIN;

/// A point at which two boxes touch, in the frame of A.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// On A's surface.
    pub(super) on_a: Vec3,
    /// On B's.
    pub(super) on_b: Vec3,
    /// Signed distance, m.
    pub(super) distance: f32,
}

/// Two boxes, one in the frame of the other.
#[derive(Debug, Clone, Copy)]
struct Placed {
    half_a: Vec3,
    half_b: Vec3,
    b_in_a: Rotation,
    a_in_b: Rotation,
    /// From the centre of A to that of B, in the frame of A.
    translation: Vec3,
}

/// What two boxes have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Touch {
    /// They are farther apart than the margin.
    Apart,
    /// They touch along this unit vector from A to B, in the frame of A.
    Along(Vec3),
    /// parry must say it.
    Unknown,
}

/// Where boxes of these half extents touch, B placed in the frame of A.
pub(super) fn touch(b_in_a: &Pose, half_a: Vec3, half_b: Vec3, each: impl FnMut(Point)) -> Touch {
    let rotation = Rotation::new(b_in_a.rotation.to_array());
    let placed = Placed {
        half_a,
        half_b,
        b_in_a: rotation,
        a_in_b: rotation.inverse(),
        translation: b_in_a.translation.to_array(),
    };
    match axis::find(&placed, MARGIN) {
        Found::Apart => Touch::Apart,
        Found::Corner => Touch::Unknown,
        Found::Axis(axis) => {
            clip::points(&placed, axis, each);
            Touch::Along(axis)
        }
    }
}

/// Points of the frame of A in that of B.
pub(super) fn in_b(b_in_a: &Pose, points: [Vec3; 4]) -> [Vec3; 4] {
    let translation = lanes::Four::splat(b_in_a.translation.to_array());
    let back = Rotation::new(b_in_a.rotation.to_array()).inverse();
    back.turn_four(lanes::Four::new(points).minus(translation)).vectors()
}
