//! Finds the cause of each difference between two contacts of one pair.

use super::geometry::{
    Cube, SAME_DIRECTION, Vector, angle, clipped, distance, separation, separation_by_faces,
};

/// Distance up to which two points are the same, m.
pub(super) const SAME_POINT: f64 = 1e-3;

/// Difference up to which two cubes are equally far apart along two axes, m.
const SAME_SEPARATION: f64 = 1e-4;

/// Gap that rounding in the folder's numbers can make, m.
const ROUNDING: f64 = 1e-4;

/// Why two normals differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NormalCause {
    Same,
    Apart,
    Equal,
    Unknown,
}

impl NormalCause {
    pub(super) const ALL: [Self; 4] = [Self::Same, Self::Apart, Self::Equal, Self::Unknown];

    /// The cause of the difference between our normal and theirs. `cubes` are the folder's A and B;
    /// without them, one of the two bodies is the ground.
    pub(super) fn of(cubes: Option<&[Cube; 2]>, ours: Vector, theirs: Vector) -> Self {
        if angle(ours, theirs) <= SAME_DIRECTION {
            return Self::Same;
        }
        let Some([a, b]) = cubes else { return Self::Unknown };
        let [our_gap, their_gap] = [ours, theirs].map(|normal| separation(a, b, normal));
        let is_edge = !a.has_face_across(theirs) && !b.has_face_across(theirs);
        // Bullet's kernel gives up a pair that a face of A separates.
        let is_by_b_alone = b.has_face_across(ours) && separation_by_faces(a, a, b) <= ROUNDING;
        if (our_gap - their_gap).abs() <= SAME_SEPARATION {
            Self::Equal
        } else if our_gap > 0.0 && our_gap > their_gap && is_by_b_alone && is_edge {
            Self::Apart
        } else {
            Self::Unknown
        }
    }
}

/// The reason for which the folder has a point that we lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PointCause {
    Same,
    Choice,
    Clip,
    First,
    Normal,
    Unknown,
}

/// A collision of the folder beside ours of the same pair.
pub(super) struct Beside<'a> {
    /// Bodies A and B as the folder has them; none if one is the ground.
    pub(super) cubes: Option<[Cube; 2]>,
    /// The folder's normal, from B to A.
    pub(super) normal: Vector,
    pub(super) cause: NormalCause,
    /// Our points, on the folder's body B.
    pub(super) ours: &'a [Vector],
    /// All points among which ours were chosen.
    pub(super) all: &'a [Vector],
}

impl PointCause {
    pub(super) const ALL: [Self; 6] =
        [Self::Same, Self::Choice, Self::Clip, Self::First, Self::Normal, Self::Unknown];

    /// The cause of point `index` of the folder's collision.
    pub(super) fn of(beside: &Beside<'_>, index: usize, point: Vector) -> Self {
        let is_among = |points: &[Vector]| nearest(point, points) <= SAME_POINT;
        let is_clipped = || {
            let corners = beside.cubes.map(|[a, b]| clipped(&a, &b, beside.normal));
            corners.is_some_and(|corners| is_among(&corners))
        };
        if is_among(beside.ours) {
            Self::Same
        } else if is_among(beside.all) {
            Self::Choice
        } else if is_clipped() {
            Self::Clip
        } else if index == 0 {
            Self::First
        } else if beside.cause != NormalCause::Same {
            Self::Normal
        } else {
            Self::Unknown
        }
    }
}

/// The distance to the nearest of the points, m; infinite without points.
pub(super) fn nearest(point: Vector, points: &[Vector]) -> f64 {
    points.iter().map(|other| distance(point, *other)).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use scene::{Grid, Scene, SceneOptions};

    use super::*;

    /// A cube turned by `turn` radians about z, and a level one above it and beside.
    fn turned(turn: f32, height: f32) -> [Cube; 2] {
        let grid = Grid::new(1, 1, 1).expect("a grid");
        let scene = Scene::new(&SceneOptions { grid, ..Default::default() }).expect("a scene");
        let [mut lower, mut upper] = [scene.bodies()[1]; 2];
        lower.pose.position = [0.0; 3];
        lower.pose.orientation = [0.0, 0.0, (turn / 2.0).sin(), (turn / 2.0).cos()];
        upper.pose.position = [0.5, height, 0.0];
        [Cube::of(&lower), Cube::of(&upper)]
    }

    fn cubes(height: f32) -> [Cube; 2] {
        turned(0.0, height)
    }

    const DOWN: Vector = [0.0, -1.0, 0.0];

    #[test]
    fn normals_differ_by_bullets_missing_test_or_by_a_tie() {
        let of = |cubes: &[Cube; 2], theirs| NormalCause::of(Some(cubes), DOWN, theirs);
        let slanted = [0.05_f64.sin(), -(0.05_f64.cos()), 0.0];
        // The corner of A stands 1 cm below the face of B; no face of A separates the two.
        let corner = turned(0.1, 2.1048);
        assert_eq!(of(&corner, DOWN), NormalCause::Same);
        assert_eq!(of(&corner, slanted), NormalCause::Apart);
        // As above with the two exchanged: the face is A's.
        let [a, b] = corner;
        let up = NormalCause::of(Some(&[b, a]), [0.0, 1.0, 0.0], slanted.map(|value| -value));
        assert_eq!(up, NormalCause::Unknown);
        assert_eq!(of(&turned(0.1, 2.0), slanted), NormalCause::Unknown, "an overlap");

        // As deep along x as along y.
        let sideways = [-1.0, 0.0, 0.0];
        assert_eq!(of(&cubes(0.5), sideways), NormalCause::Equal);
        assert_eq!(of(&cubes(1.99), sideways), NormalCause::Unknown);
        assert_eq!(NormalCause::of(None, DOWN, slanted), NormalCause::Unknown, "the ground");
    }

    #[test]
    fn a_point_has_the_first_cause_that_holds() {
        let ours = [[-0.5, 1.0, 1.0], [1.0, 1.0, 1.0]];
        let all = [ours[0], ours[1], [0.2, 1.0, 1.0]];
        let mut beside = Beside {
            cubes: Some(cubes(1.99)),
            normal: DOWN,
            cause: NormalCause::Same,
            ours: &ours,
            all: &all,
        };
        let corner = [-0.5, 0.99, -1.0];
        let nowhere = [0.3, 0.9, 0.4];
        assert_eq!(PointCause::of(&beside, 2, [-0.5, 1.0, 1.0004]), PointCause::Same);
        assert_eq!(PointCause::of(&beside, 0, all[2]), PointCause::Choice);
        assert_eq!(PointCause::of(&beside, 0, corner), PointCause::Clip);
        assert_eq!(PointCause::of(&beside, 0, nowhere), PointCause::First);
        assert_eq!(PointCause::of(&beside, 1, nowhere), PointCause::Unknown);
        beside.cause = NormalCause::Apart;
        assert_eq!(PointCause::of(&beside, 1, nowhere), PointCause::Normal);
    }
}
