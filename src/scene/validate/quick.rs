//! This file looks at the input of a step while it is packed: a block at a time, in the cache.
//!
//! Without a branch per number it is found out whether everything of a record is surely right. One
//! of which that cannot be said is checked as [`validate`](super::validate) does; what that refuses
//! is refused there, by its own words and in its own order.

use bitstream_model::interface::number::{Precision, StreamFormat};
use bitstream_model::interface::profile::Geometry;

use super::body::check_body;
use super::rows::Rows;
use super::{Scene, all_within, check_whole};
use crate::record::end::{End, Ends};
use crate::record::relative::{anchors, difference};
use crate::scene::{Body, CONTACT_POINTS, Collision, InputError};

/// Squares of the lengths that a normal surely may have: half the tolerance, so that no rounding
/// matters.
const NORMAL: [f32; 2] = {
    let half = InputError::NORMAL_TOLERANCE / 2.0;
    [(1.0 - half) * (1.0 - half), (1.0 + half) * (1.0 + half)]
};
/// Square of twice the length that an orientation must have.
const ORIENTATION: f32 = 4.0 * InputError::SHORTEST_ORIENTATION * InputError::SHORTEST_ORIENTATION;

/// Looks at the bodies and collisions of one step.
#[derive(Debug)]
pub(crate) struct Quick<'a> {
    scene: Scene<'a>,
    /// Largest magnitudes.
    poses: f32,
    velocities: f32,
    collisions: f32,
    relative: bool,
    short_rows: bool,
}

impl<'a> Quick<'a> {
    /// For what passed [`preflight`](super::preflight).
    pub(crate) fn new(scene: Scene<'a>) -> Self {
        let held = scene.held;
        let relative = scene.variant.profile.geometry == Geometry::Relative;
        // Rows are looked at only where the numbers are.
        let short_rows = scene.variant.numbers.rows == Precision::Binary16
            && !(held.collisions == StreamFormat::F32 && !relative);
        Self {
            poses: held.poses.largest(),
            velocities: held.velocities.largest(),
            collisions: held.collisions.largest(),
            relative,
            short_rows,
            scene,
        }
    }

    /// Whether validation refuses nothing of these bodies, the first of which has the index `first`;
    /// `ends` are theirs.
    #[inline]
    pub(crate) fn bodies(&self, first: usize, bodies: &[Body], ends: &[End]) -> bool {
        let all = bodies.iter().zip(ends);
        all.fold(true, |good, (body, end)| good & self.body(body, *end))
            || (first..).zip(bodies).all(|(at, body)| check_body(at, body, &self.scene).is_ok())
    }

    #[inline]
    fn body(&self, body: &Body, end: End) -> bool {
        let Body { pose, velocity, .. } = body;
        let [x, y, z, w] = pose.orientation;
        let square = x * x + y * y + z * z + w * w;
        let speeds = [velocity.linear, velocity.angular];
        let moves = speeds.as_flattened().iter().fold(0, |bits, v| bits | v.to_bits()) << 1 != 0;
        all_within(&pose.position, self.poses)
            & all_within(&pose.orientation, self.poses)
            & all_within(speeds.as_flattened(), self.velocities)
            & (square >= ORIENTATION)
            & (square <= f32::MAX)
            & end.has_shape()
            & !(end.is_static() & moves)
    }

    /// Whether validation refuses nothing of these collisions, the first of which has the index
    /// `first`. Where they are `scheduled`, one without contact points may be of the order's making:
    /// that none of the caller's is, ordering has found.
    #[inline]
    pub(crate) fn collisions(
        &self,
        first: usize,
        collisions: &[Collision],
        ends: Ends<'_>,
        scheduled: bool,
    ) -> bool {
        let padding = |collision: &Collision| {
            scheduled & (collision.count == 0) & (collision.body_a == collision.body_b)
        };
        let mut good = true;
        for collision in collisions {
            let right = match (self.relative, self.short_rows) {
                (false, false) => self.collision::<false, false>(collision, ends),
                (false, true) => self.collision::<false, true>(collision, ends),
                (true, false) => self.collision::<true, false>(collision, ends),
                (true, true) => self.collision::<true, true>(collision, ends),
            };
            good &= right | padding(collision);
        }
        good || (first..).zip(collisions).all(|(index, collision)| {
            padding(collision) || self.exactly(index, collision, ends)
        })
    }

    #[inline]
    fn collision<const RELATIVE: bool, const SHORT_ROWS: bool>(
        &self,
        collision: &Collision,
        ends: Ends<'_>,
    ) -> bool {
        let Collision { body_a, body_b, normal, count, contacts } = collision;
        let ends = [ends.get(*body_a), ends.get(*body_b)];
        let moves = ends.map(|end| !end.is_static());
        let mut positions = ends.map(|end| end.position);
        let mut origin = [0.0; 3];
        if RELATIVE {
            positions = anchors(positions, moves);
            origin = positions[0];
        }
        let limit = self.collisions;
        let mut good = all_within(normal, limit);
        for position in positions {
            good &= all_within(&difference(position, origin), limit);
        }
        for (ordinal, contact) in (0..).zip(contacts) {
            let [x, y, z] = difference(contact.point, origin);
            good &= all_within(&[x, y, z, contact.distance], limit) | (ordinal >= *count);
        }
        let [x, y, z] = *normal;
        let square = x * x + y * y + z * z;
        good &= (square >= NORMAL[0]) & (square <= NORMAL[1]);
        good &= ((1..=CONTACT_POINTS_U32).contains(count)) & (body_a != body_b);
        good &= ends[0].has_shape() & ends[1].has_shape() & (moves[0] | moves[1]);
        if SHORT_ROWS {
            let shapes = ends.map(|end| end.shape(self.scene.shapes));
            let rows = Rows { index: 0, collision, positions, shapes };
            good &= rows.surely_fit(origin, self.scene.flush_subnormals);
        }
        good
    }

    #[cold]
    fn exactly(&self, index: usize, collision: &Collision, ends: Ends<'_>) -> bool {
        let end = |body: usize| {
            let end = u32::try_from(body).map_or(End::MISSING, |body| ends.get(body));
            (end.position, end.shape(self.scene.shapes))
        };
        check_whole(index, collision, end, &self.scene).is_ok()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "four")]
const CONTACT_POINTS_U32: u32 = CONTACT_POINTS as u32;
