//! This file finds the points at which two faces touch: the corners of one within the other, and where
//! their edges cross, all seen along an axis.

use wide::f32x4;

use super::axis::{basis, steepest};
use super::lanes::{Four, Vec3, cross, dot, negate, subtract};
use super::{Placed, Points};

/// A number within so many steps of another is the same.
const SAME_STEPS: u32 = 4;
/// Share of a number that is more than those steps.
const NEARLY: f32 = 1e-5;

/// Four corners as they are seen along the axis.
#[derive(Clone, Copy)]
struct Seen {
    u: f32x4,
    v: f32x4,
}

impl Seen {
    #[inline]
    fn new(corners: Four, [u, v]: [Vec3; 2]) -> Self {
        Self { u: corners.dot(Four::splat(u)), v: corners.dot(Four::splat(v)) }
    }
}

/// The corners of the face of a box that looks in a direction, one after the other.
#[inline]
fn face(half_extents: Vec3, direction: Vec3) -> Four {
    let (axis, sign) = steepest(direction);
    let [x, y, z] = half_extents;
    let outer = |half: f32| f32x4::new([half, -half, -half, half]);
    let inner = |half: f32| f32x4::new([half, half, -half, -half]);
    match axis {
        0 => Four { x: f32x4::splat(x * sign), y: outer(y), z: inner(z) },
        1 => Four { x: outer(x), y: f32x4::splat(y * sign), z: inner(z) },
        _ => Four { x: inner(x), y: outer(y), z: f32x4::splat(z * sign) },
    }
}

/// Takes each point at which the faces of two boxes touch that look along `axis`, a unit vector
/// from A to B in the frame of A.
pub(super) fn points(placed: &Placed, axis: Vec3, points: &mut Points) {
    let basis = basis(axis);
    let along = Four::splat(axis);
    let of_a = face(placed.half_a, axis);
    let of_b = face(placed.half_b, placed.a_in_b.turn(negate(axis)));
    let of_b = placed.b_in_a.turn_four(of_b).plus(Four::splat(placed.translation));
    let (seen_a, seen_b) = (Seen::new(of_a, basis), Seen::new(of_b, basis));
    let (corners_a, corners_b) = (of_a.vectors(), of_b.vectors());

    // Corners of A, onto the face of B.
    let normal = normal(&corners_b);
    let slope = dot(normal, axis);
    if slope.abs() > f32::EPSILON {
        let to_face = Four::splat(corners_b[0]).minus(of_a).dot(Four::splat(normal));
        let distances = to_face / f32x4::splat(slope);
        let lanes = inside(seen_a, seen_b);
        if lanes != 0 {
            points.take_lanes(lanes, of_a, of_a.plus(along.times(distances)), distances);
        }
    }
    // Corners of B, onto the face of A.
    let normal = self::normal(&corners_a);
    let slope = -dot(normal, axis);
    if slope.abs() > f32::EPSILON {
        let to_face = Four::splat(corners_a[0]).minus(of_b).dot(Four::splat(normal));
        let distances = to_face / f32x4::splat(slope);
        let lanes = inside(seen_b, seen_a);
        if lanes != 0 {
            points.take_lanes(lanes, of_b.minus(along.times(distances)), of_b, distances);
        }
    }
    // Each edge of B with those of A.
    let next = next(of_a);
    let crossings = Crossings::new(seen_a);
    for (j, from) in corners_b.into_iter().enumerate() {
        let (lanes, s, t) = crossings.with(seen_b, j);
        if lanes != 0 {
            let one = f32x4::splat(1.0);
            let on_a = of_a.times(one - s).plus(next.times(s));
            let to = Four::splat(corners_b[(j + 1) % 4]);
            let on_b = Four::splat(from).times(one - t).plus(to.times(t));
            points.take_lanes(lanes, on_a, on_b, on_b.minus(on_a).dot(along));
        }
    }
}

/// Across a face.
#[inline]
fn normal(corners: &[Vec3; 4]) -> Vec3 {
    cross(subtract(corners[2], corners[1]), subtract(corners[0], corners[1]))
}

/// In each lane the next corner.
#[inline]
fn next(corners: Four) -> Four {
    Four { x: rotated(corners.x), y: rotated(corners.y), z: rotated(corners.z) }
}

#[inline]
fn rotated(lanes: f32x4) -> f32x4 {
    let [a, b, c, d] = lanes.to_array();
    f32x4::new([b, c, d, a])
}

/// Which of the points lie within the corners, or on their border, as bits.
#[inline]
fn inside(points: Seen, corners: Seen) -> u32 {
    let (us, vs) = (corners.u.to_array(), corners.v.to_array());
    // On which side of an edge a point lies.
    let side = |from: usize, to: usize| {
        let (du, dv) = (us[to] - us[from], vs[to] - vs[from]);
        f32x4::splat(du) * (points.v - f32x4::splat(vs[from]))
            - f32x4::splat(dv) * (points.u - f32x4::splat(us[from]))
    };
    let zero = f32x4::splat(0.0);
    let mut first = side(3, 0);
    let mut outside = zero;
    for edge in 0..3 {
        let other = side(edge, edge + 1);
        let on_edge = first.simd_eq(zero);
        outside |= !on_edge & (first * other).simd_lt(zero);
        first = on_edge.bitselect(other, first);
    }
    !outside.to_bitmask() & 0b1111
}

/// The edges of a face, for edges of another to cross them.
struct Crossings {
    from: Seen,
    direction: Seen,
    squared: f32x4,
}

impl Crossings {
    #[inline]
    fn new(from: Seen) -> Self {
        let direction = Seen { u: rotated(from.u) - from.u, v: rotated(from.v) - from.v };
        let squared = direction.u * direction.u + direction.v * direction.v;
        Self { from, direction, squared }
    }

    /// With an edge of other corners: which of the four cross it, as bits, and where on them and on it
    /// that is, as shares of their lengths.
    #[inline]
    fn with(&self, corners: Seen, edge: usize) -> (u32, f32x4, f32x4) {
        let (us, vs) = (corners.u.to_array(), corners.v.to_array());
        let to = (edge + 1) % 4;
        let (du, dv) = (us[to] - us[edge], vs[to] - vs[edge]);
        let squared = du * du + dv * dv;
        let zero = f32x4::splat(0.0);
        if squared <= f32::EPSILON {
            return (0, zero, zero);
        }
        let (du, dv) = (f32x4::splat(du), f32x4::splat(dv));
        let apart = Seen {
            u: self.from.u - f32x4::splat(us[edge]),
            v: self.from.v - f32x4::splat(vs[edge]),
        };
        let f = du * apart.u + dv * apart.v;
        let c = self.direction.u * apart.u + self.direction.v * apart.v;
        let b = self.direction.u * du + self.direction.v * dv;
        let e = f32x4::splat(squared);
        let (ae, bb) = (self.squared * e, b * b);
        let determinant = ae - bb;
        let s = (b * f - c * e) / determinant;
        let t = (b * s + f) / e;
        let (one, tiny) = (f32x4::splat(1.0), f32x4::splat(f32::EPSILON));
        let short = self.squared.simd_le(tiny) | determinant.simd_le(tiny);
        let within = |share: f32x4| share.simd_gt(zero) & share.simd_lt(one);
        let mut lanes = (!short & within(s) & within(t)).to_bitmask() & 0b1111;
        // Parallel, up to rounding, can only be what is nearly so.
        let nearly = determinant.simd_le(ae * f32x4::splat(NEARLY)).to_bitmask();
        if lanes & nearly != 0 {
            let (ae, bb) = (ae.to_array(), bb.to_array());
            for lane in 0..4 {
                // Neither number is negative.
                if ae[lane].to_bits().abs_diff(bb[lane].to_bits()) <= SAME_STEPS {
                    lanes &= !(1 << lane);
                }
            }
        }
        (lanes, s, t)
    }
}
