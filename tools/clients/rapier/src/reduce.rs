//! Chooses at most four points of a manifold.
//!
//! Rapier's manifolds have up to eight points, which a face that is turned against another gives.
//! Four of them, far from each other, hold the bodies as well.

use rapier3d::prelude::Vector;

/// A point of a manifold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// On the surface of the first body.
    pub(crate) place: Vector,
    /// Negative is penetration.
    pub(crate) distance: f32,
}

/// Reduces a manifold to at most four points: the deepest, the furthest from it, the furthest from
/// the line through both, and the furthest on the line's other side.
///
/// The nearest point of the first follows it, so that the first two lie at one edge of a face, and
/// the last two at the opposite edge.
pub(crate) fn reduced(mut points: Vec<Point>) -> Vec<Point> {
    if points.len() > 4 {
        let first = take(&mut points, |point| -point.distance);
        let second = take(&mut points, |point| (point.place - first.place).length_squared());
        let line = second.place - first.place;
        let off = |point: &Point| line.cross(point.place - first.place);
        let third = take(&mut points, |point| off(point).length_squared());
        let side = off(&third);
        let fourth = take(&mut points, |point| -side.dot(off(point)));
        points = vec![first, second, third, fourth];
    }
    if let [first, rest @ ..] = &mut points[..] {
        let away = |point: &Point| (point.place - first.place).length_squared();
        let nearest = (0..rest.len()).min_by(|a, b| away(&rest[*a]).total_cmp(&away(&rest[*b])));
        if let Some(nearest) = nearest {
            rest.swap(0, nearest);
        }
    }
    points
}

/// Takes the point of the largest value out of a list that has one.
fn take(points: &mut Vec<Point>, value: impl Fn(&Point) -> f32) -> Point {
    let largest = (0..points.len())
        .max_by(|a, b| value(&points[*a]).total_cmp(&value(&points[*b])))
        .unwrap_or_default();
    points.swap_remove(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, z: f32, distance: f32) -> Point {
        Point { place: Vector::new(x, 0.0, z), distance }
    }

    #[test]
    fn an_octagon_becomes_a_square_around_its_deepest_point() {
        // A corner cut off at each end of the edges; the point at (-1, -2) is the deepest.
        let cut = [
            (-1.0, -2.0),
            (1.0, -2.0),
            (2.0, -1.0),
            (2.0, 1.0),
            (1.0, 2.0),
            (-1.0, 2.0),
            (-2.0, 1.0),
            (-2.0, -1.0),
        ];
        let points: Vec<_> = cut
            .iter()
            .enumerate()
            .map(|(index, (x, z))| at(*x, *z, if index == 0 { -0.2 } else { -0.1 }))
            .collect();
        let reduced = reduced(points);
        assert_eq!(reduced.len(), 4);
        assert_eq!(reduced[0], at(-1.0, -2.0, -0.2));
        let has = |x, z| reduced.iter().any(|point| point.place == Vector::new(x, 0.0, z));
        assert!(has(1.0, 2.0), "the opposite one: {reduced:?}");
        assert!(has(2.0, -1.0) && has(-2.0, 1.0), "one on either side: {reduced:?}");
    }

    #[test]
    fn two_points_that_follow_each_other_lie_at_one_edge() {
        let square =
            vec![at(0.0, 0.0, 0.0), at(1.0, 1.0, 0.0), at(0.0, 0.9, 0.0), at(1.0, 0.0, 0.0)];
        let places =
            reduced(square).iter().map(|point| [point.place.x, point.place.z]).collect::<Vec<_>>();
        assert_eq!(places, [[0.0, 0.0], [0.0, 0.9], [1.0, 1.0], [1.0, 0.0]]);
        assert_eq!(reduced(Vec::new()), []);
        assert_eq!(reduced(vec![at(1.0, 1.0, 0.0)]), [at(1.0, 1.0, 0.0)]);
    }
}
