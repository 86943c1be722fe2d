//! Recovers from a fault: afterwards the next step works, or the board must be opened again.

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
    /// Diagnoses a failed step and recovers the board; returns the caller's error.
    pub(crate) fn fail(&mut self, symptom: Symptom, shapes: &[Shape]) -> Error {
        let (mut fault, mut diagnosis) = self.diagnose(symptom);
        log::debug!("step failed: {fault}");
        let aftermath = match &fault {
            // The board has completed the step, or was not started.
            Fault::NotFinite { .. } | Fault::ImpulseNotFinite { .. } | Fault::NoMemory(_) => {
                Aftermath::Untouched
            }
            Fault::Cancelled if !self.in_flight() => Aftermath::Untouched,
            // No write to another bitstream: its registers may mean anything.
            Fault::OtherBitstream { .. } => self.give_up(&fault),
            // The registers must not be touched, or writes no longer reach the board.
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

    /// Like [`fail`](Self::fail), for a step whose results are wrong while the next step is already
    /// on the board: the state of the board does not explain this step, so it is not diagnosed.
    pub(crate) fn fail_overtaken(&mut self, fault: Fault, shapes: &[Shape]) -> Error {
        log::debug!("step failed: {fault}");
        let aftermath = match self.recover(shapes) {
            Ok(()) => Aftermath::Ready,
            Err(error) => self.give_up(&error),
        };
        Error::Step { fault: Box::new(fault), aftermath, diagnosis: None }
    }

    /// Stops the step in flight, if its caller has forgotten it.
    pub(crate) fn abandon(&mut self, shapes: &[Shape]) {
        if self.in_flight() && !self.dead && self.process.is_this() {
            log::warn!("a step was not waited for: resetting the board");
            if let Err(error) = self.recover(shapes) {
                self.give_up(&error);
            }
        }
    }

    /// Refuses a call in a child that the opener of the board has forked. The child's copy of this
    /// state and the parent's would drive the same registers.
    pub(crate) fn check_process(&self) -> Result<(), Error> {
        match self.process.is_this() {
            true => Ok(()),
            false => Err(Error::OtherProcess { opener: self.process.id() }),
        }
    }

    /// Makes sure that the board is idle: a forgotten step is stopped first.
    pub(crate) fn settle(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        self.check_process()?;
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

    /// Makes the rings large enough for a step. If a channel does not stop for its new ring, the
    /// whole board is reset.
    pub(crate) fn rings_or_reset(&mut self, plan: &Plan, shapes: &[Shape]) -> Result<(), Symptom> {
        let mut reserved = self.reserve_rings(plan);
        if let Err(Symptom::Known(Fault::Core(error @ DmaError::State { .. }))) = &reserved {
            log::debug!("resetting the board: {error}");
            self.recover(shapes)?;
            self.anomalies.tell(Anomaly::NoHalt);
            reserved = self.reserve_rings(plan);
        }
        reserved.map_err(|symptom| match symptom {
            Symptom::Known(Fault::Platform(error)) if self.platform.lost().is_none() => {
                Fault::NoMemory(error).into()
            }
            other => other,
        })
    }

    /// Resets the board, checks that its bitstream is the same, and restores buffers and shapes.
    fn recover(&mut self, shapes: &[Shape]) -> Result<(), Fault> {
        self.clear(shapes).map_err(|error| self.platform.lost().map_or(error, Fault::from))
    }

    fn clear(&mut self, shapes: &[Shape]) -> Result<(), Fault> {
        self.platform.check_present()?;
        self.reset()?;
        // Checked before the shapes are written and the board counts as ready.
        let found = self.control.fingerprint();
        if found.identification() == u32::MAX {
            return Err(Fault::Gone { region: "the control block".to_owned() });
        }
        if let Some(changed) = self.fingerprint.difference(&found) {
            return Err(other_bitstream(changed));
        }
        self.was_reset();
        self.load_shapes(shapes);
        log::info!("the board was reset after a fault");
        Ok(())
    }

    /// Writes shapes that were checked to the table, unless their masses are streamed.
    pub(crate) fn load_shapes(&mut self, shapes: &[Shape]) {
        if !self.capabilities.streams_masses(shapes.len()) {
            self.control.load_shapes(shapes, self.capabilities.variant.inertia);
        }
    }

    /// Gives the board up. All memory stays with the engines, which may still reach it.
    pub(super) fn give_up(&mut self, error: &Fault) -> Aftermath {
        log::error!("the board is given up: {error}");
        self.dead = true;
        for port in self.ports_mut() {
            port.leave_to_device();
        }
        Aftermath::MustReopen
    }
}
