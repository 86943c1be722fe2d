//! Lets a step in flight go on without a borrow of its accelerator.

use std::mem::ManuallyDrop;

use super::accelerator::Accelerator;
use super::flight::Flight;
use super::in_flight::InFlight;
use super::unique_id::UniqueId;
use crate::error::Error;
use crate::validate::InputError;

/// A step in flight that borrows nothing, for a caller that owns the accelerator: an engine's
/// structure, or a handle of another language.
///
/// [`InFlight::detach`] makes it, and [`Accelerator::attach`] turns it back into an [`InFlight`],
/// which waits, prepares and stops as ever. The accelerator stays with its owner all the time, also
/// after an error. At most one step of an accelerator is in flight.
///
/// Until it is attached again the board works on it. Another call of the accelerator that needs the
/// board stops it first, and the accelerator then refuses to attach it:
/// [`set_shapes`](Accelerator::set_shapes), [`step`](Accelerator::step),
/// [`submit`](Accelerator::submit), [`write`](Accelerator::write), [`start`](Accelerator::start).
///
/// Dropping it does no harm. The board works to the end of the step, in memory that the accelerator
/// keeps; the accelerator's next call, or its drop, stops the board before that memory is used
/// otherwise. To stop it at once, attach it and drop the [`InFlight`].
///
/// ```
/// use zynq_pgs::{Accelerator, Body, Collision, Detached, Error, StepParameters, StepReport};
///
/// struct Engine {
///     board: Accelerator,
///     bodies: Vec<Body>,
///     step: Option<Detached>,
/// }
///
/// impl Engine {
///     fn begin(&mut self, found: &[Collision]) -> Result<(), Error> {
///         let step = self.board.submit(&self.bodies, found, &StepParameters::default())?;
///         self.step = Some(step.detach());
///         Ok(())
///     }
///
///     fn end(&mut self) -> Result<Option<StepReport>, Error> {
///         let Some(step) = self.step.take() else { return Ok(None) };
///         self.board.attach(step)?.wait(&mut self.bodies).map(Some)
///     }
/// }
/// ```
#[derive(Debug)]
#[must_use = "a detached step has no results yet: call `Accelerator::attach`"]
pub struct Detached {
    id: UniqueId,
    flight: Flight,
}

impl InFlight<'_> {
    /// Ends the borrow of the accelerator, and lets the board work on.
    pub fn detach(self) -> Detached {
        // The step goes on: it must not be dropped, which would stop it.
        let mut step = ManuallyDrop::new(self);
        let id = UniqueId::new();
        step.accelerator.detached = Some(id);
        Detached { id, flight: step.flight }
    }
}

impl Accelerator {
    /// Takes a [detached](InFlight::detach) step back.
    ///
    /// # Errors
    /// [`Error::Input`] with [`InputError::NotInFlight`]: another call has stopped the step, or it
    /// is a step of another accelerator; a step that is in flight goes on. [`Error::MustReopen`] if
    /// the board was given up since.
    /// [`Error::OtherProcess`] in a forked child.
    pub fn attach(&mut self, step: Detached) -> Result<InFlight<'_>, Error> {
        self.device.check_process()?;
        let Detached { id, flight } = step;
        if self.detached != Some(id) {
            return Err(match self.device.dead {
                true => Error::MustReopen,
                false => InputError::NotInFlight.into(),
            });
        }
        self.detached = None;
        Ok(InFlight::new(self, flight))
    }

    /// Makes sure that the board is idle: a forgotten or detached step is stopped first.
    pub(super) fn settle(&mut self) -> Result<(), Error> {
        self.detached = None;
        self.device.settle(&self.shapes)
    }
}
