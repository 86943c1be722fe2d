//! Leads from any fault to "the next step works" or "open again".

use super::anomalies::Anomaly;
use super::bank::Bank;
use super::device::Device;
use super::plan::Plan;
use super::root_cause::other_bitstream;
use super::symptom::Symptom;
use crate::axi_dma::DmaError;
use crate::error::{Aftermath, Error};
use crate::fault::Fault;
use crate::scene::Shape;

impl Device {
    /// Finds out why a step failed and brings the board back; the error to return.
    pub(crate) fn fail(&mut self, symptom: Symptom, shapes: &[Shape]) -> Error {
        let (mut fault, mut diagnosis) = self.diagnose(symptom);
        log::debug!("step failed: {fault}");
        let aftermath = match &fault {
            // The board did its part: everything is complete and back. Or it was not asked yet.
            Fault::NotFinite { .. } | Fault::NoMemory(_) => Aftermath::Untouched,
            Fault::Cancelled if !self.in_flight() => Aftermath::Untouched,
            // What answers now is not to be written to: its registers may mean anything.
            Fault::OtherBitstream { .. } => self.give_up(&fault),
            // Nothing that is written arrives.
            Fault::Platform(_) if self.platform.lost().is_some() => self.give_up(&fault),
            _ => match self.recover(shapes) {
                Ok(()) => Aftermath::Ready,
                Err(error) => {
                    let aftermath = self.give_up(&error);
                    if matches!(error, Fault::OtherBitstream { .. }) {
                        fault = error;
                    } else if let Some(diagnosis) = &mut diagnosis {
                        diagnosis.reset = Some(Box::new(error));
                    }
                    aftermath
                }
            },
        };
        Error::Step { fault: Box::new(fault), aftermath, diagnosis }
    }

    /// As [`fail`](Self::fail), of a step whose results were found wrong when the next one was on the
    /// board already: what stands there says nothing of this one.
    pub(crate) fn fail_overtaken(&mut self, fault: Fault, shapes: &[Shape]) -> Error {
        log::debug!("step failed: {fault}");
        let aftermath = match self.recover(shapes) {
            Ok(()) => Aftermath::Ready,
            Err(error) => self.give_up(&error),
        };
        Error::Step { fault: Box::new(fault), aftermath, diagnosis: None }
    }

    /// Stops a step that nobody will wait for; nothing, if there is none.
    pub(crate) fn abandon(&mut self, shapes: &[Shape]) {
        if self.in_flight() && !self.dead {
            log::warn!("a step was not waited for: resetting the board");
            if let Err(error) = self.recover(shapes) {
                self.give_up(&error);
            }
        }
    }

    /// Sees to a board that works on nothing: a step that was forgotten is stopped first.
    pub(crate) fn settle(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        self.abandon(shapes);
        if self.dead { Err(Error::MustReopen) } else { Ok(()) }
    }

    /// Makes the buffers of a bank and the rings large enough for a step.
    pub(crate) fn reserve_or_reset(
        &mut self,
        plan: &Plan,
        bank: Bank,
        shapes: &[Shape],
    ) -> Result<(), Symptom> {
        self.reserve_buffers(plan, bank).map_err(Fault::NoMemory)?;
        self.rings_or_reset(plan, shapes)
    }

    /// Makes the rings large enough for a step. A channel that does not stop for its new ring is
    /// reset, with everything else.
    pub(crate) fn rings_or_reset(&mut self, plan: &Plan, shapes: &[Shape]) -> Result<(), Symptom> {
        let mut reserved = self.reserve_rings(plan);
        if let Err(Symptom::Known(Fault::Core(error @ DmaError::State { .. }))) = &reserved {
            log::debug!("resetting the board: {error}");
            self.recover(shapes)?;
            self.oddities.tell(Anomaly::NoHalt);
            reserved = self.reserve_rings(plan);
        }
        reserved.map_err(|symptom| match symptom {
            Symptom::Known(Fault::Platform(error)) => Fault::NoMemory(error).into(),
            other => other,
        })
    }

    /// Resets everything and restores what a step relies on.
    fn recover(&mut self, shapes: &[Shape]) -> Result<(), Fault> {
        self.clear(shapes).map_err(|error| self.platform.lost().map_or(error, Fault::from))
    }

    fn clear(&mut self, shapes: &[Shape]) -> Result<(), Fault> {
        self.reset()?;
        // Before the shapes are written, and anything is said of being ready.
        let found = self.control.fingerprint();
        if found.identification() == u32::MAX {
            return Err(Fault::Gone { region: "the control block".to_owned() });
        }
        if let Some(changed) = self.fingerprint.difference(&found) {
            return Err(other_bitstream(changed));
        }
        for port in self.ports_mut() {
            // A buffer that does not come back is replaced by the next step.
            if let Err(error) = port.was_reset() {
                log::error!("a buffer was lost: {error}");
            }
        }
        self.was_cleared();
        self.control.load_shapes(shapes, self.capabilities.variant.inertia);
        log::info!("the board was reset after a fault");
        Ok(())
    }

    /// Touches nothing any more. All memory stays with the engines, which may still reach it.
    fn give_up(&mut self, error: &Fault) -> Aftermath {
        log::error!("the board is given up: {error}");
        self.dead = true;
        for port in self.ports_mut() {
            port.leave_to_device();
        }
        Aftermath::MustReopen
    }
}
