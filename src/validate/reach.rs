//! Checks the constraint rows of many collisions against binary16's range at once, where
//! [`rows`](super::rows) checks one collision.

use pgs_interface::record::{CONTACT_POINTS, LANES};

use super::rows::{LARGEST, LONGEST_ARM, LOSS};
use crate::record::largest::MAGNITUDE;
use crate::record::used;
use crate::scene::Shape;
use crate::simd::Lanes;

/// The places of a collision's bodies and contact points, as they are streamed.
#[derive(Clone, Copy)]
pub(crate) struct Locations {
    /// Positions of bodies A and B, m. The word beside each has no meaning.
    pub(crate) positions: [Lanes; 2],
    /// Contact points beside their distances, m. An unused point may hold anything.
    pub(crate) points: [Lanes; CONTACT_POINTS],
    /// Sums by component: the magnitudes of both positions and of the contact points in use, and
    /// beside them the magnitudes of the distances. A sum is at least as large as each term, and
    /// infinite or NaN if a term is. One bound on the sum costs less than a bound on each term, but
    /// accepts less: records some kilometres from the origin are checked again.
    pub(crate) sum: Lanes,
}

/// Upper bounds on the distances of a collision's contact points in use.
///
/// A component that is longer is no shorter after any of the roundings, so a collision that fits
/// here fits with each point by itself. The code handles whole rows without a branch, and drops the
/// word beside a vec3 at the end. A NaN may give any result here: the bound on numbers refuses it.
pub(crate) struct Reach {
    /// Lever arms about bodies A and B, m, without the loss at their two ends.
    arms: [Lanes; 2],
    /// The [sum](Locations::sum) of the locations. It bounds each arm, each end of an arm, and the
    /// sum of the points.
    sum: Lanes,
}

impl Reach {
    /// The reach at these locations. The first `count` points are in use.
    #[inline(always)]
    pub(crate) fn new(locations: &Locations, count: u32) -> Self {
        let [first, rest @ ..] = locations.points;
        let [any, used @ ..] = used(count);
        let (mut least, mut most) = (first, first);
        for (point, used) in rest.into_iter().zip(used) {
            // The first point replaces an unused one.
            let point = point.and(used).or(first.without(used));
            least = least.smaller_f32(point);
            most = most.larger_f32(point);
        }
        // The larger difference is not negative, as `most` is at least `least`.
        let arm = |at: Lanes| most.minus_f32(at).larger_f32(at.minus_f32(least)).and(any);
        let [a, b] = locations.positions;
        Self { arms: [arm(a), arm(b)], sum: locations.sum }
    }
}

/// An arm plus the loss at both of its ends, m.
#[inline(always)]
fn with_loss(arm: Lanes, sum: Lanes) -> Lanes {
    arm.plus_f32(sum.times_f32(Lanes::all(LOSS.to_bits())))
}

/// The limit of the sum, as a share of the longest arm. It leaves room for the loss at an arm's
/// ends and for the roundings.
const SHARE: f32 = 0.99;
const _: () = assert!(SHARE * (1.0 + LOSS) < 0.999, "what is lost belongs to an arm");
const _: () =
    assert!(SHARE * LONGEST_ARM < 0.999 * LARGEST, "so that it bounds the sum of the points, too");

/// Whether arms and sums of contact points are in range, for any masses.
#[inline(always)]
fn near(sum: Lanes) -> bool {
    let limit = (SHARE * LONGEST_ARM).to_bits();
    sum.above(Lanes::new([limit, limit, limit, MAGNITUDE])).words() == [0; LANES]
}

/// The square of the length of a vec3.
#[inline(always)]
fn square(arm: Lanes) -> f32 {
    let [x, y, z, _] = arm.times_f32(arm).words().map(f32::from_bits);
    x + y + z
}

/// Whether a bitstream that computes rows in binary16 surely computes the rows of a collision. Its
/// bodies have these shapes, and its numbers are in range.
#[inline]
pub(crate) fn surely_fit(reach: &Reach, shapes: [&Shape; 2]) -> bool {
    let [a, b] = shapes;
    let mass = a.inverse_mass + b.inverse_mass;
    let mut turning = [0.0; 2];
    for ((turning, shape), arm) in turning.iter_mut().zip(shapes).zip(reach.arms) {
        *turning = largest_inertia(shape) * square(with_loss(arm, reach.sum));
    }
    near(reach.sum) & (mass >= 1.0 / LARGEST) & (mass + turning[0] + turning[1] <= LARGEST)
}

/// The furthest reach of several collisions.
#[derive(Clone, Copy)]
pub(crate) struct Furthest {
    /// The longest arms about moving bodies.
    turning: Lanes,
    sum: Lanes,
}

impl Furthest {
    /// The reach of no collision.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        let none = Lanes::all(0);
        Self { turning: none, sum: none }
    }

    /// Takes one more collision. A static body has all bits of its `still`.
    #[inline(always)]
    pub(crate) fn take(&mut self, reach: &Reach, still: [Lanes; 2]) {
        let [a, b] = reach.arms;
        let [still_a, still_b] = still;
        let turning = a.without(still_a).larger_f32(b.without(still_b));
        self.turning = self.turning.larger_f32(turning);
        self.sum = self.sum.larger_f32(reach.sum);
    }

    /// Whether a bitstream that computes rows in binary16 surely computes the rows of all
    /// collisions. Each body has any of these shapes, and no collision has two static bodies.
    /// `false` if the shapes do not [allow](Extremes::allow) a common bound.
    #[inline(always)]
    pub(crate) fn all_surely_fit(&self, shapes: &Extremes) -> bool {
        let turning = shapes.inertia * square(with_loss(self.turning, self.sum));
        near(self.sum) & shapes.allow() & (shapes.mass + turning + turning <= LARGEST)
    }
}

/// Extreme values of two bodies with shapes from a table.
#[derive(Debug)]
pub(crate) struct Extremes {
    /// The smallest and the largest sum of two bodies' inverse masses, 1/kg.
    smallest_mass: f32,
    mass: f32,
    /// The largest component of an inverse inertia, 1/(kg m²).
    inertia: f32,
}

impl Extremes {
    /// The extremes of these shapes.
    pub(crate) fn new(shapes: &[Shape]) -> Self {
        let moving = shapes.iter().filter(|shape| !shape.is_static());
        let start = Self { smallest_mass: f32::INFINITY, mass: 0.0, inertia: 0.0 };
        moving.fold(start, |all, shape| Self {
            smallest_mass: all.smallest_mass.min(shape.inverse_mass),
            mass: all.mass.max(shape.inverse_mass + shape.inverse_mass),
            inertia: all.inertia.max(largest_inertia(shape)),
        })
    }

    /// Whether the masses let all rows fit, however short the lever arms are.
    #[inline(always)]
    pub(crate) fn allow(&self) -> bool {
        (self.smallest_mass >= 1.0 / LARGEST) & (self.mass <= LARGEST)
    }
}

#[inline(always)]
fn largest_inertia(shape: &Shape) -> f32 {
    let [x, y, z] = shape.inverse_inertia;
    larger(larger(x, y), z)
}

#[inline(always)]
fn larger(one: f32, other: f32) -> f32 {
    if one > other { one } else { other }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::rows::Rows;
    use super::*;
    use crate::scene::{Collision, Contact};
    use pgs_interface::profile::HALF;

    const GROUND: Shape = Shape::STATIC;
    const CUBE: Shape = Shape::isotropic(1.0, 1.5);
    const PEBBLE: Shape = Shape::isotropic(8_000.0, 30_000.0);
    const POINT_MASS: Shape = Shape::isotropic(1.0, 0.0);

    /// A collision, the positions of its bodies, and the indices of their shapes.
    #[derive(Debug, Clone)]
    struct One {
        collision: Collision,
        positions: [[f32; 3]; 2],
        shapes: [usize; 2],
    }

    impl One {
        fn reach(&self) -> Reach {
            let row = |[x, y, z]: [f32; 3], w: f32| Lanes::new([x, y, z, w].map(f32::to_bits));
            // The word beside a vec3 may be anything.
            let positions = self.positions.map(|position| row(position, f32::NAN));
            let count = self.collision.count;
            let points = self.collision.contacts.map(|contact| row(contact.point, f32::INFINITY));
            let magnitude = Lanes::new([MAGNITUDE, MAGNITUDE, MAGNITUDE, 0]);
            let seen = &points[..count as usize];
            let all = positions.iter().chain(seen).map(|at| at.and(magnitude));
            let sum = all.fold(Lanes::all(0), Lanes::plus_f32);
            Reach::new(&Locations { positions, points, sum }, count)
        }

        fn shapes<'a>(&self, table: &'a [Shape]) -> [&'a Shape; 2] {
            self.shapes.map(|shape| &table[shape])
        }

        fn surely_fits(&self, table: &[Shape]) -> bool {
            surely_fit(&self.reach(), self.shapes(table))
        }

        /// The verdict of validation.
        fn fits(&self, table: &[Shape]) -> bool {
            let (collision, positions) = (&self.collision, self.positions);
            let rows = Rows { index: 0, collision, positions, shapes: self.shapes(table) };
            rows.fit(&HALF.default_variant())
        }
    }

    fn together(all: &[One], table: &[Shape]) -> bool {
        let mut furthest = Furthest::new();
        for one in all {
            let still = one
                .shapes(table)
                .map(|shape| Lanes::all(if shape.is_static() { u32::MAX } else { 0 }));
            furthest.take(&one.reach(), still);
        }
        furthest.all_surely_fit(&Extremes::new(table))
    }

    fn at(positions: [[f32; 3]; 2], point: [f32; 3], shapes: [usize; 2]) -> One {
        let contacts = [Contact { point, distance: 0.0 }; CONTACT_POINTS];
        let collision =
            Collision { body_a: 0, body_b: 1, normal: [0.0, 1.0, 0.0], count: 4, contacts };
        One { collision, positions, shapes }
    }

    #[test]
    fn a_pile_on_its_ground_is_found_to_fit_at_once() {
        let table = [GROUND, CUBE];
        let on_ground = at([[0.0; 3], [100.0, 0.5, 90.0]], [100.5, 0.0, 90.5], [0, 1]);
        let above = at([[100.0, 0.5, 90.0], [100.0, 1.5, 90.0]], [100.5, 1.0, 90.5], [1, 1]);
        assert!(together(&[on_ground.clone(), above.clone()], &table));
    }

    /// A pebble's inertia with a cube's arm does not fit, but no collision has both.
    #[test]
    fn bodies_of_different_size_are_found_to_fit_one_by_one() {
        let table = [GROUND, CUBE, PEBBLE];
        let cubes = at([[0.0; 3], [2.0, 0.0, 0.0]], [1.0, 0.0, 0.0], [1, 1]);
        let pebbles = at([[5.0, 0.0, 0.0], [5.1, 0.0, 0.0]], [5.05, 0.0, 0.0], [2, 2]);
        let all = [cubes, pebbles];
        assert!(!together(&all, &table));
        assert!(all.iter().all(|one| one.surely_fits(&table)));
    }

    /// The sum of the four points is out of range, although the lever arms are short.
    #[test]
    fn contact_points_far_out_are_found() {
        let table = [GROUND, POINT_MASS];
        for (x, fits) in [(7_000.0, true), (16_100.0, false), (-16_100.0, false)] {
            let far = at([[x, 0.0, 0.0]; 2], [x, 0.0, 0.0], [1, 1]);
            let near = at([[0.0; 3]; 2], [1.0, 0.0, 0.0], [0, 1]);
            assert_eq!(far.fits(&table), fits);
            assert_eq!(far.surely_fits(&table), fits);
            assert_eq!(together(&[far, near], &table), fits);
        }
    }

    /// A shape that is too heavy or too light rules out a common bound.
    #[test]
    fn shapes_may_forbid_it() {
        let heavy = Shape::isotropic(1e-5, 0.0);
        let light = Shape::isotropic(33_000.0, 0.0);
        for (table, allowed) in [
            (vec![GROUND, CUBE, PEBBLE], true),
            (vec![GROUND, CUBE, heavy], false),
            (vec![GROUND, CUBE, light], false),
        ] {
            assert_eq!(Extremes::new(&table).allow(), allowed);
        }
    }

    /// The largest component bounds the turning of a body about every axis.
    #[test]
    fn whichever_component_of_the_inertia_is_largest_counts() {
        for component in 0..3 {
            let mut rod = CUBE;
            rod.inverse_inertia[component] = 65_000.0;
            for (table, fits) in [([GROUND, CUBE], true), ([GROUND, rod], false)] {
                let one = at([[0.0; 3], [2.0, 0.0, 0.0]], [1.0, 0.0, 0.0], [0, 1]);
                assert_eq!(one.fits(&table), fits);
                assert_eq!(one.surely_fits(&table), fits);
                assert_eq!(together(std::slice::from_ref(&one), &table), fits);
            }
        }
    }

    /// Lengths on both sides of every limit.
    fn length() -> impl Strategy<Value = f32> {
        let magnitude = prop_oneof![
            0.0_f32..4.0,
            50.0_f32..300.0,
            15_900.0_f32..16_100.0,
            42_000.0_f32..44_000.0
        ];
        (magnitude, any::<bool>()).prop_map(|(length, minus)| if minus { -length } else { length })
    }

    fn any_one(shapes: usize) -> impl Strategy<Value = One> {
        let near = prop::array::uniform3(prop_oneof![12 => Just(0.0), 1 => length()]);
        let bodies = prop::array::uniform2(near.clone());
        let points = prop::array::uniform4(near.clone());
        // The whole collision may be far from the origin.
        let place = prop_oneof![3 => Just([0.0; 3]), 1 => near];
        // Not both static.
        let pair = (0..shapes, 1..shapes, any::<bool>());
        let kinds = pair.prop_map(|(one, other, first)| match first {
            true => [one, other],
            false => [other, one],
        });
        (bodies, points, place, 1..=4_u32, kinds).prop_map(
            |(bodies, points, place, count, shapes)| {
                let there = |vec3: [f32; 3]| std::array::from_fn(|k| vec3[k] + place[k]);
                let positions = bodies.map(there);
                let contacts = points.map(|point| Contact { point: there(point), distance: 0.0 });
                let collision =
                    Collision { body_a: 0, body_b: 1, normal: [0.0; 3], count, contacts };
                One { collision, positions, shapes }
            },
        )
    }

    fn any_table() -> impl Strategy<Value = Vec<Shape>> {
        let shape = (1e-5_f32..4e-5, prop_oneof![Just(0.0_f32), 1e-2_f32..1e4])
            .prop_map(|(mass, inertia)| Shape::isotropic(mass, inertia));
        let shape = prop_oneof![shape, Just(CUBE), Just(PEBBLE), Just(POINT_MASS)];
        prop::collection::vec(shape, 1..3).prop_map(|shapes| [vec![GROUND], shapes].concat())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn what_surely_fits_is_not_refused(
            (table, all) in any_table().prop_flat_map(|table| {
                let one = any_one(table.len());
                (Just(table), prop::collection::vec(one, 1..4))
            }),
        ) {
            let fits = |one: &One| one.fits(&table);
            if together(&all, &table) {
                prop_assert!(all.iter().all(fits));
            }
            for one in &all {
                if one.surely_fits(&table) {
                    prop_assert!(fits(one));
                }
            }
        }
    }
}
