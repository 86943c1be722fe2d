//! This file writes the records of a step into the buffers of its ports.

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;

use crate::beat::pack::bodies::{Chosen, pack_bodies, pack_poses, pack_velocities, survey};
use crate::beat::pack::collisions::{Entries, pack_collisions};
use crate::beat::pack::target::Target;
use crate::beat::pack::writer::Writer;
use crate::board::bank::Bank;
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::board::port::Port;
use crate::order::Lives;
use crate::record::body_table::Survey;
use crate::scene::{Bodies, Collisions, Shape};
use crate::validate::InputError;
use crate::validate::Quick;

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
    /// How many that order added, which was made for them; `None` if there is none.
    pub(super) added: Option<usize>,
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
        let Source { bodies, collisions, added, lives, shapes, quick } = *source;
        let Cut { mut velocities, mut poses, mut entries } = Cut::of(&mut self.mm2s, plan, bank);
        let active = ..plan.channels();
        let (velocities, poses) = (&mut velocities[active], &mut poses[active]);
        let target = Target { variant: &plan.variant, shapes, quick };
        let packers = &mut self.packers;
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics[bank] };
        let (velocities, poses, bodies_good) = match lives {
            None => pack_bodies(target, bodies, plan.bodies, into, (velocities, poses), packers),
            Some(lives) => {
                let good = survey(target, bodies, bodies.len(), into, packers);
                let (first, last) = (lives.velocities(), lives.results());
                let [first, last] = [first, last].map(|order| Chosen { bodies, order });
                let (velocities, first_good) =
                    pack_velocities(target, &first, plan.bodies, velocities, packers);
                let (poses, last_good) = pack_poses(target, &last, plan.bodies, poses, packers);
                (velocities, poses, good & first_good & last_good)
            }
        };
        let words = lives.map(Lives::words);
        let of_entries = Entries { collisions, count: plan.collisions, added, words };
        let (collisions, good) =
            pack_collisions(target, self.ends.ends(), &of_entries, &mut entries[active], packers);
        (Sent { velocities, collisions, poses }, bodies_good & good)
    }

    /// Writes the records of a step whose collisions are written one after the other, by
    /// `narrow_phase`; returns how many they are. What is refused of a body, `refuse` says.
    pub(super) fn pack_written<B: Bodies + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        target: Target<'_>,
        bodies: &B,
        refuse: impl FnOnce() -> Result<(), InputError>,
        narrow_phase: impl FnOnce(&mut Writer<'_>),
    ) -> Result<(Sent, usize), InputError> {
        let Cut { mut velocities, mut poses, mut entries } = Cut::of(&mut self.mm2s, plan, bank);
        let active = ..plan.channels();
        let (velocities, poses) = (&mut velocities[active], &mut poses[active]);
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics[bank] };
        let (velocities, poses, good) =
            pack_bodies(target, bodies, plan.bodies, into, (velocities, poses), &mut self.packers);
        if !good {
            refuse()?;
            return Err(InputError::Unsteady);
        }
        let (ends, entries) = (self.ends.ends(), &mut entries[active]);
        let mut writer = Writer::new(target, ends, plan.collisions, entries);
        narrow_phase(&mut writer);
        let (collisions, count) = writer.finish()?;
        Ok((Sent { velocities, collisions, poses }, count))
    }
}

/// The buffers of the MM2S ports, each cut into its three segments.
struct Cut<'a> {
    velocities: [&'a mut [Beat]; DMA_COUNT_MAX],
    poses: [&'a mut [Beat]; DMA_COUNT_MAX],
    entries: [&'a mut [Beat]; DMA_COUNT_MAX],
}

impl<'a> Cut<'a> {
    /// One borrow of each buffer, for what it was made large enough for.
    fn of(ports: &'a mut [Port], plan: &Plan, bank: Bank) -> Self {
        type Channels<'a> = [&'a mut [Beat]; DMA_COUNT_MAX];
        let (mut velocities, mut poses, mut entries) =
            <(Channels<'_>, Channels<'_>, Channels<'_>)>::default();
        for (place, port) in ports.iter_mut().enumerate() {
            let segments = plan.segments(place);
            let beats = &mut port.beats_mut(bank)[..segments.end()];
            let (first, beats) = beats.split_at_mut(segments.poses.start);
            let (second, third) = beats.split_at_mut(segments.poses.len());
            velocities[place] = &mut first[segments.velocities];
            poses[place] = second;
            if !segments.collisions.is_empty() {
                entries[place] = &mut third[segments.collisions.start - segments.poses.end..];
            }
        }
        Self { velocities, poses, entries }
    }
}
