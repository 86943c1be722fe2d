//! Maps the packets of a channel to the phases of a step, and back.

use super::StepPhase;
use pgs_interface::address_map::DMA_COUNT_MAX;

/// The solver of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PassKind {
    Contact,
    Friction,
}

/// The solver of pass `number`, from 0, of a step with `contact` contact passes, and the number of
/// the pass among its kind, from 1.
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

/// The packets of a step: the segments of each channel, and the number of passes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepShape {
    /// Per channel: velocities, collisions, poses.
    pub(crate) segments: [[bool; 3]; DMA_COUNT_MAX],
    pub(crate) contact: u32,
    /// Contact and friction passes together; 0 without collisions.
    pub(crate) passes: u32,
}

impl StepShape {
    /// The phase whose records a packet of a channel carries.
    pub(super) fn phase(&self, core: usize, packet: u32) -> Option<StepPhase> {
        let passes = (0..self.passes).map(|pass| StepPhase::of_pass(pass, self.contact));
        let mut all = std::iter::once(StepPhase::Load).chain(passes).chain([StepPhase::Poses]);
        all.find(|phase| self.packet(core, *phase) == Some(packet))
    }

    /// The number, from 0, of the packet of a channel that carries a phase.
    pub(super) fn packet(&self, core: usize, phase: StepPhase) -> Option<u32> {
        let [load, collisions, poses] = *self.segments.get(core)?;
        let before = u32::from(load);
        let pass = |number: u32, of: u32| (collisions && number < of).then_some(before + number);
        match phase {
            StepPhase::Load => load.then_some(0),
            StepPhase::Contact(number) => {
                pass(number.checked_sub(1)?, self.contact.min(self.passes))
            }
            StepPhase::Friction(number) => {
                pass(self.contact.checked_add(number)?.checked_sub(1)?, self.passes)
            }
            StepPhase::Poses => {
                let passes = if collisions { self.passes } else { 0 };
                poses.then_some(before + passes)
            }
            StepPhase::Results => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(contact: u32, passes: u32) -> StepShape {
        StepShape { segments: [[true; 3]; DMA_COUNT_MAX], contact, passes }
    }

    #[test]
    fn phases_are_packets_of_a_channel() {
        let shape = shape(4, 8);
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
    fn a_step_of_one_pass_or_none_has_as_many_packets() {
        let (contact, friction) = (StepPhase::Contact(1), StepPhase::Friction(1));
        let one = shape(1, 1);
        assert_eq!([contact, friction].map(|phase| one.packet(0, phase)), [Some(1), None]);
        assert_eq!(one.phase(0, 1), Some(contact));
        let one = shape(0, 1);
        assert_eq!([contact, friction].map(|phase| one.packet(0, phase)), [None, Some(1)]);
        assert_eq!(one.phase(0, 1), Some(friction));
        let none = shape(0, 0);
        assert_eq!([contact, friction].map(|phase| none.packet(0, phase)), [None, None]);
        assert_eq!(none.phase(0, 1), Some(StepPhase::Poses));
    }
}
