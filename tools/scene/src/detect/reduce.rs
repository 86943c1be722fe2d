//! This file chooses four of many contact points.
//!
//! The rule, every tie going to the lowest index:
//! 1. the deepest point;
//! 2. the point farthest from the first;
//! 3. the point that spans the largest triangle with the first two;
//! 4. the point that adds the largest area to that triangle.
//!
//! A choice that would add nothing (a point that is there already, all points on a line) is not
//! made, so that the result may have fewer points. Every computation is f32 in the order written.

use zynq_pgs::CONTACT_POINTS;

/// A point as the choice sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Where it is; any frame, m.
    pub point: [f32; 3],
    /// Signed distance, m.
    pub distance: f32,
}

/// Area below which two spans count as the same, m²: a hundred steps of an f32 at the size of a
/// cube.
const NO_AREA: f32 = 1e-5;

/// Indices of the points chosen, in the order of the choice, and how many they are.
///
/// `normal` is the unit normal of the plane in which the points lie, in the frame of the points.
/// Up to four points are all kept, in their order.
pub(super) fn reduce(points: &[Candidate], normal: [f32; 3]) -> ([usize; CONTACT_POINTS], usize) {
    let mut chosen = [0; CONTACT_POINTS];
    if points.len() <= CONTACT_POINTS {
        for (index, slot) in chosen.iter_mut().enumerate() {
            *slot = index;
        }
        return (chosen, points.len());
    }

    let at = |index: usize| points[index].point;
    let (first, _) = largest(points, |c| -c.distance);
    chosen[0] = first;

    let (second, length) = largest(points, |c| squared(difference(c.point, at(first))));
    if length <= NO_AREA * NO_AREA {
        return (chosen, 1);
    }
    chosen[1] = second;

    let area = |a, b, c| dot(normal, cross(difference(b, a), difference(c, a)));
    let (third, span) = largest(points, |c| area(at(first), at(second), c.point).abs());
    if span <= NO_AREA {
        return (chosen, 2);
    }
    chosen[2] = third;

    // Outside of an edge the area has the opposite sign of the triangle's.
    let side = if area(at(first), at(second), at(third)) > 0.0 { 1.0 } else { -1.0 };
    let (fourth, added) = largest(points, |c| {
        let outside = |a, b| -side * area(at(a), at(b), c.point);
        let edges = [outside(first, second), outside(second, third), outside(third, first)];
        let [mut most, others @ ..] = edges;
        for other in others {
            if other > most {
                most = other;
            }
        }
        most
    });
    if added <= NO_AREA {
        return (chosen, 3);
    }
    chosen[3] = fourth;
    (chosen, 4)
}

/// Index of the largest measure and that measure; of equals the first.
fn largest(points: &[Candidate], measure: impl Fn(&Candidate) -> f32) -> (usize, f32) {
    let mut best = (0, f32::NEG_INFINITY);
    for (index, candidate) in points.iter().enumerate() {
        let value = measure(candidate);
        if value > best.1 {
            best = (index, value);
        }
    }
    best
}

fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn squared(a: [f32; 3]) -> f32 {
    dot(a, a)
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    fn flat(points: &[[f32; 2]]) -> Vec<Candidate> {
        points.iter().map(|&[x, z]| Candidate { point: [x, 0.0, z], distance: 0.0 }).collect()
    }

    #[test]
    fn four_points_stay_as_they_are() {
        let points = flat(&[[1.0, 1.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        assert_eq!(reduce(&points, UP), ([0, 1, 2, 3], 4));
        assert_eq!(reduce(&points[..2], UP).1, 2);
    }

    #[test]
    fn the_deepest_of_an_octagon_comes_first_then_its_opposite_and_both_sides() {
        let mut points = flat(&[
            [1.0, 0.4],
            [0.4, 1.0],
            [-0.4, 1.0],
            [-1.0, 0.4],
            [-1.0, -0.4],
            [-0.4, -1.0],
            [0.4, -1.0],
            [1.0, -0.4],
        ]);
        // All equally deep: the first, its opposite, and the two corners across.
        assert_eq!(reduce(&points, UP), ([0, 4, 2, 6], 4));
        points[3].distance = -0.01;
        assert_eq!(reduce(&points, UP).0[..2], [3, 7]);
    }

    #[test]
    fn a_corner_that_is_there_twice_is_taken_once() {
        let square = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let twice: Vec<[f32; 2]> = square.iter().chain(&square).copied().collect();
        let (chosen, count) = reduce(&flat(&twice), UP);
        assert_eq!((chosen, count), ([0, 2, 1, 3], 4));
    }

    #[test]
    fn points_on_a_line_leave_its_ends() {
        let points = flat(&[[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0], [0.4, 0.0]]);
        let (chosen, count) = reduce(&points, UP);
        assert_eq!((&chosen[..count], count), (&[0, 4][..], 2));
    }

    proptest! {
        #[test]
        fn the_choice_has_no_point_twice_and_holds_the_deepest(
            points in prop::collection::vec((-1.0_f32..1.0, -1.0_f32..1.0, -0.1_f32..0.02), 1..9)
        ) {
            let points: Vec<Candidate> = points
                .into_iter()
                .map(|(x, z, distance)| Candidate { point: [x, 0.0, z], distance })
                .collect();
            let (chosen, count) = reduce(&points, UP);
            let chosen = &chosen[..count];
            prop_assert!((1..=4).contains(&count));
            for (n, index) in chosen.iter().enumerate() {
                prop_assert!(*index < points.len());
                prop_assert!(!chosen[..n].contains(index));
            }
            let deepest = points.iter().map(|p| p.distance).fold(f32::INFINITY, f32::min);
            prop_assert!(chosen.iter().any(|&index| points[index].distance <= deepest));
        }
    }
}
