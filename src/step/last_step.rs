//! Carries impulses from one step to the next: each collision names its place in the last one.

use bytemuck::{Pod, Zeroable};

use crate::scene::{
    CONTACT_POINTS, Collision, Collisions, Contact, Impulses, Structures, along, in_world,
};
use crate::simd::prefetch;
use crate::validate::InputError;

/// Where a collision was in the last step.
///
/// The words lie in this order, without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Place {
    /// Its index among the collisions of that step; `u32::MAX` for a new collision.
    pub collision: u32,
    /// For each contact point its index among the points that the collision had; 255 for a new
    /// point. Elements from the number of points on have no effect, but must be valid, too.
    pub points: [u8; CONTACT_POINTS],
}

impl Place {
    /// The place of a collision that the last step did not have: it begins without impulses.
    pub const NEW: Self = Self { collision: u32::MAX, points: [NEW_POINT; CONTACT_POINTS] };

    /// The place of a collision whose points are the ones of the last step, in the same order.
    #[must_use]
    pub const fn same(collision: u32) -> Self {
        Self { collision, points: [0, 1, 2, 3] }
    }

    /// Finds the points of a collision among the ones that it had as number `collision` of the last
    /// step, for a caller whose points have no feature index.
    ///
    /// A point keeps its index where it has moved by at most `reach` metres, and is otherwise the
    /// nearest other one within it. If no point is within it, the collision is a new one.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "an index of a point is below 4")]
    pub fn nearest(collision: u32, old: &Collision, new: &Collision, reach: f32) -> Self {
        let (old, new) = (used(old), used(new));
        let (mut place, mut taken) = (Self { collision, ..Self::NEW }, 0_u32);
        let reach = reach * reach;
        for (at, (from, to)) in old.iter().zip(new).enumerate() {
            if squared(from, to) <= reach {
                place.points[at] = at as u8;
                taken |= 1 << at;
            }
        }
        if taken != 0 && taken == (1 << new.len()) - 1 {
            return place;
        }
        for (to, point) in new.iter().zip(&mut place.points).filter(|(_, at)| **at == NEW_POINT) {
            let free = old.iter().enumerate().filter(|(at, _)| taken & 1 << at == 0);
            let near = free.map(|(at, from)| (squared(from, to), at)).filter(|(d, _)| *d <= reach);
            if let Some((_, at)) = near.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
                *point = at as u8;
                taken |= 1 << at;
            }
        }
        if taken == 0 { Self::NEW } else { place }
    }

    /// Bits that only a wrong place has: a step of `limit` collisions did not have it, and it is not
    /// new. Without a branch, so that a loop over it takes several places at a time.
    #[inline(always)]
    fn wrong(&self, limit: u32) -> u32 {
        let points = u32::from_ne_bytes(self.points);
        // All bits of a byte whose top bit is set: such a point is right if it is 255.
        let new = (points >> 7 & 0x0101_0101) * 0xFF;
        let beyond = (points ^ new) & (new | 0xFCFC_FCFC);
        // New ones count from -1.
        beyond | u32::from(self.collision.wrapping_add(1) > limit)
    }

    /// The refusal of a place that is not of a step of `limit` collisions.
    #[cold]
    fn refuse(&self, index: usize, limit: u32) -> InputError {
        let Self { collision: found, points } = *self;
        let known =
            |point: &u8| Self { points: [*point; CONTACT_POINTS], ..Self::NEW }.wrong(0) == 0;
        match points.iter().position(|point| !known(point)) {
            Some(contact) => {
                InputError::PointPlace { collision: index, contact, found: points[contact] }
            }
            None => InputError::CollisionPlace { collision: index, found, limit },
        }
    }
}

const NEW_POINT: u8 = u8::MAX;

/// The last step of a world that succeeded, as far as the next one begins with its impulses. A
/// world has one of its own.
///
/// It changes by [`commit`](Self::commit) alone, which a caller calls after a step without an
/// error. So a step that was refused, failed or was cancelled begins with the same bits when it is
/// given again. A step that is prepared has read its impulses when [`prepare`] returns.
///
/// ```
/// # use zynq_pgs::{Accelerator, Body, Collision, Contact, Error, OpenOptions};
/// # use zynq_pgs::{Pose, Shape, Velocity};
/// use zynq_pgs::{LastStep, Place, StepParameters};
///
/// # fn main() -> Result<(), Error> {
/// # let mut accelerator = Accelerator::open(OpenOptions::default())?;
/// # accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)])?;
/// # let pose = |y| Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
/// # let mut bodies =
/// #     vec![(-1.0, 0), (1.0, 1)].into_iter().map(|(y, shape)| {
/// #         Body { pose: pose(y), velocity: Velocity::default(), shape }
/// #     }).collect::<Vec<_>>();
/// # let contacts = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
/// #     .map(|[x, z]| Contact { point: [x, 0.0, z], distance: 0.0 });
/// # let detect = || {
/// #     vec![Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 4, contacts }]
/// # };
/// let parameters = StepParameters::default().with_warm_start(true).with_impulses_out(true);
/// let mut last = LastStep::default();
/// for step in 0..3 {
///     let collisions = detect();
///     let places = [if step == 0 { Place::NEW } else { Place::same(0) }];
///     let placed = last.placed(&collisions, &places, 0.85)?;
///     accelerator.step(&mut bodies, &placed, &parameters)?;
///     last.commit(&collisions, accelerator.impulses())?;
/// }
/// # Ok(())
/// # }
/// ```
///
/// [`prepare`]: crate::InFlight::prepare
#[derive(Debug, Clone, Default)]
pub struct LastStep {
    /// In the caller's order.
    kept: Vec<Kept>,
}

/// A collision of the last step.
#[derive(Debug, Clone, Copy)]
struct Kept {
    impulses: [f32; CONTACT_POINTS],
    normal: [f32; 3],
    /// Friction as a vector in the world, and along the tangents of the normal. These are no array:
    /// an array of two goes through a register of integers.
    on_a: [f32; 3],
    first: f32,
    second: f32,
    /// The number of its points.
    points: u32,
}

impl Kept {
    #[inline]
    fn new(impulses: &Impulses, normal: [f32; 3], points: u32) -> Self {
        let Impulses { normal: impulses, friction: [first, second] } = *impulses;
        // Without friction it may have no contact points, and so no right normal.
        let none = (first == 0.0) & (second == 0.0);
        let on_a = if none { [0.0; 3] } else { in_world(normal, (first, second)) };
        Self { impulses, normal, on_a, first, second, points }
    }

    /// The impulses of some of its points, and 0 of a new one.
    #[inline(always)]
    fn at(&self, points: [u8; CONTACT_POINTS]) -> [f32; CONTACT_POINTS] {
        let [a, b, c, d] = self.impulses;
        points.map(|at| [a, b, c, d, 0.0][usize::from(at).min(CONTACT_POINTS)])
    }

    /// Friction along the tangents of a normal, with the same vector in the world.
    #[inline(always)]
    #[allow(clippy::float_cmp, reason = "equal normals have equal tangents")]
    fn turned(&self, normal: [f32; 3]) -> (f32, f32) {
        if normal == self.normal {
            return (self.first, self.second);
        }
        let (first, second) = along(normal, self.on_a);
        // Where the normal has turned round, bodies A and B have changed places.
        let ([a, b, c], [x, y, z]) = (self.normal, normal);
        if (a * x + b * y) + c * z < 0.0 { (-first, -second) } else { (first, second) }
    }

    /// The share of the friction that the points of a collision of `points` have, at their places.
    #[cold]
    #[allow(clippy::cast_precision_loss, reason = "at most four points")]
    fn share(&self, points: u32, places: [u8; CONTACT_POINTS]) -> f32 {
        let was = |(at, place): (u32, u8)| (at < points) & (u32::from(place) < self.points);
        let stayed: u32 = (0..).zip(places).map(|point| u32::from(was(point))).sum();
        if stayed == self.points { 1.0 } else { stayed as f32 / self.points as f32 }
    }
}

impl LastStep {
    /// The collisions of the next step, which begin with `factor` times the impulses at their
    /// places: one for each collision.
    ///
    /// Friction turns with the normal: it is as it was in the world, in the plane of the new
    /// normal. Bodies A and B may have changed places, and the bodies may have other indices. Each
    /// point has an equal share of its collision's friction: a point that has gone takes its share
    /// along, and where two collisions have points of one place, each begins with the shares of
    /// its own.
    ///
    /// # Errors
    /// [`InputError::UnequalLengths`]: another number of places than of collisions.
    /// [`InputError::CollisionPlace`] and [`InputError::PointPlace`]: a place that no step has, or
    /// that the last one did not have.
    pub fn placed<'a, C: Collisions + ?Sized>(
        &'a self,
        collisions: &'a C,
        places: &'a [Place],
        factor: f32,
    ) -> Result<PlacedCollisions<'a, C>, InputError> {
        let placed = PlacedCollisions { collisions, places, factor, kept: &self.kept };
        if !placed.lengths_agree() {
            return Err(InputError::UnequalLengths { what: "collisions" });
        }
        let limit = u32::try_from(self.kept.len()).unwrap_or(u32::MAX);
        if places.iter().fold(0, |all, place| all | place.wrong(limit)) == 0 {
            return Ok(placed);
        }
        let wrong = places.iter().enumerate().find(|(_, place)| place.wrong(limit) != 0);
        wrong.map_or(Ok(placed), |(index, place)| Err(place.refuse(index, limit)))
    }

    /// Takes the collisions of a step that has succeeded, and the
    /// [impulses](crate::Accelerator::impulses) that it gave out, before another step of that
    /// accelerator ends.
    ///
    /// # Errors
    /// [`InputError::OtherImpulses`]: another number of impulses than of collisions, as where the
    /// step did not give any out. [`InputError::UnequalLengths`]: arrays of collisions of other
    /// lengths. What was committed before stays.
    #[inline(never)]
    pub fn commit<C: Collisions + ?Sized>(
        &mut self,
        collisions: &C,
        impulses: &[Impulses],
    ) -> Result<(), InputError> {
        if !collisions.lengths_agree() {
            return Err(InputError::UnequalLengths { what: "collisions" });
        }
        let (found, expected) = (impulses.len(), collisions.len());
        if found != expected {
            return Err(InputError::OtherImpulses { found, expected });
        }
        self.kept.clear();
        self.kept.reserve(impulses.len());
        for (index, impulses) in impulses.iter().enumerate() {
            let collision = collisions.collision(index);
            self.kept.push(Kept::new(impulses, collision.normal, collision.points()));
        }
        Ok(())
    }
}

/// Collisions that begin a step with impulses of the [last one](LastStep::placed).
#[derive(Debug)]
pub struct PlacedCollisions<'a, C: ?Sized> {
    collisions: &'a C,
    places: &'a [Place],
    factor: f32,
    kept: &'a [Kept],
}

impl<C: Collisions + ?Sized> Collisions for PlacedCollisions<'_, C> {
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self.collisions.collision(index)
    }

    fn structures(&self) -> Option<Structures<'_>> {
        self.collisions.structures()
    }

    fn prefetch(&self, index: usize) {
        self.collisions.prefetch(index);
        let kept = self.places.get(index).and_then(|place| self.kept.get(place.collision as usize));
        kept.into_iter().for_each(prefetch);
    }

    fn lengths_agree(&self) -> bool {
        self.collisions.lengths_agree() && self.places.len() == self.collisions.len()
    }

    #[inline(always)]
    fn impulses(&self, index: usize, normal: [f32; 3], points: u32) -> Impulses {
        let Some(Place { collision, points: places }) = self.places.get(index) else {
            return Impulses::ZERO;
        };
        let Some(kept) = self.kept.get(*collision as usize) else {
            return Impulses::ZERO;
        };
        let same = *places == Place::same(0).points;
        let known = if same { kept.impulses } else { kept.at(*places) };
        let (first, second) = kept.turned(normal);
        let mut friction = [first, second];
        if !same | (points < kept.points) {
            let share = kept.share(points, *places);
            friction = [first * share, second * share];
        }
        Impulses { normal: known, friction }.scaled(self.factor)
    }
}

fn used(collision: &Collision) -> &[Contact] {
    &collision.contacts[..(collision.points() as usize).min(CONTACT_POINTS)]
}

/// The squared distance of two points, m².
fn squared(a: &Contact, b: &Contact) -> f32 {
    let [x, y, z]: [f32; 3] = std::array::from_fn(|i| a.point[i] - b.point[i]);
    (x * x + y * y) + z * z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collision(normal: [f32; 3], points: &[[f32; 3]]) -> Collision {
        let mut contacts = [Contact::default(); CONTACT_POINTS];
        contacts.iter_mut().zip(points).for_each(|(to, point)| to.point = *point);
        let count = u32::try_from(points.len()).expect("at most four");
        Collision { body_a: 2, body_b: 7, normal, count, contacts }
    }

    const IMPULSES: Impulses = Impulses { normal: [3.0, 4.0, 5.0, 6.0], friction: [0.5, -0.25] };

    /// The impulses of a collision with one normal, after a step with another.
    fn carried(old: [f32; 3], new: [f32; 3]) -> Impulses {
        let mut last = LastStep::default();
        last.commit(&[collision(old, &[])], &[IMPULSES]).expect("one collision");
        let turned = [collision(new, &[])];
        last.placed(&turned, &[Place::same(0)], 1.0).expect("its place").impulses(0, new, 0)
    }

    #[test]
    fn friction_turns_with_the_normal_and_with_the_order_of_the_bodies() {
        let world = |normal, friction: [f32; 2]| in_world(normal, friction.into());
        // The tangents of the tilted one are others, as its z is the largest.
        let (level, tilted) = ([0.0, 0.8, 0.6], [0.0, 0.6, 0.8]);
        assert_eq!(carried(level, level), IMPULSES, "the same bits");
        for (old, new, sign) in [
            (level, [0.0, -0.8, -0.6], -1.0),
            (tilted, tilted.map(|x| -x), -1.0),
            ([0.0, 1.0, 0.0], [-0.0, 1.0, 0.0], 1.0),
        ] {
            let found = carried(old, new);
            assert_eq!(found.normal.map(f32::to_bits), IMPULSES.normal.map(f32::to_bits));
            let (before, after) = (world(old, IMPULSES.friction), world(new, found.friction));
            for (before, after) in before.iter().zip(after) {
                assert!((before * sign - after).abs() < 1e-6, "{old:?} {new:?}");
            }
        }
        // Out of the plane of the new normal nothing stays, in it everything.
        let found = world(tilted, carried(level, tilted).friction);
        let before = world(level, IMPULSES.friction);
        let along = (before[1] * 0.6 + before[2] * 0.8, before[0]);
        let expected = [along.1, before[1] - along.0 * 0.6, before[2] - along.0 * 0.8];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn a_collision_that_was_empty_has_no_impulses_and_no_normal_to_turn_by() {
        let mut last = LastStep::default();
        let empty = collision([f32::NAN; 3], &[]);
        last.commit(&[empty], &[Impulses::ZERO]).expect("one collision");
        let new = [collision([0.0, 1.0, 0.0], &[])];
        let places = [Place::same(0)];
        let placed = last.placed(&new, &places, 1.0).expect("its place");
        assert_eq!(placed.impulses(0, new[0].normal, 0), Impulses::ZERO);
    }

    #[test]
    fn a_point_keeps_its_index_or_is_the_nearest_free_one_within_reach() {
        let old = collision([0.0; 3], &[[0.0; 3], [1.0, 0.0, 0.0], [1.2, 0.0, 0.0]]);
        let found =
            |points: &[[f32; 3]]| Place::nearest(5, &old, &collision([0.0; 3], points), 0.3);
        let at = |points| Place { collision: 5, points };
        assert_eq!(found(&[[0.1, 0.0, 0.0], [1.1, 0.0, 0.1]]), at([0, 1, 255, 255]));
        // The second is as near to it, but taken.
        assert_eq!(found(&[[1.19, 0.0, 0.0], [1.0, 0.0, 0.1]]), at([2, 1, 255, 255]));
        assert_eq!(found(&[[1.05, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0; 3]]), at([1, 255, 0, 255]));
        assert_eq!(found(&[[0.0, 0.31, 0.0]]), Place::NEW);
        assert_eq!(found(&[[f32::NAN; 3]]), Place::NEW);
        assert_eq!(found(&[]), Place::NEW);
    }
}
