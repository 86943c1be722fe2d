//! This file writes the records of a step into the buffers of its lanes.

use bitstream_model::interface::address_map::DMA_COUNT_MAX;
use bitstream_model::interface::record::Beat;

use super::bank::Bank;
use super::device::Device;
use super::plan::Plan;
use crate::beat::pack::{
    Chosen, Entries, Target, pack_bodies, pack_collisions, pack_poses, pack_velocities, survey,
};
use crate::order::Lives;
use crate::record::end::{Ends, Survey};
use crate::scene::validate::Quick;
use crate::scene::{Bodies, Collisions, Shape};

/// What a step sent, for comparison with what the accelerator received.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) velocities: u32,
    pub(super) collisions: u32,
    pub(super) poses: u32,
}

/// What is packed.
#[derive(Debug)]
pub(super) struct Source<'a, B: ?Sized, C: ?Sized> {
    pub(super) bodies: &'a B,
    /// In the order in which they are sent.
    pub(super) collisions: &'a C,
    /// Whether that order was made for them.
    pub(super) scheduled: bool,
    pub(super) lives: Option<&'a Lives>,
    pub(super) shapes: &'a [Shape],
    /// Looks at everything on its way.
    pub(super) quick: Option<&'a Quick<'a>>,
}

impl Device {
    /// Writes the records of a step into the buffers of a bank; whether validation refuses nothing of what it
    /// was given.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        source: &Source<'_, B, C>,
    ) -> (Sent, bool) {
        let Source { bodies, collisions, scheduled, lives, shapes, quick } = *source;
        let mut velocities: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        let mut entries: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        let mut poses: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        // One borrow of each buffer, cut into its three segments.
        for (place, lane) in self.mm2s.iter_mut().enumerate() {
            let segments = plan.segments(place);
            let beats = &mut lane.beats_mut(bank)[..segments.poses.end];
            let (beats, last) = beats.split_at_mut(segments.poses.start);
            let (beats, middle) = beats.split_at_mut(segments.collisions.start);
            velocities[place] = &mut beats[segments.velocities];
            entries[place] = &mut middle[..segments.collisions.len()];
            poses[place] = last;
        }
        let active = ..plan.channels();
        let (velocities, poses) = (&mut velocities[active], &mut poses[active]);
        let target = Target { variant: &plan.variant, shapes, quick };
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics[bank] };
        let (velocities, poses, bodies_good) = match lives {
            None => pack_bodies(target, bodies, plan.bodies, into, velocities, poses),
            Some(lives) => {
                let good = survey(target, bodies, bodies.len(), into);
                let chosen = Chosen { bodies, order: lives.velocities() };
                let velocities = pack_velocities(target, &chosen, plan.bodies, velocities);
                let chosen = Chosen { bodies, order: lives.results() };
                (velocities, pack_poses(target, &chosen, plan.bodies, poses), good)
            }
        };
        let of_entries = Entries {
            collisions,
            count: plan.collisions,
            scheduled,
            words: lives.map(Lives::words),
        };
        let (collisions, good) =
            pack_collisions(target, Ends(&self.ends), &of_entries, &mut entries[active]);
        (Sent { velocities, collisions, poses }, bodies_good & good)
    }
}
