//! Finds the axis of the largest separation of two boxes: among the six face normals, and the nine
//! directions across an edge of each.

use super::super::lanes::{Mask, Numbers, Rotation, Vector};
use super::{Placed, Touch};

/// A separation, and its axis.
#[derive(Debug, Clone, Copy)]
struct Separation<N> {
    distance: N,
    direction: Vector<N>,
}

impl<N: Numbers> Separation<N> {
    fn none(any: N) -> Self {
        Self { distance: any.all(f32::MIN), direction: Vector::all(any, [0.0; 3]) }
    }

    /// The larger separation; the first one in a tie.
    #[inline(always)]
    fn keep_larger(&mut self, distance: N, direction: Vector<N>) {
        self.keep(distance.above(self.distance), distance, direction);
    }

    #[inline(always)]
    fn keep(&mut self, larger: N::Mask, distance: N, direction: Vector<N>) {
        self.distance = distance.or(larger, self.distance);
        self.direction = direction.or(larger, self.direction);
    }
}

/// The axis of the largest separation of B from A; in a tie the order is faces of A, of B, edges.
#[inline(always)]
pub(super) fn find<N: Numbers>(placed: &Placed<N>, margin: f32) -> Touch<N> {
    let Placed { half_a, half_b, b_in_a, a_in_b, translation } = *placed;
    let margin = translation.x.all(margin);
    let (of_a, unknown) = faces(half_a, half_b, b_in_a, translation);
    let apart = of_a.distance.above(margin).without(unknown);
    let back = a_in_b.turn(translation.negated());
    let (of_b, corner) = faces(half_b, half_a, a_in_b, back);
    let unknown = unknown.either(corner.without(apart));
    let apart = apart.either(of_b.distance.above(margin).without(unknown));
    let across = edges(placed);
    let apart = apart.either(across.distance.above(margin).without(unknown));

    let by_b = of_b.distance.above(of_a.distance).and(of_b.distance.above(across.distance));
    let by_edges = across.distance.above(of_a.distance);
    let axis = across.direction.or(by_edges, of_a.direction);
    let axis = b_in_a.turn(of_b.direction.negated()).or(by_b, axis);
    Touch { axis, apart, unknown }
}

/// The largest separation along the normals of one box; the other box is turned by `rotation` and
/// moved by `translation` in its frame. Also tells whether the boxes are apart along more than one
/// normal.
#[inline(always)]
fn faces<N: Numbers>(
    own: Vector<N>,
    other: Vector<N>,
    rotation: Rotation<N>,
    translation: Vector<N>,
) -> (Separation<N>, N::Mask) {
    let (zero, one) = (own.x.all(0.0), own.x.all(1.0));
    let signs = Vector { x: one, y: one, z: one }.with_signs(translation);
    let inverse = rotation.inverse();
    let mut best = Separation::none(zero);
    let mut once = zero.above(zero);
    let mut twice = once;
    // The normals that point to the other box.
    let normals = [
        Vector { x: signs.x, y: zero, z: zero },
        Vector { x: zero, y: signs.y, z: zero },
        Vector { x: zero, y: zero, z: signs.z },
    ];
    let (own, signs) = (own.parts(), signs.parts());
    for (k, outward) in normals.into_iter().enumerate() {
        let towards = inverse.turn(outward.negated());
        let nearest = rotation.turn(other.with_signs(towards)).plus(translation);
        let distance = nearest.parts()[k] * signs[k] - own[k];
        best.keep_larger(distance, outward);
        let apart = distance.at_least(zero);
        twice = twice.either(once.and(apart));
        once = once.either(apart);
    }
    (best, twice)
}

/// The largest separation along the directions across an edge of each.
#[inline(always)]
fn edges<N: Numbers>(placed: &Placed<N>) -> Separation<N> {
    let Placed { half_a, half_b, b_in_a, a_in_b, translation } = *placed;
    let (zero, one) = (half_a.x.all(0.0), half_a.x.all(1.0));
    let mut best = Separation::none(zero);
    for edge in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let Vector { x, y, z } = b_in_a.turn(Vector::all(zero, edge));
        let across = [
            Vector { x: zero, y: -z, z: y },
            Vector { x: z, y: zero, z: -x },
            Vector { x: -y, y: x, z: zero },
        ];
        for raw in across {
            let length = raw.dot(raw).sqrt();
            let unit = Vector { x: raw.x / length, y: raw.y / length, z: raw.z / length };
            let direction = unit.times(one.with_sign(translation.dot(unit)));
            let on_a = half_a.with_signs(direction);
            let towards = a_in_b.turn(direction.negated());
            let on_b = b_in_a.turn(half_b.with_signs(towards)).plus(translation);
            let distance = on_b.minus(on_a).dot(direction);
            // An edge that is parallel to an edge of A has no direction across it.
            let some = length.above(zero.all(f32::EPSILON));
            best.keep(distance.above(best.distance).and(some), distance, direction);
        }
    }
    best
}

/// Two unit vectors, orthogonal to a unit vector and to each other.
#[inline(always)]
pub(super) fn basis<N: Numbers>(direction: Vector<N>) -> [Vector<N>; 2] {
    let Vector { x, y, z } = direction;
    let one = x.all(1.0);
    let sign = one.with_sign(z);
    let a = x.all(-1.0) / (sign + z);
    let b = x * y * a;
    [
        Vector { x: one + sign * x * x * a, y: sign * b, z: -sign * x },
        Vector { x: b, y: sign + y * y * a, z: -y },
    ]
}

/// The axis of the largest component, the first one in a tie, and the component's sign.
#[derive(Clone, Copy)]
pub(super) struct Steepest<N: Numbers> {
    pub(super) along_x: N::Mask,
    pub(super) along_z: N::Mask,
    pub(super) sign: N,
}

#[inline(always)]
pub(super) fn steepest<N: Numbers>(direction: Vector<N>) -> Steepest<N> {
    let Vector { x, y, z } = direction;
    let by_y = y.abs().above(x.abs());
    let larger = y.or(by_y, x);
    let along_z = z.abs().above(larger.abs());
    let sign = x.all(1.0).with_sign(z.or(along_z, larger));
    let all = x.all(0.0).is(x.all(0.0));
    Steepest { along_x: all.without(by_y).without(along_z), along_z, sign }
}
