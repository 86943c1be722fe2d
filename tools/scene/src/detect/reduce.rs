//! Chooses four of many contact points.
//!
//! The rule, every tie going to the lowest index:
//!
//! 1. the deepest point;
//! 2. the point farthest from the first;
//! 3. the point that spans the largest triangle with the first two;
//! 4. the point that adds the largest area to that triangle.
//!
//! A choice that adds nothing (a repeated point, or all points on a line) is not made, so that the
//! result may have fewer points. Every computation is f32 in the order written.

use parry3d::math::Vector;
use zynq_pgs::Contact;
use zynq_pgs::scene::CONTACT_POINTS;

use super::parry::Place;

/// Area below which two spans count as equal, m²: a hundred steps of an f32 at the size of a cube.
const NO_AREA: f32 = 1e-5;

/// Chooses the points, in the frame of B, and returns their number, too.
///
/// `normal` is the unit normal of the plane in which the points lie on A. Up to four points are all
/// kept, in their order.
pub(super) fn reduce(places: &[Place], normal: Vector) -> ([Contact; CONTACT_POINTS], usize) {
    let mut chosen = [Contact::default(); CONTACT_POINTS];
    if places.len() <= CONTACT_POINTS {
        for (contact, place) in chosen.iter_mut().zip(places) {
            *contact = place.contact();
        }
        return (chosen, places.len());
    }
    // Twice the area of a triangle, with its sign as seen along the normal.
    let area = |a: Vector, b: Vector, c: Vector| normal.dot((b - a).cross(c - a));

    let (first, _) = largest(places, |place| -place.distance);
    let a = first.on_a;
    let (second, length) = largest(places, |place| (place.on_a - a).length_squared());
    let b = second.on_a;
    let (third, span) = largest(places, |place| area(a, b, place.on_a).abs());
    let c = third.on_a;
    // Outside of an edge, the area has the opposite sign of the triangle's.
    let side = if area(a, b, c) > 0.0 { 1.0 } else { -1.0 };
    let (fourth, added) = largest(places, |place| {
        let outside = [(a, b), (b, c), (c, a)].map(|(a, b)| -side * area(a, b, place.on_a));
        let [most, second, third] = outside;
        let most = if second > most { second } else { most };
        if third > most { third } else { most }
    });
    chosen = [first, second, third, fourth].map(Place::contact);
    let adds = [length > NO_AREA * NO_AREA, span > NO_AREA, added > NO_AREA];
    let count = 1 + adds.iter().take_while(|adds| **adds).count();
    (chosen, count)
}

/// The point of the largest measure and that measure; the first one in a tie.
fn largest(places: &[Place], measure: impl Fn(&Place) -> f32) -> (&Place, f32) {
    let mut best = (&places[0], f32::NEG_INFINITY);
    for place in places {
        let value = measure(place);
        if value > best.1 {
            best = (place, value);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::MARGIN;
    use super::*;

    /// A point, and its distance from the other body.
    #[derive(Debug, Clone, Copy)]
    struct Candidate {
        point: [f32; 3],
        distance: f32,
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Candidate> {
        points.iter().map(|&[x, z]| Candidate { point: [x, 0.0, z], distance: 0.0 }).collect()
    }

    /// Indices of the points chosen.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "small numbers"
    )]
    fn chosen(points: &[Candidate]) -> Vec<usize> {
        assert!(points.iter().all(|point| point.distance <= MARGIN));
        let place = |(number, candidate): (usize, &Candidate)| Place {
            on_a: Vector::from_array(candidate.point),
            on_b: Vector::new(number as f32, 0.0, 0.0),
            distance: candidate.distance,
        };
        let places: Vec<Place> = points.iter().enumerate().map(place).collect();
        let (chosen, count) = reduce(&places, Vector::Y);
        chosen[..count].iter().map(|contact| contact.point[0] as usize).collect()
    }

    #[test]
    fn four_points_stay_as_they_are() {
        let points = flat(&[[1.0, 1.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        assert_eq!(chosen(&points), [0, 1, 2, 3]);
        assert_eq!(chosen(&points[..2]), [0, 1]);
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
        assert_eq!(chosen(&points), [0, 4, 2, 6]);
        points[3].distance = -0.01;
        assert_eq!(chosen(&points)[..2], [3, 7]);
    }

    #[test]
    fn a_corner_that_is_there_twice_is_taken_once() {
        let square = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let twice: Vec<[f32; 2]> = square.iter().chain(&square).copied().collect();
        assert_eq!(chosen(&flat(&twice)), [0, 2, 1, 3]);
    }

    #[test]
    fn points_on_a_line_leave_its_ends() {
        let points = flat(&[[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0], [0.4, 0.0]]);
        assert_eq!(chosen(&points), [0, 4]);
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
            let chosen = chosen(&points);
            prop_assert!((1..=4).contains(&chosen.len()));
            for (n, index) in chosen.iter().enumerate() {
                prop_assert!(*index < points.len());
                prop_assert!(!chosen[..n].contains(index));
            }
            let deepest = points.iter().map(|p| p.distance).fold(f32::INFINITY, f32::min);
            prop_assert!(chosen.iter().any(|&index| points[index].distance <= deepest));
        }
    }
}
