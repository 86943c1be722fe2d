//! Refuses bad input before anything is sent.
//!
//! `validate` makes one pass over the bodies and one over the collisions. A board of the same
//! capacities accepts every step that passes. Packing checks each record as it writes it, by the
//! same rules without words (`Scene::accepts`, `Scene::accepts_body`, and a limit on all
//! numbers), and calls `validate` only for the error of input that it refuses.

mod body;
pub(crate) mod capable_profiles;
mod collision;
pub(crate) mod error;
mod excess;
mod parameters;
mod range;
mod rows;
mod shape;

pub use capable_profiles::CapableProfiles;
pub(crate) use capable_profiles::SceneNeeds;
pub use error::InputError;
pub use excess::{Excess, InputItem, OutOfRange};
pub(crate) use shape::{needed, validate_shapes};

use self::body::check_body;
use self::collision::check_collision;
use self::parameters::check_parameters;
use self::range::{Held, check_impulses, check_range};
use self::rows::{Rows, ShapeBounds};
use self::shape::check_shapes;
use crate::control_block::Capabilities;
use crate::record::body_table::Ends;
use crate::scene::{Bodies, Body, Collision, Collisions, Shape, StepParameters};
use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::Variant;
use pgs_interface::record::collision as layout;

/// The capacities and formats of a bitstream, as far as they limit the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Its profile, formats and inertia.
    pub(crate) variant: Variant,
    /// Largest number of bodies, whatever the memory.
    pub(crate) body_capacity: u32,
    /// Largest number of collisions, whatever the memory.
    pub(crate) collision_capacity: u32,
    /// Entries of the shape table.
    pub(crate) shape_capacity: u32,
    /// On-chip memory that bodies and collisions share, bytes.
    pub(crate) memory_bytes: u32,
    /// Memory of a body, bytes.
    pub(crate) bytes_per_body: u32,
    /// Memory of a collision, bytes.
    pub(crate) bytes_per_collision: u32,
}

impl Limits {
    /// The limits of a bitstream.
    pub(crate) fn of(capabilities: &Capabilities) -> Self {
        Self {
            variant: capabilities.variant,
            // An index has to name every body, whatever capacity the bitstream reports.
            body_capacity: capabilities.body_capacity.min(capabilities.variant.body_capacity()),
            collision_capacity: capabilities.collision_capacity,
            shape_capacity: capabilities.shape_capacity,
            memory_bytes: capabilities.memory_bytes,
            bytes_per_body: capabilities.bytes_per_body,
            bytes_per_collision: capabilities.bytes_per_collision,
        }
    }

    /// The limits of a bitstream that has room for every scene.
    #[cfg(any(test, feature = "bench"))]
    pub(crate) const fn roomy(variant: Variant) -> Self {
        Self {
            variant,
            body_capacity: u32::MAX,
            collision_capacity: u32::MAX,
            shape_capacity: u32::MAX,
            memory_bytes: u32::MAX,
            bytes_per_body: 0,
            bytes_per_collision: 0,
        }
    }

    /// The number of collisions that fit beside `bodies` bodies.
    pub(crate) fn room_for_collisions(&self, bodies: usize) -> u32 {
        let for_bodies = (bodies as u64).saturating_mul(u64::from(self.bytes_per_body));
        let Some(free) = u64::from(self.memory_bytes).checked_sub(for_bodies) else { return 0 };
        // Collisions that take no memory are limited by their capacity alone.
        let fitting = free.checked_div(u64::from(self.bytes_per_collision)).unwrap_or(u64::MAX);
        u32::try_from(fitting).unwrap_or(u32::MAX).min(self.collision_capacity)
    }
}

/// Checks the whole input of a step.
///
/// A collision of count 0 is right, whatever its other words. A step without bodies needs no
/// shapes, and fits every board.
///
/// `shapes` is a table that [`validate_shapes`] has accepted; a shape of inverse mass 0 is static.
/// Among several mistakes of one kind, the mistake with the lowest index is reported.
#[inline]
pub(crate) fn validate<B: Bodies + ?Sized, C: Collisions + ?Sized>(
    bodies: &B,
    collisions: &C,
    shapes: &[Shape],
    parameters: &StepParameters,
    limits: &Limits,
) -> Result<(), InputError> {
    let scene = preflight(bodies, collisions, shapes, parameters, limits)?;
    scene.check(&|index| bodies.body(index), &collisions, parameters.warm_start)
}

/// The first part of [`validate`]: checks parameters, counts and shapes, before any body or
/// collision. Returns the context of the checks that follow.
#[inline]
pub(crate) fn preflight<'a, B: Bodies + ?Sized, C: Collisions + ?Sized>(
    bodies: &B,
    collisions: &C,
    shapes: &'a [Shape],
    parameters: &StepParameters,
    limits: &'a Limits,
) -> Result<Scene<'a>, InputError> {
    let bodies = bodies.lengths_agree().then(|| bodies.len());
    let collisions = collisions.lengths_agree().then(|| collisions.len());
    check_counts([bodies, collisions], shapes, parameters, limits)
}

/// [`preflight`] by the numbers of bodies and collisions; `None` where separate arrays have unequal
/// lengths.
fn check_counts<'a>(
    [bodies, collisions]: [Option<usize>; 2],
    shapes: &'a [Shape],
    parameters: &StepParameters,
    limits: &'a Limits,
) -> Result<Scene<'a>, InputError> {
    let bodies = bodies.ok_or(InputError::UnequalLengths { what: "bodies" })?;
    let collisions = collisions.ok_or(InputError::UnequalLengths { what: "collisions" })?;
    let needs = SceneNeeds { bodies, collisions, inertia: needed(shapes) };
    check_parameters(parameters, &needs, limits)?;
    if needs.bodies > 0 {
        check_room(&needs, limits)?;
        check_shapes(shapes, &needs, limits)?;
    }
    Ok(Scene::new(shapes, needs, &limits.variant, parameters))
}

/// Checks one collision; `end` returns the position and the shape of a body.
fn check_whole<'a>(
    index: usize,
    collision: &Collision,
    end: &dyn Fn(usize) -> ([f32; 3], &'a Shape),
    scene: &Scene<'_>,
) -> Result<(), InputError> {
    if collision.is_empty() {
        return Ok(());
    }
    let (body_a, body_b) =
        check_collision(index, collision, scene.needs.bodies, scene.points(collision))?;
    let [(a, shape_a), (b, shape_b)] = [end(body_a), end(body_b)];
    let (positions, shapes) = ([a, b], [shape_a, shape_b]);
    let moves = shapes.map(|shape| !shape.is_static());
    if moves == [false, false] {
        let Collision { body_a, body_b, .. } = *collision;
        return Err(InputError::BothStatic { collision: index, body_a, body_b });
    }
    // Coordinates in f32 are in range if they are finite, which is already checked.
    if scene.held.collisions == StreamFormat::F32 {
        return Ok(());
    }
    check_range(index, collision, positions, scene)?;
    Rows { index, collision, positions, shapes }.check(scene)
}

/// The context in which bodies and collisions are checked.
#[derive(Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) shapes: &'a [Shape],
    needs: SceneNeeds,
    pub(crate) variant: &'a Variant,
    pub(crate) held: Held,
    /// Whether static bodies may move.
    pub(crate) kinematic: bool,
    /// The bits of a collision's count that are its number of [points](Self::points).
    points: u32,
    /// Where constraint rows are computed in sixteen bits.
    pub(crate) short_rows: Option<ShapeBounds>,
}

impl<'a> Scene<'a> {
    /// The context of a step with these parameters.
    pub(crate) fn new(
        shapes: &'a [Shape],
        needs: SceneNeeds,
        variant: &'a Variant,
        parameters: &StepParameters,
    ) -> Self {
        let StepParameters { kinematic, pair_friction, .. } = *parameters;
        let held = Held::by(&variant.numbers);
        let points = if pair_friction { !layout::FRICTION_BITS } else { u32::MAX };
        let is_short = variant.numbers.rows == Precision::Binary16;
        let short_rows = is_short.then(|| ShapeBounds::of(shapes));
        Self { shapes, needs, variant, held, kinematic, points, short_rows }
    }

    /// The shape of a body, if it has one.
    #[inline(always)]
    pub(crate) fn shape_of(&self, body: &Body) -> Option<&'a Shape> {
        usize::try_from(body.shape).ok().and_then(|shape| self.shapes.get(shape))
    }

    /// Checks each body and each collision, in a `warm` step with its impulses.
    fn check(
        &self,
        body: &dyn Fn(usize) -> Body,
        collisions: &dyn Collisions,
        warm: bool,
    ) -> Result<(), InputError> {
        for index in 0..self.needs.bodies {
            check_body(index, &body(index), self)?;
        }
        // A body without a shape was refused above.
        let end = |index: usize| {
            let body = body(index);
            (body.pose.position, self.shape_of(&body).unwrap_or(&Shape::STATIC))
        };
        for index in 0..self.needs.collisions {
            let collision = collisions.collision(index);
            check_whole(index, &collision, &end, self)?;
            if warm {
                let (normal, points) = (collision.normal, collision.points());
                let impulses = collisions.impulses(index, normal, points).used(collision.count);
                check_impulses(index, &impulses, self)?;
            }
        }
        Ok(())
    }

    /// Checks collisions from index `first` on as [`validate`] does.
    ///
    /// # Errors
    /// The error of the first collision that validation refuses.
    pub(crate) fn refusal(
        &self,
        first: usize,
        collisions: &[Collision],
        ends: Ends<'_>,
    ) -> Result<(), InputError> {
        let end = |body: usize| {
            // An index without a body was refused before.
            let end = ends.get(u32::try_from(body).unwrap_or(u32::MAX));
            (end.position, end.shape(self.shapes))
        };
        let mut collisions = (first..).zip(collisions);
        collisions.try_for_each(|(index, collision)| check_whole(index, collision, &end, self))
    }
}

fn check_room(needs: &SceneNeeds, limits: &Limits) -> Result<(), InputError> {
    let SceneNeeds { bodies, collisions, .. } = *needs;
    let refuse = |excess| Err(needs.refuse(excess, &|_| true));
    let limit = limits.body_capacity;
    if exceeds(bodies, limit) {
        return refuse(Excess::TooManyBodies { found: bodies, limit });
    }
    let limit = limits.collision_capacity;
    if exceeds(collisions, limit) {
        return refuse(Excess::TooManyCollisions { found: collisions, limit });
    }
    let needed = needs.memory(limits.bytes_per_body, limits.bytes_per_collision);
    let available = limits.memory_bytes;
    if needed > u64::from(available) {
        let fitting = limits.room_for_collisions(bodies);
        return refuse(Excess::MemoryExceeded { bodies, collisions, needed, available, fitting });
    }
    Ok(())
}

/// Whether a count exceeds a limit of the hardware.
fn exceeds(found: usize, limit: u32) -> bool {
    !u32::try_from(found).is_ok_and(|found| found <= limit)
}

/// The index of the first wrong value, and the value.
fn first(values: &[f32], wrong: impl Fn(f32) -> bool) -> Option<(usize, f32)> {
    values.iter().copied().enumerate().find(|(_, value)| wrong(*value))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::scene::{Body, BodyArrays, CollisionArrays, Contact, Pose, Velocity};
    use pgs_interface::profile::{self, Inertia, Profile};

    /// The limits of a bitstream of `profile`, with the capacities of [`FLOAT`].
    pub(crate) const fn on(profile: &'static Profile, inertia: Inertia) -> Limits {
        Limits { variant: Variant { profile, numbers: profile.numbers, inertia }, ..FLOAT }
    }

    pub(crate) const HALF: Limits = Limits {
        body_capacity: 65_536,
        collision_capacity: 524_288,
        bytes_per_collision: 8,
        ..on(&profile::HALF, Inertia::Isotropic)
    };
    pub(crate) const FLOAT: Limits = Limits {
        variant: profile::FLOAT.default_variant(),
        body_capacity: 131_072,
        collision_capacity: 262_144,
        shape_capacity: 64,
        memory_bytes: 4 << 20,
        bytes_per_body: 24,
        bytes_per_collision: 16,
    };
    pub(crate) const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
    pub(crate) const NEEDS: SceneNeeds =
        SceneNeeds { bodies: 2, collisions: 1, inertia: Inertia::Isotropic };
    pub(crate) const USED: Contact = Contact { point: [1.0, 2.0, 3.0], distance: -0.01 };
    pub(crate) const UNUSED: Contact = Contact { point: [f32::NAN; 3], distance: f32::INFINITY };

    /// The context of checks on a bitstream of `variant`.
    pub(crate) fn scene_on(variant: &Variant) -> Scene<'_> {
        Scene::new(&SHAPES, NEEDS, variant, &StepParameters::default())
    }

    fn body(shape: u32) -> Body {
        Body {
            pose: Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity::default(),
            shape,
        }
    }

    fn collision(body_a: u32, body_b: u32) -> Collision {
        Collision {
            body_a,
            body_b,
            normal: [0.0, -1.0, 0.0],
            count: 1,
            contacts: [Contact::default(); 4],
        }
    }

    fn validated(bodies: &[Body], collisions: &[Collision]) -> Result<(), InputError> {
        validate(bodies, collisions, &SHAPES, &StepParameters::default(), &FLOAT)
    }

    fn room(bodies: usize, collisions: usize, limits: &Limits) -> Result<(), InputError> {
        check_room(&SceneNeeds { bodies, collisions, inertia: Inertia::Isotropic }, limits)
    }

    #[test]
    fn static_against_moving_is_accepted_either_way_round() {
        let bodies = [body(0), body(1), body(1)];
        let collisions = [collision(0, 1), collision(2, 0), collision(2, 1)];
        assert_eq!(validated(&bodies, &collisions), Ok(()));
        assert_eq!(validated(&bodies, &[]), Ok(()));
    }

    #[test]
    fn two_static_bodies_are_refused() {
        assert_eq!(
            validated(&[body(0), body(1), body(0)], &[collision(0, 1), collision(2, 0)]),
            Err(InputError::BothStatic { collision: 1, body_a: 2, body_b: 0 })
        );
    }

    #[test]
    fn each_check_is_reached_and_names_its_index() {
        let bodies = [body(0), body(1), body(2)];
        assert_eq!(
            validated(&bodies, &[]),
            Err(InputError::ShapeIndex { body: 2, found: 2, shapes: 2 })
        );
        assert_eq!(
            validated(&bodies[..2], &[collision(0, 1), collision(1, 1)]),
            Err(InputError::SelfCollision { collision: 1, body: 1 })
        );
        let parameters = StepParameters { contact_iterations: 256, ..StepParameters::default() };
        assert_eq!(
            validate(&bodies[..2], &[][..], &SHAPES, &parameters, &FLOAT),
            Err(InputError::TooManyIterations { solver: "contact", found: 256 })
        );
        assert_eq!(
            validate(&bodies[..2], &[][..], &[], &StepParameters::default(), &FLOAT),
            Err(InputError::NoShapes)
        );
    }

    #[test]
    fn a_step_without_bodies_has_empty_collisions_alone() {
        let empty = Collision { count: 0, ..collision(0, 1) };
        assert_eq!(validated(&[], &[]), Ok(()));
        assert_eq!(validated(&[], &[empty; 3]), Ok(()));
        let refused = InputError::BodyIndex { collision: 1, side: 'A', found: 0, bodies: 0 };
        assert_eq!(validated(&[], &[empty, collision(0, 1)]), Err(refused));
        // Nothing is sent, so that nothing has to fit.
        let none = Limits { body_capacity: 0, collision_capacity: 0, memory_bytes: 0, ..FLOAT };
        let parameters = StepParameters::default();
        assert_eq!(validate(&[][..], &[empty][..], &[], &parameters, &none), Ok(()));
        // The parameters are checked as ever.
        let parameters = StepParameters { time_step: 0.0, ..parameters };
        assert!(validate(&[][..], &[][..], &SHAPES, &parameters, &FLOAT).is_err());
    }

    #[test]
    fn of_an_empty_collision_nothing_else_is_looked_at() {
        let nan = Contact { point: [f32::NAN; 3], distance: f32::NAN };
        let normal = [f32::NAN, f32::INFINITY, 0.0];
        let bodies = [body(0), body(1), body(0)];
        for (body_a, body_b) in [(0, 1), (1, 1), (0, 2), (3, 0), (u32::MAX, u32::MAX)] {
            let empty = Collision { body_a, body_b, normal, count: 0, contacts: [nan; 4] };
            assert_eq!(validated(&bodies, &[empty]), Ok(()));
            // Its place counts.
            let refused = InputError::SelfCollision { collision: 1, body: 1 };
            assert_eq!(validated(&bodies, &[empty, collision(1, 1)]), Err(refused));
        }
    }

    #[test]
    fn more_bodies_than_the_capacity_are_refused() {
        assert_eq!(room(131_072, 0, &FLOAT), Ok(()));
        let text = room(131_073, 0, &FLOAT).expect_err("one too many").to_string();
        assert_eq!(
            text,
            "found 131073 bodies, the bitstream takes at most 131072: give fewer, or load another \
             (no profile could)"
        );
        // Indices of sixteen bits name fewer bodies.
        assert_eq!(room(65_536, 0, &HALF), Ok(()));
        let text = room(65_537, 0, &HALF).expect_err("one too many").to_string();
        assert!(text.contains("found 65537 bodies") && text.contains("at most 65536"), "{text}");
        assert!(text.ends_with("(profiles that could: naive, float)"), "{text}");
    }

    #[test]
    fn memory_of_four_mebibytes_carries_203_822_collisions_of_the_big_pile() {
        // (4,194,304 - 38,881 * 24) / 16 = 203,822.5
        assert_eq!(room(38_881, 203_822, &FLOAT), Ok(()));
        let refused = room(38_881, 203_823, &FLOAT).expect_err("one too many");
        let expected = Excess::MemoryExceeded {
            bodies: 38_881,
            collisions: 203_823,
            needed: 4_194_312,
            available: 4_194_304,
            fitting: 203_822,
        };
        assert_eq!(refused.excess(), Some(expected), "{refused}");
        let text = refused.to_string();
        for number in ["38881", "203823", "4194312", "4194304", "203822"] {
            assert!(text.contains(number), "{text}");
        }
        assert!(text.ends_with("(profiles that could: half)"), "{text}");
    }

    #[test]
    fn bodies_that_fill_the_memory_alone_leave_room_for_no_collision() {
        let small = Limits { memory_bytes: 47, ..FLOAT };
        let free = Limits { bytes_per_collision: 0, ..small };
        for (collisions, limits) in [(0, &small), (9, &free)] {
            let refused = room(2, collisions, limits).expect_err("48 bytes");
            let (bodies, needed, available, fitting) = (2, 48, 47, 0);
            let expected =
                Excess::MemoryExceeded { bodies, collisions, needed, available, fitting };
            assert_eq!(refused.excess(), Some(expected), "{refused}");
        }
    }

    #[test]
    fn more_collisions_than_the_capacity_are_refused_whatever_the_memory() {
        let free = Limits { bytes_per_collision: 0, collision_capacity: 9, ..FLOAT };
        assert_eq!(room(1, 9, &free), Ok(()));
        let refused = room(1, 10, &free).expect_err("one too many");
        assert_eq!(refused.excess(), Some(Excess::TooManyCollisions { found: 10, limit: 9 }));
    }

    #[test]
    fn separate_arrays_of_unequal_lengths_are_refused() {
        let parameters = StepParameters::default();
        let mut positions = [[0.0; 3]; 2];
        let mut linear_velocities = [[0.0; 3]; 2];
        let mut angular_velocities = [[0.0; 3]; 2];
        let mut orientations = [[0.0, 0.0, 0.0, 1.0]; 2];
        let mut check = |shapes: &[u32], counts: &[u32]| {
            let bodies = BodyArrays {
                positions: &mut positions,
                orientations: &mut orientations,
                linear_velocities: &mut linear_velocities,
                angular_velocities: &mut angular_velocities,
                shapes,
                origin: [0.0; 3],
            };
            let collisions = CollisionArrays {
                bodies: &[[0, 1]],
                normals: &[[0.0, 1.0, 0.0]],
                counts,
                contacts: &[[[0.0; 4]; 4]],
            };
            validate(&bodies, &collisions, &SHAPES, &parameters, &FLOAT)
        };
        assert_eq!(check(&[0, 1], &[1]), Ok(()));
        let unequal = |what| Err(InputError::UnequalLengths { what });
        assert_eq!(check(&[0], &[1]), unequal("bodies"));
        assert_eq!(check(&[0, 1, 1], &[1]), unequal("bodies"));
        assert_eq!(check(&[0, 1], &[]), unequal("collisions"));
    }

    /// 70,000 m are in the range of f32, and beyond the range of a stream of sixteen bits.
    #[test]
    fn ranges_are_checked_where_the_streams_are_narrow() {
        let mut bodies = [body(0), body(1)];
        let parameters = StepParameters::default();
        let check = |bodies: &[Body], limits| {
            validate(bodies, [collision(0, 1)].as_slice(), &SHAPES, &parameters, limits)
        };
        assert_eq!(check(&bodies, &HALF), Ok(()));
        bodies[1].pose.position[2] = 7e4;
        assert_eq!(check(&bodies, &FLOAT), Ok(()));
        let refused = check(&bodies, &HALF).expect_err("beyond binary16");
        let of = |refused: &InputError| {
            refused.out_of_range().map(|number| (number.item, number.component))
        };
        assert_eq!(of(&refused), Some((InputItem::Body(1), 2)), "{refused}");
    }

    /// 300,000 collisions, and a shape with three different inertias: `float` has no room for them,
    /// and no other profile is built for the shape.
    #[test]
    fn shapes_are_refused_with_the_profiles_that_have_room_for_the_scene() {
        let shapes = [
            Shape::STATIC,
            Shape { inverse_inertia: [1.0, 2.0, 3.0], ..Shape::isotropic(1.0, 0.0) },
        ];
        let collisions = vec![collision(0, 1); 300_000];
        let limits = Limits { memory_bytes: 8 << 20, collision_capacity: 524_288, ..FLOAT };
        let parameters = StepParameters::default();
        let bodies = [body(0), body(1)];
        let refused = validate(&bodies[..], &collisions[..], &shapes, &parameters, &limits);
        let text = refused.expect_err("world inertia is needed").to_string();
        assert!(text.ends_with("(no profile could, built with world inertia)"), "{text}");
    }

    /// Every number of the collision fits binary16, and its effective mass does not.
    #[test]
    fn rows_are_checked_where_they_are_computed_in_sixteen_bits() {
        let mut bodies = [body(0), body(1)];
        bodies[1].pose.position[2] = 300.0;
        let check = |limits| {
            let parameters = StepParameters::default();
            validate(&bodies[..], [collision(1, 0)].as_slice(), &SHAPES, &parameters, limits)
        };
        assert_eq!(check(&FLOAT), Ok(()));
        let refused = check(&HALF).expect_err("1 + 1.5 x 300^2");
        let of = refused.out_of_range().map(|number| (number.item, number.field));
        assert_eq!(of, Some((InputItem::Rows(0, Some(0)), "inverse effective mass")), "{refused}");
    }

    #[test]
    fn messages_name_index_value_and_limit() {
        let text = |error: InputError| error.to_string();
        let length = text(InputError::NormalLength { collision: 12, length: 1.25 });
        assert!(length.contains("12") && length.contains("1.25") && length.contains("0.001"));
        let count = text(InputError::ContactCount { collision: 12, found: 7 });
        assert!(count.contains("12") && count.contains('7') && count.contains("at most 4"));
        let passes = text(InputError::TooManyIterations { solver: "friction", found: 300 });
        assert!(passes.contains("300") && passes.contains("friction") && passes.contains("255"));
        let orientation = text(InputError::Orientation { body: 3, length: 0.0 });
        assert!(orientation.contains("body 3") && orientation.contains("1e-6"));
    }
}
