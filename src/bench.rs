//! This file lets a benchmark pack collisions without a board: feature `bench`.

use bitstream_model::interface::address_map::DMA_COUNT_MAX;
use bitstream_model::interface::profile::Variant;
use bitstream_model::interface::record::Beat;

use crate::beat::pack::{Entries, Target, pack_collisions, survey};
use crate::beat::stripe::Segment;
use crate::record::end::{End, Ends};
use crate::scene::{Bodies, Collisions, Shape};

/// Packs collisions as a step does, into memory of its own instead of a board's.
#[derive(Debug)]
pub struct CollisionPacker {
    variant: Variant,
    channels: [Vec<Beat>; DMA_COUNT_MAX],
    ends: Vec<End>,
}

impl CollisionPacker {
    /// For one bitstream; without memory of its own yet.
    #[must_use]
    pub fn new(variant: Variant) -> Self {
        Self { variant, channels: Default::default(), ends: Vec::new() }
    }

    /// Packs the records of all collisions over the bitstream's channels; returns the sum of their
    /// words, modulo 2^32.
    pub fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
    ) -> u32 {
        let count = collisions.len();
        let layout = Segment::Collisions.layout(&self.variant);
        let streams = self.variant.profile.mm2s_widths.len();
        let used = &mut self.channels[..streams];
        for (place, channel) in used.iter_mut().enumerate() {
            channel.resize(layout.beats_on_channel(count, place), Beat::default());
        }
        let mut channels = self.channels.each_mut().map(Vec::as_mut_slice);
        let channels = &mut channels[..streams];
        let target = Target { variant: &self.variant, shapes, quick: None };
        survey(target, bodies, bodies.len(), &mut self.ends);
        let entries = Entries { collisions, count, scheduled: false, words: None };
        pack_collisions(target, Ends(&self.ends), &entries, channels).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::profile::FLOAT;
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
        assert_eq!(
            CollisionPacker::new(FLOAT.default_variant()).pack(&bodies, &vec![collision; 7], &[]),
            7 * (4 + 1)
        );
    }
}
