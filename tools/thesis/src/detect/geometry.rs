//! The geometry of two cubes in f64, to find the causes of differences.

use scene::CUBE_HALF_EXTENT;
use zynq_pgs::Body;

/// A vector, m or without a unit.
pub(super) type Vector = [f64; 3];

/// Half the edge of a cube, m.
const HALF: f64 = CUBE_HALF_EXTENT as f64;

/// Angle up to which two directions are the same, degrees.
pub(super) const SAME_DIRECTION: f64 = 0.01;

/// A cube in the world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cube {
    centre: Vector,
    axes: [Vector; 3],
}

impl Cube {
    pub(super) fn of(body: &Body) -> Self {
        Self { centre: body.pose.position.map(f64::from), axes: scene::axes(body) }
    }

    /// How far it reaches from its centre along a direction.
    fn reach(&self, direction: Vector) -> f64 {
        self.axes.iter().map(|axis| HALF * dot(*axis, direction).abs()).sum()
    }

    /// Whether a direction is the normal of one of its faces.
    pub(super) fn has_face_across(&self, direction: Vector) -> bool {
        self.axes.iter().any(|axis| {
            let angle = angle(*axis, direction);
            angle.min(180.0 - angle) <= SAME_DIRECTION
        })
    }

    /// The axis and the sign of the face that looks along a direction.
    fn face(&self, direction: Vector) -> (usize, f64) {
        let along = self.axes.map(|axis| dot(axis, direction));
        let mut face = 0;
        for axis in 1..3 {
            if along[axis].abs() > along[face].abs() {
                face = axis;
            }
        }
        (face, if along[face] < 0.0 { -1.0 } else { 1.0 })
    }
}

/// The gap between two cubes along a unit vector that points from `b` to `a`; negative if they
/// overlap along it.
pub(super) fn separation(a: &Cube, b: &Cube, normal: Vector) -> f64 {
    dot(normal, minus(a.centre, b.centre)) - a.reach(normal) - b.reach(normal)
}

/// The largest gap between two cubes along the face normals of `of`.
pub(super) fn separation_by_faces(of: &Cube, a: &Cube, b: &Cube) -> f64 {
    let towards_a = |axis: Vector| {
        let is_turned = dot(axis, minus(a.centre, b.centre)) < 0.0;
        if is_turned { axis.map(|value| -value) } else { axis }
    };
    of.axes.map(|axis| separation(a, b, towards_a(axis))).into_iter().fold(f64::MIN, f64::max)
}

/// The corners of the face of `b` that looks along the normal, cut by the sides of the face of `a`
/// that looks against it.
pub(super) fn clipped(a: &Cube, b: &Cube, normal: Vector) -> Vec<Vector> {
    let (face, sign) = b.face(normal);
    let [first, second] = [(face + 1) % 3, (face + 2) % 3].map(|axis| b.axes[axis]);
    let corner = |u: f64, v: f64| {
        let along = |k: usize| sign * b.axes[face][k] + u * first[k] + v * second[k];
        [0, 1, 2].map(|k| b.centre[k] + HALF * along(k))
    };
    let mut corners =
        vec![corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
    let (face, _) = a.face(normal);
    for side in (0..3).filter(|side| *side != face) {
        for sign in [1.0, -1.0] {
            let outwards = a.axes[side].map(|value| sign * value);
            corners = cut(&corners, |point| dot(outwards, minus(point, a.centre)) - HALF);
        }
    }
    corners
}

/// The part of a polygon in which `outside` is not above 0.
fn cut(corners: &[Vector], outside: impl Fn(Vector) -> f64) -> Vec<Vector> {
    let mut kept = Vec::new();
    for (index, &corner) in corners.iter().enumerate() {
        let next = corners[(index + 1) % corners.len()];
        let (here, there) = (outside(corner), outside(next));
        if here <= 0.0 {
            kept.push(corner);
        }
        if (here <= 0.0) != (there <= 0.0) {
            let part = here / (here - there);
            kept.push([0, 1, 2].map(|k| corner[k] + part * (next[k] - corner[k])));
        }
    }
    kept
}

/// The angle between two directions, degrees.
pub(super) fn angle(a: Vector, b: Vector) -> f64 {
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    length(across).atan2(dot(a, b)).to_degrees()
}

/// The distance between two points, m.
pub(super) fn distance(a: Vector, b: Vector) -> f64 {
    length(minus(a, b))
}

fn length(vector: Vector) -> f64 {
    dot(vector, vector).sqrt()
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: Vector, b: Vector) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(centre: Vector) -> Cube {
        Cube { centre, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9, "{found}, expected {expected}");
    }

    #[test]
    fn a_gap_is_above_zero_and_an_overlap_below() {
        let down = [0.0, -1.0, 0.0];
        let lower = cube([0.0; 3]);
        near(separation(&lower, &cube([0.5, 2.25, 0.0]), down), 0.25);
        near(separation(&lower, &cube([0.5, 1.75, 0.0]), down), -0.25);
        let slanted = [0.0, -0.5_f64.sqrt(), -0.5_f64.sqrt()];
        near(separation(&lower, &cube([0.0, 2.0, 2.0]), slanted), 0.0);
        let upper = cube([0.5, 2.25, 0.0]);
        near(separation_by_faces(&lower, &lower, &upper), 0.25);
        near(separation_by_faces(&lower, &upper, &lower), 0.25);
    }

    #[test]
    fn a_face_is_cut_by_the_sides_of_the_other() {
        let found = clipped(&cube([0.0; 3]), &cube([0.5, 2.0, -0.25]), [0.0, -1.0, 0.0]);
        assert_eq!(found.len(), 4);
        for [x, y, z] in [[-0.5, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 0.75], [-0.5, 1.0, 0.75]]
        {
            assert!(found.iter().any(|point| distance(*point, [x, y, z]) < 1e-9), "{found:?}");
        }
        assert!(clipped(&cube([0.0; 3]), &cube([3.0, 2.0, 0.0]), [0.0, -1.0, 0.0]).is_empty());
    }

    #[test]
    fn a_face_has_two_normals() {
        let cube = cube([9.0; 3]);
        assert!(cube.has_face_across([0.0, -1.0, 1e-5]) && cube.has_face_across([1.0, 0.0, 0.0]));
        assert!(!cube.has_face_across([0.0, 1.0, 0.01]));
        near(angle([1.0, 0.0, 0.0], [1.0, 1.0, 0.0]), 45.0);
    }
}
