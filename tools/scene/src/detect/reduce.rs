//! Chooses four of many contact points, for one pair in each lane.
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

use zynq_pgs::CONTACT_POINTS;

use super::lanes::{Mask, Numbers, Vector};
use super::points::{Points, Slot};

/// Area below which two spans count as equal, m²: a hundred steps of an f32 at the size of a cube.
const NO_AREA: f32 = 1e-5;

/// The chosen points, in the order of choice; a pair has the points in which it is marked.
pub(super) type Chosen<N> = [Slot<N>; CONTACT_POINTS];

/// Chooses the points.
///
/// `normal` is the unit normal of the plane in which the points lie on A. Up to four points are all
/// kept, in their order.
#[inline(always)]
pub(super) fn reduce<N: Numbers>(points: &Points<N>, normal: Vector<N>) -> Chosen<N> {
    let (mut result, many) = points.first();
    if many.bits() != 0 {
        let chosen = choose(points.slots(), normal, many);
        for (result, chosen) in result.iter_mut().zip(chosen) {
            *result = chosen.or(many, result);
        }
    }
    result
}

/// Chooses four points of each pair in the mask, by the rule.
#[inline(always)]
fn choose<N: Numbers>(slots: &[Slot<N>], normal: Vector<N>, pairs: N::Mask) -> Chosen<N> {
    let (zero, one) = (normal.x.all(0.0), normal.x.all(1.0));
    let some = zero.all(NO_AREA);

    let (first, _) = largest(
        slots,
        pairs,
        zero,
        #[inline(always)]
        |slot| -slot.distance,
    );
    let at = first.on_a;
    let (second, length) = largest(
        slots,
        pairs,
        zero,
        #[inline(always)]
        |slot| squared(slot.on_a.minus(at)),
    );
    let pairs_of_two = pairs.without(zero.all(NO_AREA * NO_AREA).at_least(length));

    let (third, span) = largest(
        slots,
        pairs,
        zero,
        #[inline(always)]
        |slot| area(normal, first.on_a, second.on_a, slot.on_a).abs(),
    );
    let pairs_of_three = pairs_of_two.without(some.at_least(span));

    // Outside of an edge, the area has the opposite sign of the triangle's.
    let side = area(normal, first.on_a, second.on_a, third.on_a);
    let side = one.or(side.above(zero), -one);
    let (fourth, added) = largest(
        slots,
        pairs,
        zero,
        #[inline(always)]
        |slot| {
            // Outside of the edge from the first to the second, and so on.
            let most = -side * area(normal, first.on_a, second.on_a, slot.on_a);
            let other = -side * area(normal, second.on_a, third.on_a, slot.on_a);
            let most = other.or(other.above(most), most);
            let other = -side * area(normal, third.on_a, first.on_a, slot.on_a);
            other.or(other.above(most), most)
        },
    );
    let pairs_of_four = pairs_of_three.without(some.at_least(added));
    [
        Slot { taken: pairs, ..first },
        Slot { taken: pairs_of_two, ..second },
        Slot { taken: pairs_of_three, ..third },
        Slot { taken: pairs_of_four, ..fourth },
    ]
}

/// For each pair, the point of the largest measure and that measure; the first one in a tie.
#[inline(always)]
fn largest<N: Numbers>(
    slots: &[Slot<N>],
    pairs: N::Mask,
    zero: N,
    measure: impl Fn(&Slot<N>) -> N,
) -> (Slot<N>, N) {
    let nowhere = Vector::all(zero, [0.0; 3]);
    let mut best = Slot { taken: pairs, on_a: nowhere, on_b: nowhere, distance: zero };
    let mut most = zero.all(f32::NEG_INFINITY);
    for slot in slots {
        let value = measure(slot);
        let larger = value.above(most).and(slot.taken);
        best = slot.or(larger, &best);
        most = value.or(larger, most);
    }
    (best, most)
}

/// Twice the area of a triangle, with its sign as seen along the normal.
#[inline(always)]
fn area<N: Numbers>(normal: Vector<N>, a: Vector<N>, b: Vector<N>, c: Vector<N>) -> N {
    normal.dot(b.minus(a).cross(c.minus(a)))
}

#[inline(always)]
fn squared<N: Numbers>(a: Vector<N>) -> N {
    a.dot(a)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::MARGIN;
    use super::super::lanes::{Lanes, Portable, Row, Work, mask, run};
    use super::*;

    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    /// A point, and its distance from the other body.
    #[derive(Debug, Clone, Copy)]
    struct Candidate {
        point: [f32; 3],
        distance: f32,
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Candidate> {
        points.iter().map(|&[x, z]| Candidate { point: [x, 0.0, z], distance: 0.0 }).collect()
    }

    /// Chooses among the candidates of one lane, next to other lanes that must not affect it.
    struct Choose<'a>(&'a [Candidate], &'a mut Vec<Vec<usize>>);

    impl Work for Choose<'_> {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "small numbers"
        )]
        fn with<L: Lanes>(self, lanes: L) {
            let any = lanes.load(&Row::default());
            let mut points = Points::none(any);
            for own in 0..L::WIDTH {
                points.clear();
                for lane in 0..L::WIDTH {
                    // The other lanes have other points, and some have fewer.
                    let skipped = if lane == own { 0 } else { lane + 1 };
                    let candidates = self.0.iter().cycle().skip(skipped);
                    let count = self.0.len().saturating_sub(skipped / 2);
                    for (number, candidate) in candidates.take(count).enumerate() {
                        let on_b = [number as f32, 0.0, 0.0];
                        points.take(
                            mask(any, 1 << lane),
                            Vector::all(any, candidate.point),
                            Vector::all(any, on_b),
                            any.all(candidate.distance),
                        );
                    }
                }
                let chosen = reduce(&points, Vector::all(any, UP));
                let taken = |slot: &&Slot<L::Numbers>| slot.taken.bits() >> own & 1 != 0;
                let numbers = chosen
                    .iter()
                    .filter(taken)
                    .map(|slot| slot.on_b.x.row().0[own] as usize)
                    .collect();
                self.1.push(numbers);
            }
        }
    }

    /// Indices of the points chosen.
    fn chosen(points: &[Candidate]) -> Vec<usize> {
        assert!(points.iter().all(|point| point.distance <= MARGIN));
        let mut found = Vec::new();
        Portable.run(Choose(points, &mut found));
        run(Choose(points, &mut found));
        assert!(found.iter().all(|other| *other == found[0]), "{found:?}");
        found.swap_remove(0)
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
