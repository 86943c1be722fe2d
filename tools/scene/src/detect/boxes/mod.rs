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
use wide::f32x4;

use axis::Found;
use lanes::{Four, Rotation, Vec3};

use super::MARGIN;
use super::points::Points;

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
///
/// The points are taken on B too in the frame of A.
pub(super) fn touch(b_in_a: &Pose, half_a: Vec3, half_b: Vec3, points: &mut Points) -> Touch {
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
            clip::points(&placed, axis, points);
            Touch::Along(axis)
        }
    }
}

/// Points of the frame of A in that of B.
pub(super) fn in_b(b_in_a: &Pose, points: [Vec3; 4]) -> [Vec3; 4] {
    let translation = Four::splat(b_in_a.translation.to_array());
    let back = Rotation::new(b_in_a.rotation.to_array()).inverse();
    back.turn_four(Four::new(points).minus(translation)).vectors()
}

impl Points {
    /// Takes the points in some lanes, given as bits.
    // Once in the program, and not at each place that has points.
    #[inline(never)]
    fn take_lanes(&mut self, mut lanes: u32, on_a: Four, on_b: Four, distances: f32x4) {
        let a = [on_a.x, on_a.y, on_a.z].map(f32x4::to_array);
        let b = [on_b.x, on_b.y, on_b.z].map(f32x4::to_array);
        let distances = distances.to_array();
        while lanes != 0 {
            let lane = (lanes.trailing_zeros() & 3) as usize;
            lanes &= lanes - 1;
            self.take(a.map(|lanes| lanes[lane]), b.map(|lanes| lanes[lane]), distances[lane]);
        }
    }
}

#[cfg(test)]
mod tests {
    use parry3d::math::{Rotation as Quaternion, Vector};
    use parry3d::query::ContactManifold;
    use parry3d::query::details::contact_manifold_cuboid_cuboid;
    use parry3d::shape::Cuboid;

    use super::*;
    use crate::random::SplitMix64;

    /// Bits of an axis and of points.
    type Manifold = (Vec<u32>, Vec<u32>);

    /// The bits of everything that parry computes of two boxes: the axis and the points, near enough or
    /// not.
    fn by_parry(b_in_a: &Pose, half_a: Vec3, half_b: Vec3) -> Option<Manifold> {
        let boxes = [half_a, half_b].map(|half| Cuboid::new(Vector::from_array(half)));
        let mut manifold = ContactManifold::<(), ()>::new();
        contact_manifold_cuboid_cuboid(b_in_a, &boxes[0], &boxes[1], MARGIN, &mut manifold);
        if manifold.points.is_empty() {
            return None;
        }
        let points = manifold.points.iter().filter(|point| point.dist <= MARGIN);
        let points = points.flat_map(|point| {
            let [a, b] = [point.local_p1, point.local_p2].map(|p| p.to_array());
            a.into_iter().chain(b).chain([point.dist]).map(f32::to_bits)
        });
        Some((manifold.local_n1.to_array().map(f32::to_bits).to_vec(), points.collect()))
    }

    /// The same by this module; `None` too where parry is to be asked.
    fn by_lanes(b_in_a: &Pose, half_a: Vec3, half_b: Vec3) -> (Touch, Option<Manifold>) {
        let mut points = Points::default();
        let touch = touch(b_in_a, half_a, half_b, &mut points);
        let Touch::Along(axis) = touch else { return (touch, None) };
        let mut bits = Vec::new();
        for (candidate, on_b) in points.candidates().iter().zip(points.on_b()) {
            let [on_b, ..] = in_b(b_in_a, [*on_b; 4]);
            let numbers = candidate.point.into_iter().chain(on_b).chain([candidate.distance]);
            bits.extend(numbers.map(f32::to_bits));
        }
        (touch, Some((axis.map(f32::to_bits).to_vec(), bits)))
    }

    /// How pairs lie: at random, stacked and tilted by little, turned about the vertical only, along the
    /// axes, and on edges.
    fn pair(random: &mut SplitMix64, kind: u32) -> (Pose, Vec3, Vec3) {
        let mut sign = || random.sign();
        let tilt = match kind {
            0 => 1.0,
            1 => 1e-3,
            _ => 0.0,
        };
        let q = match kind {
            0 | 1 => [sign() * tilt, sign() * tilt, sign() * tilt, 1.0],
            2 => [0.0, sign(), 0.0, 1.0],
            3 => [0.0, 0.0, 0.0, 1.0],
            _ => [sign(), 0.0, 1.0, 0.1 * sign()],
        };
        let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
        let half_a = [1.0, 1.0 + 0.5 * sign(), 1.0];
        let half_b = [1.0, 1.0, 1.0 + 0.5 * sign()];
        let above = half_a[1] + half_b[1] + 0.03 * sign();
        let translation = match kind {
            0 => [2.0 * sign(), 2.0 * sign(), 2.0 * sign()],
            // On the lattice of the thesis' scene, where ties are exact.
            3 => [1.0, half_a[1] + half_b[1], -1.2 * sign().signum()],
            _ => [1.5 * sign(), above, 1.5 * sign()],
        };
        let rotation = Quaternion::from_array(q.map(|value| value / length));
        (Pose::from_parts(Vector::from_array(translation), rotation), half_a, half_b)
    }

    #[test]
    fn not_a_bit_differs_from_what_parry_computes() {
        let mut random = SplitMix64::new(7);
        for kind in 0..5 {
            let (mut touching, mut apart, mut unknown) = (0, 0, 0);
            for _ in 0..4000 {
                let (b_in_a, half_a, half_b) = pair(&mut random, kind);
                let expected = by_parry(&b_in_a, half_a, half_b);
                let (touch, found) = by_lanes(&b_in_a, half_a, half_b);
                match touch {
                    Touch::Along(_) => {
                        touching += 1;
                        let points = found.as_ref().map_or(0, |(_, points)| points.len());
                        // parry has no axis where it has no point at all.
                        assert!(
                            found == expected || expected.is_none() && points == 0,
                            "{b_in_a:?}"
                        );
                    }
                    Touch::Apart => {
                        apart += 1;
                        assert_eq!(expected, None, "{b_in_a:?}");
                    }
                    Touch::Unknown => unknown += 1,
                }
            }
            assert!(touching > 800, "kind {kind}: {touching}, {apart}, {unknown}");
            assert!(unknown < 400, "kind {kind}: {touching}, {apart}, {unknown}");
        }
    }

    #[test]
    fn boxes_apart_along_two_normals_are_left_to_parry() {
        let pose = Pose::from_parts(Vector::new(2.005, 2.005, 0.0), Quaternion::IDENTITY);
        let mut points = Points::default();
        assert_eq!(touch(&pose, [1.0; 3], [1.0; 3], &mut points), Touch::Unknown);
    }
}
