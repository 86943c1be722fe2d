//! Finds the contact points of two faces: the corners of one inside the other, and the crossings of
//! their edges, all projected along an axis.

use super::super::lanes::{Mask, Numbers, Vector, mask};
use super::super::points::Points;
use super::Placed;
use super::axis::{Steepest, basis, steepest};

/// Numbers within this many representable steps are equal.
const SAME_STEPS: u32 = 4;
/// A relative difference larger than these steps.
const NEARLY: f32 = 1e-5;

/// The four corners of a face, in order around it.
type Corners<N> = [Vector<N>; 4];

/// A corner, projected along the axis.
#[derive(Clone, Copy)]
struct Seen<N> {
    u: N,
    v: N,
}

impl<N: Numbers> Seen<N> {
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self { u: self.u - other.u, v: self.v - other.v }
    }

    #[inline(always)]
    fn dot(self, other: Self) -> N {
        self.u * other.u + self.v * other.v
    }
}

#[inline(always)]
fn see<N: Numbers>(corners: &Corners<N>, [u, v]: [Vector<N>; 2]) -> [Seen<N>; 4] {
    let [a, b, c, d] = *corners;
    let us = [a.dot(u), b.dot(u), c.dot(u), d.dot(u)];
    let vs = [a.dot(v), b.dot(v), c.dot(v), d.dot(v)];
    [
        Seen { u: us[0], v: vs[0] },
        Seen { u: us[1], v: vs[1] },
        Seen { u: us[2], v: vs[2] },
        Seen { u: us[3], v: vs[3] },
    ]
}

/// The corners of the box's face that points in a direction.
#[inline(always)]
fn face<N: Numbers>(half: Vector<N>, direction: Vector<N>) -> Corners<N> {
    let at = steepest(direction);
    let fixed = half.times(at.sign);
    let (plus, minus) = (half, half.negated());
    [
        corner(&at, fixed, plus, plus),
        corner(&at, fixed, minus, plus),
        corner(&at, fixed, minus, minus),
        corner(&at, fixed, plus, minus),
    ]
}

/// A corner of a face: along x the corners go round by y and then z, along y by x and z, along z by
/// y and x.
#[inline(always)]
fn corner<N: Numbers>(
    at: &Steepest<N>,
    fixed: Vector<N>,
    outer: Vector<N>,
    inner: Vector<N>,
) -> Vector<N> {
    let along_z = Vector { x: inner.x, y: outer.y, z: fixed.z };
    let along_y = Vector { x: outer.x, y: fixed.y, z: inner.z };
    let along_x = Vector { x: fixed.x, y: outer.y, z: inner.z };
    along_x.or(at.along_x, along_z.or(at.along_z, along_y))
}

/// Collects the contact points of the two faces that point along `axis`, a unit vector from A to B
/// in the frame of A, for the pairs in the mask.
#[inline(always)]
pub(super) fn points<N: Numbers>(
    placed: &Placed<N>,
    axis: Vector<N>,
    pairs: N::Mask,
    points: &mut Points<N>,
) {
    let basis = basis(axis);
    let of_a = face(placed.half_a, axis);
    let mut of_b = face(placed.half_b, placed.a_in_b.turn(axis.negated()));
    for corner in &mut of_b {
        *corner = placed.b_in_a.turn(*corner).plus(placed.translation);
    }
    let (seen_a, seen_b) = (see(&of_a, basis), see(&of_b, basis));
    let epsilon = axis.x.all(f32::EPSILON);

    // Projects corners of A onto the face of B.
    let normal = normal(&of_b);
    let slope = normal.dot(axis);
    let some = slope.abs().above(epsilon).and(pairs);
    if some.bits() != 0 {
        for (corner, seen) in of_a.into_iter().zip(seen_a) {
            let distance = of_b[0].minus(corner).dot(normal) / slope;
            let on_b = corner.plus(axis.times(distance));
            points.take(some.without(outside(seen, &seen_b)), corner, on_b, distance);
        }
    }
    // Projects corners of B onto the face of A.
    let normal = self::normal(&of_a);
    let slope = -normal.dot(axis);
    let some = slope.abs().above(epsilon).and(pairs);
    if some.bits() != 0 {
        for (corner, seen) in of_b.into_iter().zip(seen_b) {
            let distance = of_a[0].minus(corner).dot(normal) / slope;
            let on_a = corner.minus(axis.times(distance));
            points.take(some.without(outside(seen, &seen_a)), on_a, corner, distance);
        }
    }
    cross(&of_a, &of_b, [&seen_a, &seen_b], axis, pairs, points);
}

/// The normal of a face.
#[inline(always)]
fn normal<N: Numbers>(corners: &Corners<N>) -> Vector<N> {
    corners[2].minus(corners[1]).cross(corners[0].minus(corners[1]))
}

/// The side of an edge on which a point lies.
#[inline(always)]
fn side<N: Numbers>(point: Seen<N>, from: Seen<N>, to: Seen<N>) -> N {
    let (edge, way) = (to.minus(from), point.minus(from));
    edge.u * way.v - edge.v * way.u
}

/// Whether a point lies outside of the corners; points on the border do not.
#[inline(always)]
fn outside<N: Numbers>(point: Seen<N>, corners: &[Seen<N>; 4]) -> N::Mask {
    let zero = point.u.all(0.0);
    let mut first = side(point, corners[3], corners[0]);
    let mut outside = zero.above(zero);
    for edge in 0..3 {
        let other = side(point, corners[edge], corners[edge + 1]);
        let on_edge = first.is(zero);
        outside = outside.either(zero.above(first * other).without(on_edge));
        first = other.or(on_edge, first);
    }
    outside
}

/// Collects the crossings of each edge of B with the edges of A.
#[inline(always)]
fn cross<N: Numbers>(
    of_a: &Corners<N>,
    of_b: &Corners<N>,
    [seen_a, seen_b]: [&[Seen<N>; 4]; 2],
    axis: Vector<N>,
    pairs: N::Mask,
    points: &mut Points<N>,
) {
    let (zero, one) = (axis.x.all(0.0), axis.x.all(1.0));
    let tiny = axis.x.all(f32::EPSILON);
    for j in 0..4 {
        let (from, to) = (of_b[j], of_b[(j + 1) % 4]);
        let edge = seen_b[(j + 1) % 4].minus(seen_b[j]);
        let e = edge.dot(edge);
        for i in 0..4 {
            let direction = seen_a[(i + 1) % 4].minus(seen_a[i]);
            let squared = direction.dot(direction);
            let apart = seen_a[i].minus(seen_b[j]);
            let (f, c, b) = (edge.dot(apart), direction.dot(apart), direction.dot(edge));
            let (ae, bb) = (squared * e, b * b);
            let determinant = ae - bb;
            let s = (b * f - c * e) / determinant;
            let t = (b * s + f) / e;
            let within_a = s.above(zero).and(one.above(s));
            let within_b = t.above(zero).and(one.above(t));
            let short =
                tiny.at_least(e).either(tiny.at_least(squared)).either(tiny.at_least(determinant));
            let mut crossing = within_a.and(within_b).and(pairs).without(short);
            if crossing.bits() == 0 {
                continue;
            }
            // Only nearly parallel edges can be parallel up to rounding.
            let nearly = (ae * ae.all(NEARLY)).at_least(determinant).and(crossing);
            if nearly.bits() != 0 {
                crossing = crossing.without(same(ae, bb));
            }
            let on_a = of_a[i].times(one - s).plus(of_a[(i + 1) % 4].times(s));
            let on_b = from.times(one - t).plus(to.times(t));
            points.take(crossing, on_a, on_b, on_b.minus(on_a).dot(axis));
        }
    }
}

/// Whether two numbers, neither negative, are at most a few steps apart.
// Rarely needed.
#[inline(never)]
fn same<N: Numbers>(a: N, b: N) -> N::Mask {
    let steps =
        a.row().0.into_iter().zip(b.row().0).map(|(a, b)| a.to_bits().abs_diff(b.to_bits()));
    let bits = steps.enumerate().fold(0, |bits, (lane, steps)| match steps <= SAME_STEPS {
        true => bits | 1 << lane,
        false => bits,
    });
    mask(a, bits)
}
