//! Maps a descriptor of a step to the phase that it belongs to.

use pgs_interface::profile::Flow;

use super::plan::{Plan, bytes};
use crate::axi_dma::pieces;
use crate::fault::Phase;
use crate::scene::StepParameters;

/// The layout of a step's descriptors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outline {
    plan: Plan,
    contact_passes: u32,
    /// The longest piece that a descriptor carries, bytes.
    largest: u32,
}

impl Outline {
    /// The outline of a step whose descriptors carry at most `largest` bytes.
    pub(crate) fn new(plan: &Plan, parameters: &StepParameters, largest: u32) -> Self {
        Self { plan: *plan, contact_passes: parameters.contact_iterations, largest }
    }

    /// The phase of a descriptor of an MM2S channel; results, for an index past the last.
    pub(crate) fn phase_of(&self, channel: usize, descriptor: usize) -> Phase {
        let segments = self.plan.segments(channel);
        let count = |beats: usize| pieces(bytes(beats), self.largest).count();
        let (load, a_pass) = (count(segments.velocities.len()), count(segments.collisions.len()));
        let Some(behind_load) = descriptor.checked_sub(load) else { return Phase::Load };
        let round = behind_load.checked_div(a_pass).and_then(|round| u32::try_from(round).ok());
        if let Some(round) = round.filter(|round| u64::from(*round) < self.plan.rounds()) {
            return match self.plan.variant.profile.flow {
                Flow::Window(_) => Phase::Collisions,
                Flow::Passes => match round.checked_sub(self.contact_passes) {
                    None => Phase::Contact(round + 1),
                    Some(friction) => Phase::Friction(friction + 1),
                },
            };
        }
        match descriptor < self.plan.descriptors(channel, self.largest) {
            true => Phase::Poses,
            false => Phase::Results,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, WINDOWED};

    fn outline(variant: pgs_interface::profile::Variant, collisions: usize) -> Outline {
        let plan = Plan { bodies: 8, collisions, passes: 5, variant };
        let parameters = StepParameters {
            contact_iterations: 3,
            friction_iterations: 2,
            ..StepParameters::default()
        };
        // One beat a descriptor.
        Outline::new(&plan, &parameters, 16)
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

    #[test]
    fn a_design_that_streams_once_has_no_passes() {
        let outline = outline(WINDOWED.default_variant(), 3);
        let phases: Vec<_> = (0..4).map(|channel| outline.phase_of(channel, 0)).collect();
        // Collisions on channels 0 and 1, velocities on 2, poses on 3.
        assert_eq!(phases, [Phase::Collisions, Phase::Collisions, Phase::Load, Phase::Poses]);
    }
}
