//! The input of an order: pairs of bodies, and which bodies move.

use pgs_support::float_env::standard;

use super::OrderError;
use crate::scene::{Bodies, Collision, Collisions, Shape};

/// The input of an order.
#[derive(Debug, Clone, Copy)]
pub struct OrderInput<'a> {
    /// Bodies A and B of each collision; [`EMPTY`](Self::EMPTY) for a collision without contact
    /// points.
    pub pairs: &'a [[u32; 2]],
    /// Whether each body moves. A static body causes no hazard.
    pub moving: &'a [bool],
}

impl OrderInput<'_> {
    /// The pair of a collision without contact points. No body has such an index.
    ///
    /// [`Order::AsGiven`](super::Order::AsGiven) leaves its entry empty,
    /// [`Order::HazardFree`](super::Order::HazardFree) leaves it out.
    pub const EMPTY: [u32; 2] = [u32::MAX; 2];

    /// Whether a collision has contact points.
    #[inline]
    pub(super) fn takes_part(pair: [u32; 2]) -> bool {
        pair != Self::EMPTY
    }

    /// The collisions with contact points: index and pair.
    pub fn taking_part(&self) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
        (0..).zip(self.pairs.iter().copied()).filter(|(_, pair)| Self::takes_part(*pair))
    }

    /// Number of collisions with contact points.
    pub(crate) fn collisions(&self) -> usize {
        self.taking_part().count()
    }

    /// Refuses input that cannot be ordered. Reports the error with the lowest index.
    pub(super) fn check(&self) -> Result<(), OrderError> {
        let bodies = self.moving.len();
        let too_many = |what, found: usize, most: usize| match found <= most {
            true => Ok(()),
            false => Err(OrderError::TooMany { what, found, most }),
        };
        too_many("bodies", bodies, 1 << 30)?;
        too_many("collisions", self.pairs.len(), 1 << 30)?;
        let limit = u32::try_from(bodies).unwrap_or(u32::MAX);
        // This test has no branch per pair.
        let wrong = |pair @ [a, b]: [u32; 2]| {
            Self::takes_part(pair) & ((a >= limit) | (b >= limit) | (a == b))
        };
        if !self.pairs.iter().fold(false, |any, pair| any | wrong(*pair)) {
            return Ok(());
        }
        for (index, [a, b]) in self.taking_part() {
            let collision = usize::try_from(index).unwrap_or(usize::MAX);
            if let Some(body) = [a, b].into_iter().find(|body| *body >= limit) {
                return Err(OrderError::NoSuchBody { collision, body, bodies });
            }
            if a == b {
                return Err(OrderError::SelfCollision { collision, body: a });
            }
        }
        Ok(())
    }
}

/// Input that was read from a caller's own bodies and collisions. Its memory is kept from step to
/// step.
#[derive(Debug, Clone, Default)]
pub struct InputBuffers {
    pairs: Vec<[u32; 2]>,
    moving: Vec<bool>,
}

impl InputBuffers {
    /// Makes an empty buffer.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Reads the input of an order. A body whose shape is not in `shapes` does not move; a step
    /// refuses it. Of a collision of count 0 only the count matters.
    pub fn gather<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
    ) -> OrderInput<'_> {
        standard(|| self.read(bodies, collisions, shapes));
        self.input()
    }

    fn read<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
    ) {
        self.pairs.clear();
        self.pairs.extend((0..collisions.len()).map(|index| {
            let collision = collisions.collision(index);
            if collision.is_empty() {
                return OrderInput::EMPTY;
            }
            // A pair of `u32::MAX` would look like `EMPTY`: B becomes one less, and the error names
            // A.
            let Collision { body_a, body_b, .. } = collision;
            [body_a, body_b.min(u32::MAX - u32::from(body_a == u32::MAX))]
        }));
        self.moving.clear();
        for index in 0..bodies.len() {
            let body = bodies.body(index);
            let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
            self.moving.push(shape.is_some_and(|shape| shape.inverse_mass != 0.0));
        }
    }

    /// The input that was read last.
    #[must_use]
    pub fn input(&self) -> OrderInput<'_> {
        OrderInput { pairs: &self.pairs, moving: &self.moving }
    }
}
