//! Maps the packets of a channel to the phases of a step, and back.

use super::StepPhase;
use pgs_interface::address_map::DMA_COUNT_MAX;

/// The solver of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PassKind {
    Contact,
    Friction,
}

/// The solver of pass `number`, from 0, of a step with `contact` contact passes, and the number of the
/// pass among its kind, from 1.
pub(crate) fn pass_of(number: u32, contact: u32) -> (PassKind, u32) {
    match number.checked_sub(contact) {
        None => (PassKind::Contact, number + 1),
        Some(number) => (PassKind::Friction, number + 1),
    }
}

impl StepPhase {
    /// The phase of pass `number`, from 0, of a step with `contact` contact passes.
    pub(crate) fn of_pass(number: u32, contact: u32) -> Self {
        match pass_of(number, contact) {
            (PassKind::Contact, pass) => Self::Contact(pass),
            (PassKind::Friction, pass) => Self::Friction(pass),
        }
    }
}

/// How often the collisions are streamed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Streamed {
    /// Once for all passes.
    Once,
    /// Once a pass.
    #[default]
    PerPass,
}

/// The packets of a step: the segments of each channel, and the number of passes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepShape {
    /// Per channel: velocities, collisions, poses.
    pub(crate) segments: [[bool; 3]; DMA_COUNT_MAX],
    pub(crate) contact: u32,
    /// Contact and friction passes together; 0 without collisions.
    pub(crate) passes: u32,
    pub(crate) streamed: Streamed,
}

impl StepShape {
    /// Number of times that the collisions are streamed.
    fn rounds(&self) -> u32 {
        match self.streamed {
            Streamed::Once => self.passes.min(1),
            Streamed::PerPass => self.passes,
        }
    }

    /// The phase whose records a packet of a channel carries.
    pub(super) fn phase(&self, core: usize, packet: u32) -> Option<StepPhase> {
        let passes = (0..self.rounds()).map(|pass| match self.streamed {
            // All passes, even in a step without contact passes.
            Streamed::Once => StepPhase::Contact(1),
            Streamed::PerPass => StepPhase::of_pass(pass, self.contact),
        });
        let mut all = std::iter::once(StepPhase::Load).chain(passes).chain([StepPhase::Poses]);
        all.find(|phase| self.packet(core, *phase) == Some(packet))
    }

    /// The number, from 0, of the packet of a channel that carries a phase.
    pub(super) fn packet(&self, core: usize, phase: StepPhase) -> Option<u32> {
        let [load, collisions, poses] = *self.segments.get(core)?;
        let before = u32::from(load);
        let pass = |number: u32, of: u32| {
            let there = collisions && self.rounds() > 0;
            match self.streamed {
                Streamed::Once => there.then_some(before),
                Streamed::PerPass => (there && number < of).then_some(before + number),
            }
        };
        match phase {
            StepPhase::Load => load.then_some(0),
            StepPhase::Contact(number) => {
                pass(number.checked_sub(1)?, self.contact.min(self.passes))
            }
            StepPhase::Friction(number) => {
                pass(self.contact.checked_add(number)?.checked_sub(1)?, self.passes)
            }
            StepPhase::Poses => {
                let passes = if collisions { self.rounds() } else { 0 };
                poses.then_some(before + passes)
            }
            StepPhase::Results => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(contact: u32, passes: u32, streamed: Streamed) -> StepShape {
        StepShape { segments: [[true; 3]; DMA_COUNT_MAX], contact, passes, streamed }
    }

    #[test]
    fn phases_are_packets_of_a_channel() {
        let shape = shape(4, 8, Streamed::PerPass);
        let packet = |phase| shape.packet(1, phase);
        assert_eq!(packet(StepPhase::Load), Some(0));
        assert_eq!(packet(StepPhase::Contact(1)), Some(1));
        assert_eq!(packet(StepPhase::Contact(5)), None);
        assert_eq!(packet(StepPhase::Friction(4)), Some(8));
        assert_eq!(packet(StepPhase::Friction(5)), None);
        assert_eq!(packet(StepPhase::Poses), Some(9));
        for number in 0..10 {
            let phase = shape.phase(1, number).expect("there are ten");
            assert_eq!(packet(phase), Some(number));
        }
        assert_eq!(shape.phase(1, 10), None);
    }

    #[test]
    fn a_step_of_one_pass_is_not_one_that_streams_once() {
        let (contact, friction) = (StepPhase::Contact(1), StepPhase::Friction(1));
        let one = shape(1, 1, Streamed::PerPass);
        assert_eq!([contact, friction].map(|phase| one.packet(0, phase)), [Some(1), None]);
        assert_eq!(one.phase(0, 1), Some(contact));
        let one = shape(0, 1, Streamed::PerPass);
        assert_eq!([contact, friction].map(|phase| one.packet(0, phase)), [None, Some(1)]);
        assert_eq!(one.phase(0, 1), Some(friction));
        let none = shape(0, 0, Streamed::PerPass);
        assert_eq!([contact, friction].map(|phase| none.packet(0, phase)), [None, None]);
        assert_eq!(none.phase(0, 1), Some(StepPhase::Poses));
    }

    #[test]
    fn streamed_once_all_passes_are_one_packet() {
        let mut once = shape(0, 4, Streamed::Once);
        once.segments = [[false, true, false]; DMA_COUNT_MAX];
        assert_eq!(once.packet(0, StepPhase::Friction(3)), Some(0));
        assert_eq!(once.packet(0, StepPhase::Poses), None);
        assert_eq!(once.phase(0, 0), Some(StepPhase::Contact(1)));
    }
}
