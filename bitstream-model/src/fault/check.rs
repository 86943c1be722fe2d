//! Refuses faults that can never happen in their place, phase, step or occasion.

use super::text::FaultError;
use super::{Fault, FaultKind, Place, Site, StepPhase, When};
use pgs_interface::axi_dma::Direction;

impl Fault {
    /// Checks that the fault can happen in its place, phase and step, and at its occasion.
    pub(super) fn check(&self) -> Result<(), FaultError> {
        let elsewhere = |found: String, expected| {
            Err(FaultError::Elsewhere { fault: self.kind.name(), found, expected })
        };
        if let Some(place) = self.place.filter(|place| !self.fits_place(*place)) {
            return elsewhere(format!("in {place}"), self.expected_place());
        }
        if let Some(phase) = self.phase.filter(|phase| !self.fits_phase(*phase)) {
            return elsewhere(format!("in phase {phase}"), self.expected_phase());
        }
        if self.when.is_some_and(|when| !self.fits_occasion(when)) {
            return elsewhere("at such an occasion".to_owned(), self.expected_occasion());
        }
        if self.step == Some(0) || self.times == 0 {
            return elsewhere("never".to_owned(), "steps and times count from 1");
        }
        Ok(())
    }

    fn fits_place(&self, place: Place) -> bool {
        match self.kind.site() {
            Site::Reset => !matches!(place, Place::Channel(..)),
            Site::Accelerator => place == Place::Accelerator,
            Site::Edge => false,
            _ => matches!(place, Place::Channel(..)),
        }
    }

    fn expected_place(&self) -> &'static str {
        match self.kind.site() {
            Site::Reset => "it is in a whole core (dma0) or the accelerator",
            Site::Accelerator => "it is in the accelerator",
            Site::Edge => "it is on the one interrupt line",
            _ => "it is in a channel (dma0.mm2s)",
        }
    }

    fn fits_phase(&self, phase: StepPhase) -> bool {
        let results = phase == StepPhase::Results;
        match (self.kind.site(), self.place) {
            (Site::Halt | Site::Reset | Site::Edge, _) => false,
            // `no-done` comes at the end of all phases.
            (Site::Accelerator, _) => !results && self.kind != FaultKind::NoDone,
            (_, Some(Place::Channel(_, Direction::Mm2s))) => !results,
            (_, Some(Place::Channel(_, Direction::S2mm))) => results,
            _ => true,
        }
    }

    fn expected_phase(&self) -> &'static str {
        match self.kind.site() {
            Site::Halt | Site::Reset | Site::Edge => "it has n= or step=",
            _ if self.kind == FaultKind::NoDone => "it comes after the last phase",
            Site::Accelerator => "the accelerator has no work left in the results phase",
            _ => "MM2S has no packet in the results phase, S2MM has no packet in another",
        }
    }

    fn fits_occasion(&self, when: When) -> bool {
        match (self.kind.site(), when) {
            (Site::Beat | Site::Board, When::Beat(_) | When::Descriptor(_))
            | (Site::Fetch | Site::Completion, When::Descriptor(_))
            | (Site::Halt | Site::Reset | Site::Edge, When::Occasion(_)) => true,
            (Site::Accelerator, When::Beat(_)) => self.kind != FaultKind::NoDone,
            (Site::Board, When::Access(_)) => self.place.is_none() && self.phase.is_none(),
            _ => false,
        }
    }

    fn expected_occasion(&self) -> &'static str {
        match self.kind.site() {
            Site::Beat => "it has beat= or bd=",
            Site::Fetch | Site::Completion => "it has bd=",
            Site::Accelerator if self.kind == FaultKind::NoDone => "it comes after the last phase",
            Site::Accelerator => "it has beat=, the number of a record",
            Site::Board => "it has beat= or bd= in a channel, or access= without a channel",
            Site::Halt | Site::Reset | Site::Edge => "it has n=",
            Site::PacketEnd => "it comes at the end of a packet",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_that_can_never_happen_are_refused() {
        for text in [
            "stall@dma1",
            "irq-drop@dma1.mm2s",
            "reset-slow@dma1.mm2s",
            "stall@dma0.mm2s,phase=results",
            "stall@dma0.s2mm,phase=load",
            "accelerator-error=4,phase=results",
            "no-done,phase=contact2",
            "no-done,beat=7",
            "irq-drop,phase=load",
            "sg-int-err,beat=1",
            "power-lost@dma0.mm2s,access=5",
            "power-lost,phase=contact1,access=5",
            "stall,times=0",
            "stall,step=0",
        ] {
            let refused = text.parse::<Fault>();
            assert!(matches!(refused, Err(FaultError::Elsewhere { .. })), "{text}: {refused:?}");
        }
        for text in
            ["power-lost,access=5", "stall,phase=results", "no-done,step=2", "halt-never,n=3"]
        {
            assert!(text.parse::<Fault>().is_ok(), "{text}");
        }
    }
}
