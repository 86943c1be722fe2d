//! Finds where two bodies touch.
//!
//! A batch has one pair in each lane. [`boxes`](super::boxes) computes pairs of boxes, with the
//! bits of [parry](super::parry), which computes all other pairs. The choice of points and their
//! way into the world is the same for both.

mod batch;

use zynq_pgs::{Body, Collision};

use super::Geometries;
use super::lanes::{self, Lanes, Row, Work};
use super::parry::Parry;
use super::points::Points;
use batch::Batch;

/// The narrow phase, with its buffers.
#[derive(Debug, Default)]
pub(super) struct Narrow {
    parry: Parry,
}

impl Narrow {
    /// Adds the collision of every pair of `bodies` that has one, in the order of the pairs.
    pub(super) fn collide(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        pairs: impl Iterator<Item = (u32, u32)>,
        found: &mut Vec<Collision>,
    ) {
        lanes::run(Collide { narrow: self, bodies, geometries, pairs, found });
    }
}

/// The narrow phase, for any lanes.
struct Collide<'a, I> {
    narrow: &'a mut Narrow,
    bodies: &'a [Body],
    geometries: Geometries<'a>,
    pairs: I,
    found: &'a mut Vec<Collision>,
}

impl<I: Iterator<Item = (u32, u32)>> Work for Collide<'_, I> {
    #[inline(always)]
    fn with<L: Lanes>(mut self, lanes: L) {
        let mut batch = Batch::default();
        let mut points = Points::none(lanes.load(&Row::default()));
        loop {
            batch.take(L::WIDTH, &mut self.pairs, self.bodies, self.geometries);
            if batch.is_empty() {
                break;
            }
            batch.collide(lanes, &mut self.narrow.parry, &mut points, self.bodies, self.found);
        }
    }
}

#[cfg(test)]
mod tests;
