//! This file lets a benchmark pack collisions without a board: feature `bench`.

use crate::beat::pack::pack_collisions;
use crate::beat::stripe::{Segment, beats_on_channel};
use crate::interface::address_map::DMA_COUNT_MAX;
use crate::interface::record::Beat;
use crate::scene::{Bodies, Collisions};

/// Packs collisions as a step does, into memory of its own instead of a board's.
#[derive(Debug, Default)]
pub struct CollisionPacker {
    channels: [Vec<Beat>; DMA_COUNT_MAX],
}

impl CollisionPacker {
    /// Without memory of its own yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Packs the records of all collisions over four channels; returns the sum of their words,
    /// modulo 2^32.
    pub fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
    ) -> u32 {
        for (place, channel) in self.channels.iter_mut().enumerate() {
            let beats =
                beats_on_channel(Segment::Collisions, collisions.len(), place, DMA_COUNT_MAX);
            channel.resize(beats, Beat::default());
        }
        let mut channels = self.channels.each_mut().map(Vec::as_mut_slice);
        pack_collisions(bodies, collisions, &mut channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Body, Collision, Contact, Pose, Velocity};

    #[test]
    fn every_collision_is_packed() {
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let bodies = vec![Body { pose, velocity: Velocity::default(), shape: 0 }; 2];
        let collision = Collision {
            body_a: 0,
            body_b: 1,
            normal: [0.0; 3],
            count: 4,
            contacts: [Contact::default(); 4],
        };
        // All other words are zero.
        assert_eq!(CollisionPacker::new().pack(&bodies, &vec![collision; 7]), 7 * (4 + 1));
    }
}
