//! This file finds the axis along which two boxes are farthest apart: the six normals of their faces,
//! and the nine directions across an edge of each.

use wide::f32x4;

use super::Placed;
use super::lanes::{Four, Rotation, Vec3, negate, with_sign};

/// Where two boxes are farthest apart.
#[derive(Debug, Clone, Copy)]
struct Separation {
    distance: f32,
    direction: Vec3,
}

impl Separation {
    const NONE: Self = Self { distance: f32::MIN, direction: [0.0; 3] };

    /// The farther one; of equals the first.
    #[inline]
    fn keep_larger(&mut self, distance: f32, direction: Vec3) {
        if distance > self.distance {
            *self = Self { distance, direction };
        }
    }
}

/// What the search comes to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Found {
    /// They are farther apart than the margin.
    Apart,
    /// The unit vector of that axis, from A to B, in the frame of A.
    Axis(Vec3),
    /// They are apart along two normals of one box at once.
    Corner,
}

/// The axis of the largest separation of B from A; in a tie the order is faces of A, of B, edges.
pub(super) fn find(placed: &Placed, margin: f32) -> Found {
    let Placed { half_a, half_b, b_in_a, a_in_b, translation } = *placed;
    let Some(of_a) = faces(half_a, half_b, b_in_a, translation) else { return Found::Corner };
    if of_a.distance > margin {
        return Found::Apart;
    }
    let back = a_in_b.turn(negate(translation));
    let Some(of_b) = faces(half_b, half_a, a_in_b, back) else { return Found::Corner };
    if of_b.distance > margin {
        return Found::Apart;
    }
    let across = edges(placed);
    if across.distance > margin {
        return Found::Apart;
    }
    if of_b.distance > of_a.distance && of_b.distance > across.distance {
        Found::Axis(b_in_a.turn(negate(of_b.direction)))
    } else if across.distance > of_a.distance {
        Found::Axis(across.direction)
    } else {
        Found::Axis(of_a.direction)
    }
}

/// Along the normals of one box; the other is turned by `rotation` and moved by `translation` in its
/// frame. `None` if they are apart along more than one.
#[inline]
fn faces(own: Vec3, other: Vec3, rotation: Rotation, translation: Vec3) -> Option<Separation> {
    let [x, y, z] = translation.map(|along| 1.0_f32.copysign(along));
    // The normals that look at the other box, the last one twice.
    let normals = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
    let outward = Four::new([normals[0], normals[1], normals[2], normals[2]]);
    let towards = rotation.inverse().turn_four(outward.negated());
    let nearest = rotation.turn_four(Four::corners_of(other, towards));
    let nearest = nearest.plus(Four::splat(translation)).vectors();
    let mut best = Separation::NONE;
    let mut apart = 0;
    for (k, sign) in [x, y, z].into_iter().enumerate() {
        let distance = nearest[k][k] * sign - own[k];
        best.keep_larger(distance, normals[k]);
        apart += u32::from(distance >= 0.0);
    }
    if apart > 1 { None } else { Some(best) }
}

/// Along the directions that are across an edge of each.
#[inline]
fn edges(placed: &Placed) -> Separation {
    let Placed { half_a, half_b, b_in_a, a_in_b, translation } = *placed;
    let mut best = Separation::NONE;
    let t = Four::splat(translation);
    for edge in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let [x, y, z] = b_in_a.turn(edge);
        // Across x, y and z of A, the last one twice.
        let raw = Four {
            x: f32x4::new([0.0, z, -y, -y]),
            y: f32x4::new([-z, 0.0, x, x]),
            z: f32x4::new([y, -x, 0.0, 0.0]),
        };
        let length = raw.dot(raw).sqrt();
        let unit = Four { x: raw.x / length, y: raw.y / length, z: raw.z / length };
        let direction = unit.times(with_sign(f32x4::splat(1.0), t.dot(unit)));
        let on_a = Four::corners_of(half_a, direction);
        let towards = a_in_b.turn_four(direction.negated());
        let on_b = b_in_a.turn_four(Four::corners_of(half_b, towards)).plus(t);
        let distances = on_b.minus(on_a).dot(direction).to_array();
        // What is parallel to an edge of A has no direction across it.
        let lengths = length.to_array();
        for (lane, direction) in direction.vectors().into_iter().enumerate().take(3) {
            if lengths[lane] > f32::EPSILON {
                best.keep_larger(distances[lane], direction);
            }
        }
    }
    best
}

/// Two unit vectors across a unit vector and each other.
pub(super) fn basis([x, y, z]: Vec3) -> [Vec3; 2] {
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// Index of the largest magnitude, of equals the first, and the sign there.
pub(super) fn steepest(direction: Vec3) -> (usize, f32) {
    let mut at = 0;
    for k in 1..3 {
        if direction[k].abs() > direction[at].abs() {
            at = k;
        }
    }
    (at, 1.0_f32.copysign(direction[at]))
}
