//! Refuses collisions whose constraint rows leave the range of binary16, on a bitstream that
//! computes rows in binary16.
//!
//! If the inverse effective mass overflows, the effective mass is 0 and the accelerator silently
//! ignores the contact. If a lever arm overflows, even one of a static body, the row is NaN.

use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::Variant;

use super::range::{fits, used};
use super::{Excess, InputError, InputItem, OutOfRange, Scene};
use crate::record::Magnitudes;
use crate::record::body_table::Ends;
use crate::scene::{Collision, Shape};

/// The longest component of a lever arm, m. A component of a moment is two products of lever arm
/// and unit normal: at most sqrt(2) times this, which stays below 65504 with the roundings added.
const LONGEST_ARM: f32 = 43_000.0;
/// 65504 less 2 % for the roundings on the way: the limit of inverse effective masses, of their
/// reciprocals, and of the sum of the contact points.
const LARGEST: f32 = 64_000.0;
/// The relative error of a coordinate on its way: truncated once, or rounded twice.
const LOSS: f32 = 1.0 / 1024.0;

/// The input from which the constraint rows of a collision are computed.
pub(crate) struct Rows<'a> {
    pub(crate) index: usize,
    pub(crate) collision: &'a Collision,
    /// Positions of bodies A and B, as they are streamed.
    pub(crate) positions: [[f32; 3]; 2],
    pub(crate) shapes: [&'a Shape; 2],
}

impl Scene<'_> {
    /// Whether every row of a collision stays in the range of the bitstream's arithmetic.
    pub(crate) fn rows_fit(&self, collision: &Collision, ends: Ends<'_>) -> bool {
        let ends = [collision.body_a, collision.body_b].map(|body| ends.get(body));
        let positions = ends.map(|end| end.position);
        let shapes = ends.map(|end| end.shape(self.shapes));
        let rows = Rows { index: 0, collision, positions, shapes };
        collision.is_empty() || rows.fit(self.variant)
    }
}

/// Bounds of a table's shapes.
#[derive(Debug)]
pub(crate) struct ShapeBounds {
    /// The inverse mass of the heaviest shape that is not static.
    heaviest: f32,
    /// The largest inverse mass.
    lightest: f32,
    /// The largest inverse inertia about any axis.
    inertia: f32,
}

impl ShapeBounds {
    pub(super) fn of(shapes: &[Shape]) -> Self {
        let none = Self { heaviest: f32::INFINITY, lightest: 0.0, inertia: 0.0 };
        shapes.iter().filter(|shape| !shape.is_static()).fold(none, |bounds, shape| {
            let [x, y, z] = shape.inverse_inertia;
            Self {
                heaviest: bounds.heaviest.min(shape.inverse_mass),
                lightest: bounds.lightest.max(shape.inverse_mass),
                inertia: bounds.inertia.max(x).max(y).max(z),
            }
        })
    }

    /// Whether the rows of all collisions with these largest contact points and positions fit: each
    /// sum is that of [`Rows::fit`], of larger terms. If it does not hold, the rows of each may fit
    /// or not. The collisions are right otherwise; one without contact points has no rows.
    pub(crate) fn all_fit(&self, points: Magnitudes, positions: Magnitudes) -> bool {
        let points = points.vec3();
        let arm = arm(points, positions.vec3().map(|position| -position));
        let [x, y, z] = arm;
        let turning = self.inertia * (x * x + y * y + z * z);
        (self.heaviest >= 1.0 / LARGEST)
            & arm.iter().all(|arm| *arm <= LONGEST_ARM)
            & (self.lightest + self.lightest + turning + turning <= LARGEST)
            & points.iter().all(|x| x + x + x + x <= LARGEST)
    }
}

/// A number on the way to the rows: contact point, name, component, value, smallest, largest.
type Found = (Option<usize>, &'static str, usize, f32, f32, f32);

impl Rows<'_> {
    /// Refuses a collision with a number out of range, on a bitstream that computes rows in sixteen
    /// bits.
    pub(crate) fn check(&self, scene: &Scene<'_>) -> Result<(), InputError> {
        if scene.short_rows.is_none() {
            return Ok(());
        }
        let mut numbers = self.numbers().into_iter();
        let wrong =
            numbers.find(|(.., found, smallest, largest)| !(*smallest..=*largest).contains(found));
        let Some((contact, field, component, found, smallest, largest)) = wrong else {
            return Ok(());
        };
        // The sum of the masses has no upper limit of its own: the effective mass includes it.
        let format = StreamFormat::Binary16;
        let (item, largest) = (InputItem::Rows(self.index, contact), largest.min(format.largest()));
        let number = OutOfRange { item, field, component, found, format, smallest, largest };
        Err(scene.needs.refuse(Excess::OutOfRange(number), &|variant| {
            fits(variant, self.collision, self.positions) && self.fit(variant)
        }))
    }

    /// Whether every row stays in the range of a bitstream's arithmetic.
    pub(crate) fn fit(&self, variant: &Variant) -> bool {
        if variant.numbers.rows == Precision::F32 {
            return true;
        }
        let mut fit = self.inverse_mass() >= 1.0 / LARGEST;
        let mut sum = [0.0; 3];
        for contact in used(self.collision) {
            sum = add(sum, contact.point);
            let arms = self.positions.map(|position| arm(contact.point, position));
            let [a, b] = arms;
            let short = a.iter().chain(&b).fold(true, |fit, arm| fit & (*arm <= LONGEST_ARM));
            fit &= short & (self.inverse_effective_mass(arms) <= LARGEST);
        }
        sum.into_iter().fold(fit, |fit, sum| fit & (sum <= LARGEST))
    }

    fn inverse_mass(&self) -> f32 {
        self.shapes[0].inverse_mass + self.shapes[1].inverse_mass
    }

    /// The largest inverse effective mass for these lever arms, over all directions of a row, 1/kg.
    fn inverse_effective_mass(&self, arms: [[f32; 3]; 2]) -> f32 {
        let turning = |side: usize| {
            let [x, y, z] = self.shapes[side].inverse_inertia;
            let [rx, ry, rz] = arms[side];
            x.max(y).max(z) * (rx * rx + ry * ry + rz * rz)
        };
        self.inverse_mass() + turning(0) + turning(1)
    }

    /// Every number that has a limit, in the order of the record.
    fn numbers(&self) -> Vec<Found> {
        let points: Vec<_> = used(self.collision).iter().map(|contact| contact.point).collect();
        let smallest = 1.0 / LARGEST;
        let mass = self.inverse_mass();
        let mut numbers =
            vec![(None, "sum of the inverse masses", 0, mass, smallest, f32::INFINITY)];
        for (contact, point) in points.iter().enumerate() {
            let arms = self.positions.map(|position| arm(*point, position));
            let names = ["lever arm about body A", "lever arm about body B"];
            for (name, arm) in names.into_iter().zip(arms) {
                for (component, found) in arm.into_iter().enumerate() {
                    numbers.push((Some(contact), name, component, found, 0.0, LONGEST_ARM));
                }
            }
            let found = self.inverse_effective_mass(arms);
            let name = "inverse effective mass";
            numbers.push((Some(contact), name, 0, found, smallest, LARGEST));
        }
        for (component, found) in points.into_iter().fold([0.0; 3], add).into_iter().enumerate() {
            numbers.push((None, "sum of the contact points", component, found, 0.0, LARGEST));
        }
        numbers
    }
}

/// The largest magnitude of each component of a lever arm, over all roundings of its two ends.
fn arm(point: [f32; 3], position: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| {
        let (x, p) = (point[k], position[k]);
        (x - p).abs() + (x.abs() + p.abs()) * LOSS
    })
}

/// Adds magnitudes.
fn add(sum: [f32; 3], point: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| sum[k] + point[k].abs())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{UNUSED, scene_on};
    use super::*;
    use crate::scene::Contact;
    use pgs_interface::profile::{FLOAT, HALF};
    use pgs_interface::record::Beat;
    use proptest::prelude::*;

    const CUBE: Shape = Shape::isotropic(1.0, 1.5);
    const GROUND: Shape = Shape::STATIC;

    /// Two used contact points, at the origin and at `point`; the other two are not numbers.
    fn collision(point: [f32; 3]) -> Collision {
        let at = |point| Contact { point, distance: 0.0 };
        Collision {
            body_a: 0,
            body_b: 1,
            normal: [0.0, -1.0, 0.0],
            count: 2,
            contacts: [at([0.0; 3]), at(point), UNUSED, UNUSED],
        }
    }

    fn check_on(
        variant: Variant,
        shapes: [&Shape; 2],
        collision: &Collision,
        positions: [[f32; 3]; 2],
    ) -> Result<(), String> {
        let rows = Rows { index: 7, collision, positions, shapes };
        rows.check(&scene_on(&variant)).map_err(|error| error.to_string())
    }

    const HALF_BUILT: Variant = HALF.default_variant();

    fn check(shapes: [&Shape; 2], point: [f32; 3]) -> Result<(), String> {
        check_on(HALF_BUILT, shapes, &collision(point), [[0.0; 3]; 2])
    }

    #[test]
    fn an_effective_mass_beyond_binary16_is_refused_and_named() {
        // 1 + 1.5 x 200^2 = 60,001 and a little for the roundings; 210 m make 66,151.
        assert_eq!(check([&GROUND, &CUBE], [200.0, 0.0, 0.0]), Ok(()));
        let text = check([&GROUND, &CUBE], [0.0, 210.0, 0.0]).expect_err("it overflows");
        let expected = "collision 7, contact point 1: inverse effective mass[0] is 66280.";
        assert!(text.starts_with(expected), "{text}");
        assert!(text.contains("in binary16, which takes 1.5625e-5 to 64000"), "{text}");
        assert!(text.ends_with("(profiles that could: naive, float)"), "{text}");
        // The sum over both bodies, each with its largest inverse inertia.
        assert_eq!(check([&GROUND, &CUBE], [150.0, 0.0, 0.0]), Ok(()));
        assert!(check([&CUBE, &CUBE], [150.0, 0.0, 0.0]).is_err());
        let flat = Shape { inverse_inertia: [0.1, 0.1, 1.5], ..Shape::isotropic(1.0, 0.0) };
        assert!(check([&GROUND, &flat], [0.0, 210.0, 0.0]).is_err());
        let (far, float) = (collision([0.0, 210.0, 0.0]), FLOAT.default_variant());
        assert_eq!(check_on(float, [&GROUND, &CUBE], &far, [[0.0; 3]; 2]), Ok(()));
    }

    /// At 16 km, rounding of both ends may turn a lever arm of 1 m into 32 m.
    #[test]
    fn what_is_lost_of_the_coordinates_counts() {
        let light = Shape::isotropic(1.0, 100.0);
        let check = |variant| {
            let contact = Contact { point: [16_001.0, 0.0, 0.0], distance: 0.0 };
            let near = Collision { contacts: [contact; 4], count: 1, ..collision([0.0; 3]) };
            check_on(variant, [&light; 2], &near, [[16_000.0, 0.0, 0.0]; 2])
        };
        assert!(check(HALF_BUILT).is_err());
        assert_eq!(check(FLOAT.default_variant()), Ok(()));
    }

    #[test]
    fn two_bodies_that_are_too_heavy_together_are_refused() {
        let heavy = |inverse_mass| Shape::isotropic(inverse_mass, 0.0);
        let light = heavy(1.6e-5);
        assert_eq!(check([&GROUND, &light], [1.0, 0.0, 0.0]), Ok(()));
        let text = check([&GROUND, &heavy(1.5e-5)], [1.0, 0.0, 0.0]).expect_err("66 t");
        let expected = "collision 7: sum of the inverse masses[0] is 0.000015";
        assert!(text.starts_with(expected), "{text}");
        assert_eq!(check([&heavy(8e-6), &heavy(8e-6)], [1.0, 0.0, 0.0]), Ok(()));
    }

    #[test]
    fn long_lever_arms_are_refused_even_those_of_a_static_body() {
        let point_mass = Shape::isotropic(1.0, 0.0);
        let check = |positions| {
            let near = collision([1.0, 0.0, 0.0]);
            check_on(HALF_BUILT, [&GROUND, &point_mass], &near, positions)
        };
        assert_eq!(check([[0.0, 0.0, 42_000.0], [0.0; 3]]), Ok(()));
        let text = check([[0.0, 0.0, -43_000.0], [0.0; 3]]).expect_err("too long");
        let expected = "collision 7, contact point 0: lever arm about body A[2] is 4304";
        assert!(text.starts_with(expected), "{text}");
        let text = check([[0.0; 3], [50_000.0, 0.0, 0.0]]).expect_err("too long");
        assert!(text.contains("lever arm about body B[0]"), "{text}");
    }

    /// The friction passes compute the centre of the contact points.
    #[test]
    fn the_sum_of_the_contact_points_is_held_against_the_limit() {
        let point_mass = Shape::isotropic(1.0, 0.0);
        let check = |x| {
            let there = [x, 0.0, 0.0];
            let contact = Contact { point: there, distance: 0.0 };
            let collision = Collision { count: 4, contacts: [contact; 4], ..collision(there) };
            check_on(HALF_BUILT, [&GROUND, &point_mass], &collision, [there; 2])
        };
        assert_eq!(check(16_000.0), Ok(()));
        let text = check(-16_100.0).expect_err("64,400");
        assert!(text.contains("sum of the contact points[0] is 64400"), "{text}");
    }

    /// The bounds of a table, and whether they hold for collisions of these positions and points.
    fn bound(shapes: &[Shape], collisions: &[(Collision, [[f32; 3]; 2])]) -> bool {
        let [mut points, mut places] = [Magnitudes::default(); 2];
        let row = |[x, y, z]: [f32; 3]| Beat([x, y, z, 0.0].map(f32::to_bits));
        for (collision, positions) in collisions {
            used(collision).iter().for_each(|contact| points.see(row(contact.point)));
            positions.iter().for_each(|position| places.see(row(*position)));
        }
        ShapeBounds::of(shapes).all_fit(points, places)
    }

    #[test]
    fn the_bound_holds_for_a_scene_of_usual_size_and_not_beyond_the_limits() {
        let of = |point: [f32; 3], inverse_mass, inertia| {
            let shapes = [Shape::STATIC, Shape::isotropic(inverse_mass, inertia)];
            bound(&shapes, &[(collision(point), [point, [0.0; 3]])])
        };
        assert!(of([40.0, 30.0, 40.0], 1.0, 1.5));
        assert!(!of([40.0, 30.0, 40.0], 1.0, 150.0), "effective mass");
        assert!(!of([1.0, 0.0, 0.0], 1.5e-5, 0.0), "66 t");
        assert!(!of([0.0, 43_000.0, 0.0], 1.0, 0.0), "lever arm");
        assert!(!of([0.0, 16_100.0, 0.0], 1.0, 0.0), "sum of the points");
    }

    proptest! {
        #[test]
        fn the_bound_of_a_block_holds_for_each_of_its_collisions(
            digits in 0.0_f32..5.0,
            inertia in 0.0_f32..3.0,
            block in prop::collection::vec((prop::array::uniform18(-1.0_f32..1.0), 1_u32..5), 1..4),
        ) {
            let shape = Shape::isotropic(1.0, inertia);
            let size = 10.0_f32.powf(digits);
            let block: Vec<_> = block
                .into_iter()
                .map(|(numbers, count)| {
                    let place = |at: usize| std::array::from_fn(|k| size * numbers[3 * at + k]);
                    let contacts = [0, 1, 2, 3].map(|at| Contact { point: place(at), distance: 0.0 });
                    let collision = Collision { count, contacts, ..collision([0.0; 3]) };
                    (collision, [place(4), place(5)])
                })
                .collect();
            let shapes = [&shape; 2];
            let fit = block.iter().all(|(collision, positions)| {
                Rows { index: 0, collision, positions: *positions, shapes }.fit(&HALF_BUILT)
            });
            prop_assert!(fit || !bound(&[Shape::STATIC, shape], &block));
        }
    }
}
