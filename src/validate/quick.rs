//! Screens the input of a step block by block while it is packed: a conservative test that never
//! accepts input that [`validate`](super::validate) refuses.
//!
//! The test has no branch per number. A block that it cannot accept is checked as
//! [`validate`](super::validate) does. If this check refuses the block,
//! [`validate`](super::validate) names the error, in its own words and order.

#[cfg(test)]
use std::sync::atomic::{AtomicUsize, Ordering};

use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::record::LANES;

use super::InputError;
use super::body::check_body;
use super::reach::{Extremes, Locations, Reach, surely_fit};
use super::{Scene, check_whole};
use crate::record::body_table::{End, Ends, Lookup};
use crate::record::largest::{Largest, MAGNITUDE};
use crate::record::source::CollisionSource;
use crate::record::{self, FULL};
use crate::scene::{Body, Collision};
use crate::simd::Lanes;

/// Distance of a normal's squared length from 1 that is surely accepted. The length itself is half
/// as far from 1.
pub(crate) const OFF_UNIT: f32 = InputError::NORMAL_TOLERANCE;
/// Square of twice the length that an orientation must have.
const ORIENTATION: f32 = 4.0 * InputError::SHORTEST_ORIENTATION * InputError::SHORTEST_ORIENTATION;

/// Screens the bodies and collisions of one step.
#[derive(Debug)]
pub(crate) struct Quick<'a> {
    scene: Scene<'a>,
    /// Bounds on the rows, if they are computed in sixteen bits.
    short_rows: Option<Extremes>,
    bodies: Largest<4>,
    /// Number of blocks that the quick test did not accept.
    #[cfg(test)]
    pub(crate) doubted: AtomicUsize,
}

impl<'a> Quick<'a> {
    /// The screen of a scene that passed [`preflight`](super::preflight).
    pub(crate) fn new(scene: Scene<'a>) -> Self {
        let held = scene.held;
        let any = MAGNITUDE;
        let [velocities, poses] = [held.velocities, held.poses].map(StreamFormat::largest);
        let Largest([linear, angular]) = Largest::new(velocities, [any; 2]);
        let Largest([position, orientation]) = Largest::new(poses, [any, poses.to_bits()]);
        let short_rows = scene.variant.numbers.rows == Precision::Binary16
            && held.collisions != StreamFormat::F32;
        Self {
            short_rows: short_rows.then(|| Extremes::new(scene.shapes)),
            bodies: Largest([linear, angular, position, orientation]),
            #[cfg(test)]
            doubted: AtomicUsize::new(0),
            scene,
        }
    }

    /// Whether validation accepts all of these bodies. `first` is the index of the first, `ends`
    /// are their ends, and `any_still` says whether any of them is static.
    #[inline(always)]
    pub(crate) fn bodies(
        &self,
        first: usize,
        bodies: &[Body],
        ends: &[End],
        any_still: bool,
    ) -> bool {
        let (mut beyond, mut length) = (Lanes::all(0), Lanes::all(0));
        for body in bodies {
            // The words beside the vectors have no bound.
            let [linear, angular] = record::velocity::encode(body).rows;
            let [position, orientation] = record::pose::encode(body);
            beyond = beyond.or(self.bodies.beyond(&[linear, angular, position, orientation]));
            let square = orientation.times_f32(orientation).sum_f32();
            // As bits, as for a normal.
            let [least, most] =
                [ORIENTATION, f32::MAX / 2.0].map(|bound| Lanes::all(bound.to_bits()));
            length = length.or(square.minus(least)).or(most.minus(square));
        }
        let [length, ..] = length.words();
        let mut good = (beyond.words() == [0; LANES]) & (length >> 31 == 0);
        if any_still {
            // A body without a shape counts as static, too.
            good &= bodies.iter().zip(ends).all(|(body, end)| {
                let speeds = [body.velocity.linear, body.velocity.angular];
                let moves = speeds.as_flattened().iter().fold(0, |bits, v| bits | v.to_bits());
                let may_move = self.scene.kinematic | (moves & MAGNITUDE == 0);
                !end.is_static() | (end.has_shape() & may_move)
            });
        }
        good || self.bodies_exactly(first, bodies)
    }

    /// Checks bodies as validation does.
    #[cold]
    fn bodies_exactly(&self, first: usize, bodies: &[Body]) -> bool {
        self.doubt();
        (first..).zip(bodies).all(|(at, body)| check_body(at, body, &self.scene).is_ok())
    }

    /// Counts a block that the quick test did not accept.
    fn doubt(&self) {
        #[cfg(test)]
        self.doubted.fetch_add(1, Ordering::Relaxed);
    }

    /// Bounds on the rows, if they are computed in sixteen bits.
    #[inline(always)]
    pub(crate) const fn bounds_of_rows(&self) -> Option<&Extremes> {
        self.short_rows.as_ref()
    }

    /// Whether the reach of collisions matters, and one bound may serve many collisions.
    #[inline(always)]
    pub(crate) fn asks_how_far(&self) -> bool {
        self.short_rows.as_ref().is_some_and(Extremes::allow)
    }

    /// The largest number that the stream of collisions holds.
    #[inline(always)]
    pub(crate) const fn limit_of_collisions(&self) -> f32 {
        self.scene.held.collisions.largest()
    }

    /// Whether a bitstream that computes rows in sixteen bits surely computes the rows of each
    /// collision of a block. The collisions are at these `locations`.
    pub(crate) fn rows_fit<'b, L: CollisionSource<'b>>(
        &self,
        block: &Block<'b, L>,
        locations: impl Iterator<Item = Locations>,
    ) -> bool {
        block.collisions.iter().zip(locations).all(|(collision, locations)| {
            let reach = Reach::new(&locations, collision.count);
            let ends = [collision.body_a, collision.body_b].map(|body| block.ends.get(body));
            let shapes = ends.map(|end| end.shape(self.scene.shapes));
            surely_fit(&reach, shapes) | collision.is_empty()
        })
    }

    /// Whether normals, counts and bodies of all collisions in a block but padding are surely
    /// right, and how many collisions are padding.
    // Not inlined: most blocks have no padding.
    #[inline(never)]
    pub(crate) fn heads<'b, L: CollisionSource<'b>>(&self, block: &Block<'b, L>) -> (bool, usize) {
        let (mut good, mut paddings) = (true, 0);
        for collision in block.collisions.iter() {
            let padding = collision.is_empty();
            let ends = [collision.body_a, collision.body_b].map(|body| block.ends.get(body));
            let points =
                if self.scene.pair_friction { collision.points() } else { collision.count };
            good &= padding | (head(collision, points, ends) & collision.has_finite_friction());
            paddings += usize::from(padding);
        }
        (good, paddings)
    }

    /// Checks a block as validation does.
    #[cold]
    pub(crate) fn exactly<'b, L: CollisionSource<'b>>(&self, block: &Block<'b, L>) -> bool {
        self.doubt();
        self.refusal(block).is_ok()
    }

    /// Checks a block as validation does.
    ///
    /// # Errors
    /// The error of the first collision that validation refuses.
    pub(crate) fn refusal<'b, L: CollisionSource<'b>>(
        &self,
        block: &Block<'b, L>,
    ) -> Result<(), InputError> {
        let end = |body: usize| {
            let end = u32::try_from(body).map_or(&End::MISSING, |body| block.ends.get(body));
            (end.position, end.shape(self.scene.shapes))
        };
        (block.first..)
            .zip(block.collisions.iter())
            .try_for_each(|(index, collision)| check_whole(index, collision, end, &self.scene))
    }
}

/// Collisions that are checked together.
pub(crate) struct Block<'a, L> {
    /// Index of the first collision.
    pub(crate) first: usize,
    pub(crate) collisions: L,
    /// The ends of all bodies.
    pub(crate) ends: Ends<'a>,
}

/// Whether normal, count and bodies of a collision are surely right.
#[inline(always)]
fn head(collision: &Collision, points: u32, [a, b]: [&End; 2]) -> bool {
    let [x, y, z] = collision.normal;
    let square = x * x + y * y + z * z;
    ((square - 1.0).abs() <= OFF_UNIT)
        & (points.wrapping_sub(1) < FULL)
        & (collision.body_a != collision.body_b)
        & a.has_shape()
        & b.has_shape()
        & !(a.is_static() & b.is_static())
}
