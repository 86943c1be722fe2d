//! Maps a descriptor of a step to the phase that it belongs to.

use super::plan::{Plan, bytes};
use crate::axi_dma::pieces;
use crate::fault::Phase;

/// The layout of a step's descriptors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outline {
    plan: Plan,
    /// The longest piece that a descriptor carries, bytes.
    largest: u32,
}

impl Outline {
    /// The outline of a step whose descriptors carry at most `largest` bytes.
    pub(crate) fn new(plan: &Plan, largest: u32) -> Self {
        Self { plan: *plan, largest }
    }

    /// The phase of a descriptor of an MM2S channel; results, for an index past the last.
    pub(crate) fn phase_of(&self, channel: usize, descriptor: usize) -> Phase {
        let segments = self.plan.segments(channel);
        let count = |beats: usize| pieces(bytes(beats), self.largest).count();
        let load = count(segments.velocities.len());
        let Some(mut behind) = descriptor.checked_sub(load) else { return Phase::Load };
        for pass in 0..self.plan.passes.total() {
            let of_pass = count(segments.of_pass(pass, self.plan.passes).len());
            match behind.checked_sub(of_pass) {
                None => return self.phase_of_pass(pass),
                // No pass of this channel has a descriptor.
                Some(_) if of_pass == 0 => break,
                Some(rest) => behind = rest,
            }
        }
        match descriptor < self.plan.descriptors(channel, self.largest) {
            true => Phase::Poses,
            false => Phase::Results,
        }
    }

    fn phase_of_pass(&self, pass: u64) -> Phase {
        let pass = u32::try_from(pass).unwrap_or(u32::MAX);
        match pass.checked_sub(self.plan.passes.contact) {
            None => Phase::Contact(pass + 1),
            Some(friction) => Phase::Friction(friction + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Passes;
    use pgs_interface::profile::FLOAT;

    fn outline(variant: pgs_interface::profile::Variant, collisions: usize) -> Outline {
        let passes = Passes { contact: 3, friction: 2, ..Passes::default() };
        // One beat a descriptor.
        let queued = false;
        let plan = Plan { bodies: 8, collisions, passes, variant, streamed_masses: false, queued };
        Outline::new(&plan, 16)
    }

    #[test]
    fn a_descriptor_belongs_to_the_phase_whose_beats_it_carries() {
        // Eight bodies are 16 beats of velocities, four a channel, and of poses; a collision has
        // two beats on channel 0 and one on channel 3.
        let outline = outline(FLOAT.default_variant(), 1);
        let names = |channel, range: std::ops::Range<usize>| -> Vec<_> {
            range.map(|index| outline.phase_of(channel, index).name()).collect()
        };
        assert_eq!(names(0, 3..7), ["load", "contact1", "contact1", "contact2"]);
        assert_eq!(names(0, 9..11), ["contact3", "friction1"]);
        assert_eq!(names(0, 13..19), ["friction2", "poses", "poses", "poses", "poses", "results"]);
        assert_eq!(
            names(3, 4..10),
            ["contact1", "contact2", "contact3", "friction1", "friction2", "poses"]
        );
    }

    #[test]
    fn without_collisions_the_poses_follow_the_load() {
        let outline = outline(FLOAT.default_variant(), 0);
        assert_eq!([3, 4].map(|index| outline.phase_of(0, index)), [Phase::Load, Phase::Poses]);
    }
}
