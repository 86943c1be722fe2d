//! This file writes the records of a step into the buffers of its lanes.

use bitstream_model::interface::address_map::DMA_COUNT_MAX;
use bitstream_model::interface::record::Beat;

use super::bank::Bank;
use super::device::Device;
use super::plan::Plan;
use crate::beat::pack::{
    Chosen, pack_collisions, pack_marked_collisions, pack_poses, pack_velocities,
};
use crate::order::Lives;
use crate::scene::{Bodies, Collisions, Shape};

/// What a step sent, for comparison with what the accelerator received.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) velocities: u32,
    pub(super) collisions: u32,
    pub(super) poses: u32,
}

impl Device {
    /// Writes the records of a step into the buffers of a bank.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        bodies: &B,
        collisions: &C,
        lives: Option<&Lives>,
        shapes: &[Shape],
    ) -> Sent {
        let mut channels: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        let lanes = &mut self.mm2s;
        // One borrow of each buffer, cut into its three segments.
        let mut later: [(&mut [Beat], &mut [Beat]); DMA_COUNT_MAX] = Default::default();
        for (place, lane) in lanes.iter_mut().enumerate() {
            let segments = plan.segments(place);
            let beats = &mut lane.beats_mut(bank)[..segments.poses.end];
            let (beats, poses) = beats.split_at_mut(segments.poses.start);
            let (beats, collisions) = beats.split_at_mut(segments.collisions.start);
            channels[place] = &mut beats[segments.velocities];
            later[place] = (&mut collisions[..segments.collisions.len()], poses);
        }
        let (variant, count) = (&plan.variant, plan.bodies);
        let active = ..plan.channels();
        let views = &mut channels[active];
        let velocities = match lives.map(Lives::velocities) {
            Some(order) => {
                let chosen = Chosen { bodies, order };
                pack_velocities(variant, &chosen, count, shapes, views)
            }
            None => pack_velocities(variant, bodies, count, shapes, views),
        };
        let mut poses_of: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        for (place, (collisions, poses)) in later.into_iter().enumerate() {
            channels[place] = collisions;
            poses_of[place] = poses;
        }
        let views = &mut channels[active];
        let collisions = match lives.map(Lives::words) {
            Some(words) => {
                pack_marked_collisions(variant, bodies, collisions, words, shapes, views)
            }
            None => pack_collisions(variant, bodies, collisions, plan.collisions, shapes, views),
        };
        let views = &mut poses_of[active];
        let poses = match lives.map(Lives::results) {
            Some(order) => pack_poses(variant, &Chosen { bodies, order }, count, views),
            None => pack_poses(variant, bodies, count, views),
        };
        Sent { velocities, collisions, poses }
    }
}
