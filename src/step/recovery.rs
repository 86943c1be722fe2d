//! This file leads from any fault to "the next step works" or "open again".

use super::device::Device;
use super::fault::Fault;
use super::plan::Plan;
use crate::error::{Aftermath, Error};
use crate::scene::Shape;

impl Device {
    /// Brings the board back after `fault`; the error to return.
    pub(super) fn fail(&mut self, fault: Fault, shapes: &[Shape]) -> Error {
        log::debug!("step failed: {fault}");
        let aftermath = match fault {
            // The board did its part: everything is complete and back. Or it was not asked yet.
            Fault::NotFinite { .. } | Fault::NoMemory(_) => Aftermath::Untouched,
            Fault::Cancelled if !self.in_flight() => Aftermath::Untouched,
            _ => self.recover_or_give_up(shapes),
        };
        Error::Step { fault: Box::new(fault), aftermath }
    }

    /// Brings the board back, or leaves it and its memory alone for good.
    fn recover_or_give_up(&mut self, shapes: &[Shape]) -> Aftermath {
        match self.recover(shapes) {
            Ok(()) => Aftermath::Ready,
            Err(error) => {
                log::error!("the board could not be reset: {error}");
                self.dead = true;
                // The memory stays with the engines: they may still reach it.
                for lane in self.lanes_mut() {
                    lane.leave_to_device();
                }
                Aftermath::MustReopen
            }
        }
    }

    /// Stops a step that nobody will wait for; nothing, if there is none.
    pub(super) fn abandon(&mut self, shapes: &[Shape]) {
        if self.in_flight() && !self.dead {
            log::warn!("a step was not waited for: resetting the board");
            self.recover_or_give_up(shapes);
        }
    }

    /// Sees to a board that works on nothing: a step that was forgotten is stopped first.
    pub(super) fn settle(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        self.abandon(shapes);
        if self.dead { Err(Error::MustReopen) } else { Ok(()) }
    }

    /// Makes buffers and rings large enough for a step. A channel that does not stop for its new
    /// ring is reset, with everything else.
    pub(super) fn reserve_or_reset(&mut self, plan: &Plan, shapes: &[Shape]) -> Result<(), Fault> {
        let mut reserved = self.reserve(plan);
        if let Err(Fault::Core(error)) = &reserved {
            log::warn!("a channel did not stop, resetting the board: {error}");
            self.recover(shapes)?;
            reserved = self.reserve(plan);
        }
        reserved.map_err(|fault| match fault {
            Fault::Platform(error) => Fault::NoMemory(error),
            other => other,
        })
    }

    /// Resets everything and restores what a step relies on.
    fn recover(&mut self, shapes: &[Shape]) -> Result<(), Fault> {
        self.reset()?;
        for lane in self.lanes_mut() {
            // A buffer that does not come back is replaced by the next step.
            if let Err(error) = lane.was_reset() {
                log::error!("a buffer was lost: {error}");
            }
        }
        self.was_cleared();
        self.control.load_shapes(shapes, self.capabilities.variant.inertia);
        log::info!("the board was reset after a fault");
        Ok(())
    }
}
