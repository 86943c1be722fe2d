//! Packs a step while another is on the board, and starts it after the end of that step.
//!
//! ```text
//!   CPU    | pack 0 |  pack 1  |unpack 0|  pack 2  |unpack 1| ...
//!   board           |     step 0    |     step 1      |     step 2 ...
//! ```

use pgs_support::float_env::standard;

use super::accelerator::Accelerator;
use super::flight::{Engines, Flight, PackedStep};
use super::in_flight::InFlight;
use super::report::StepReport;
use super::reserve::or_free;
use super::stopwatch::Stopwatch;
use super::unique_id::UniqueId;
use crate::board::bank::Bank;
use crate::error::{Aftermath, Error};
use crate::fault::Fault;
use crate::scene::{Bodies, Collisions, StepParameters};
use crate::validate::InputError;

/// A step whose records lie in DMA memory, ready to be [started](Accelerator::start).
///
/// A prepared step may be started more than once, as after a fault: its records stay until other
/// ones take their place.
///
/// - Before it is started, the next step that is [prepared](InFlight::prepare) replaces it.
/// - After its start, the second step that is prepared replaces it, and so does the next step that
///   is [submitted](Accelerator::submit) without being prepared.
/// - A step that was [written](Accelerator::write) with nothing on the board makes way for the next
///   submitted step, started or not.
///
/// Dropping it costs nothing and frees nothing.
#[derive(Debug)]
#[must_use = "a prepared step does not start by itself: call `start`"]
pub struct Prepared {
    pub(super) bank: Bank,
    pub(super) id: UniqueId,
}

impl InFlight<'_> {
    /// Validates, orders and packs another step while the board works on this one.
    ///
    /// The records hold the caller's values of now. A step that starts from the results of this
    /// one cannot be prepared before they are there. The step of another world on the same board
    /// can be, and so can a step whose bodies were predicted. In any case this step goes on, and
    /// the caller waits for it as before.
    ///
    /// ```
    /// use zynq_pgs::{Accelerator, Body, Collision, OpenOptions, Pose, Shape, StepParameters};
    /// # use zynq_pgs::Velocity;
    ///
    /// # fn main() -> Result<(), zynq_pgs::Error> {
    /// let mut board = Accelerator::open(OpenOptions::default())?;
    /// board.set_shapes(&[Shape::isotropic(1.0, 1.5)])?;
    /// # let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
    /// # let falling = Body { pose, velocity: Velocity::default(), shape: 0 };
    /// # let world = |count| vec![falling; count];
    /// let (mut left, mut right) = (world(2), world(3));
    /// let none: [Collision; 0] = [];
    /// let parameters = StepParameters::default();
    ///
    /// let mut flight = board.submit(&left, &none, &parameters)?;
    /// let prepared = flight.prepare(&right, &none, &parameters)?;
    /// let (report, started) = flight.wait_and_start(&mut left, &prepared);
    /// assert_eq!(report?.bodies, 2);
    /// assert_eq!(started?.wait(&mut right)?.bodies, 3);
    /// # assert_eq!(left[1], right[2]);
    /// # assert!(left[1].velocity.linear[1] < 0.0);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// The first call allocates a second set of buffers, as large as the first. Where memory is too
    /// small for both sets, steps that are not prepared work as before.
    ///
    /// # Errors
    /// [`Error::Input`]: the input was refused. [`Error::Step`] with [`Fault::NoMemory`]: there is
    /// no room for a second set of buffers. Either way the step that was prepared before is gone,
    /// and [`Accelerator::start`] refuses it.
    pub fn prepare<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<Prepared, Error> {
        standard(|| {
            let accelerator = &mut *self.accelerator;
            accelerator.device.check_process()?;
            let into = (self.flight.step.bank.other(), Engines::Working);
            let mut watch = Stopwatch::start();
            let step = accelerator.pack(into, bodies, collisions, parameters, &mut watch)?;
            self.hand_over(step)
        })
    }

    /// Hands the buffers of a newly packed step over to the device, while this step is on the board.
    pub(super) fn hand_over(&mut self, mut step: PackedStep) -> Result<Prepared, Error> {
        let (accelerator, bank) = (&mut *self.accelerator, step.bank);
        let mut watch = Stopwatch::start();
        if step.sent.is_some() {
            // Cleaning caches, or copying, takes time, too.
            accelerator.device.hand_over(&step.plan, bank).map_err(|error| {
                accelerator.packed[bank] = None;
                let fault = Box::new(Fault::from(error));
                Error::Step { fault, aftermath: Aftermath::Untouched, diagnosis: None }
            })?;
            step.host.start = watch.lap();
            accelerator.keep(step);
        }
        Ok(Prepared { bank, id: step.id })
    }

    /// Waits as [`wait`](Self::wait) does, and starts a prepared step as soon as the board has
    /// ended this one. The results are read and stored while the board works on the next step.
    ///
    /// The two steps do not depend on each other: the next one is started if the board can start
    /// it, even if this one fails or its bodies are refused.
    ///
    /// # Errors
    /// The first result has the errors of [`wait`](Self::wait), the second has the errors of
    /// [`Accelerator::start`].
    pub fn wait_and_start<B: Bodies + ?Sized>(
        self,
        bodies: &mut B,
        next: &Prepared,
    ) -> (Result<StepReport, Error>, Result<Self, Error>) {
        standard(move || self.end_and_start(bodies, next))
    }

    fn end_and_start<B: Bodies + ?Sized>(
        mut self,
        bodies: &mut B,
        next: &Prepared,
    ) -> (Result<StepReport, Error>, Result<Self, Error>) {
        let ended = self.collect(bodies);
        if next.bank == self.flight.step.bank {
            // The same step once more: its results would overwrite the results that are not read
            // yet.
            let report = ended.and_then(|ended| self.finish(ended, bodies));
            let started = self.accelerator.begin_prepared(next, Memory::Freed);
            return (report, started.map(|flight| self.followed_by(flight)));
        }
        // `self` lives until the end of this function and stops the step if the caller's code
        // panics.
        let mut started = self.accelerator.begin_prepared(next, Memory::Kept);
        if self.accelerator.device.dead {
            // The results lie in memory that now belongs to the device.
            return (
                ended.and(Err(Error::MustReopen)),
                started.map(|flight| self.followed_by(flight)),
            );
        }
        // The time of the start belongs to the next step.
        self.flight.watch.lap();
        let report = ended.and_then(|ended| match self.read(&ended, bodies) {
            Ok(()) => Ok(self.commit(ended, bodies)),
            Err(fault @ (Fault::NotFinite { .. } | Fault::ImpulseNotFinite { .. })) => {
                let fault = Box::new(fault);
                let aftermath = Aftermath::Untouched;
                Err(self.located(Error::Step { fault, aftermath, diagnosis: None }))
            }
            // An accelerator that sends wrong words is reset, which stops the next step, too.
            Err(fault) => {
                let Accelerator { device, shapes, .. } = &mut *self.accelerator;
                let error = device.fail_overtaken(fault, shapes);
                if started.is_ok() {
                    started = self.accelerator.begin_prepared(next, Memory::Kept);
                }
                Err(error)
            }
        });
        (report, started.map(|flight| self.followed_by(flight)))
    }

    /// Replaces the step that has ended by the next one.
    fn followed_by(mut self, flight: Flight) -> Self {
        self.flight = flight;
        self
    }
}

/// Whether starting a step may free the memory of the other bank, where memory is short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Memory {
    /// The other bank holds results.
    Kept,
    Freed,
}

impl Accelerator {
    /// Starts a step that was [prepared](InFlight::prepare) while an earlier one was on the board,
    /// or [written](Self::write).
    ///
    /// # Errors
    /// [`Error::Input`]: [`InputError::NotPrepared`] if its records are not there any more, or
    /// never were in this accelerator; [`InputError::ShapesChanged`] if [other
    /// shapes](Self::set_shapes) were loaded since. [`Error::Step`] and [`Error::MustReopen`] as
    /// [`Self::step`]. Where [`Error::may_retry`] is true the prepared step may be started again.
    pub fn start(&mut self, prepared: &Prepared) -> Result<InFlight<'_>, Error> {
        standard(move || {
            let flight = self.begin_prepared(prepared, Memory::Freed)?;
            Ok(InFlight::new(self, flight))
        })
    }

    fn begin_prepared(&mut self, prepared: &Prepared, memory: Memory) -> Result<Flight, Error> {
        self.settle()?;
        let watch = Stopwatch::start();
        let accesses = self.accesses();
        let step = self.packed[prepared.bank].filter(|step| step.id == prepared.id);
        let Some(step @ PackedStep { plan, bank, shapes_loaded, .. }) = step else {
            return Err(InputError::NotPrepared.into());
        };
        if step.sent.is_some() && !self.device.holds(bank) {
            // The records were lost to a fault.
            return Err(InputError::NotPrepared.into());
        }
        if shapes_loaded != self.shapes_loaded {
            return Err(InputError::ShapesChanged.into());
        }
        let Self { device, packed, shapes, .. } = self;
        let mut ready = device.check_cancelled().map_err(Into::into);
        if ready.is_ok() && step.sent.is_some() {
            ready = match memory {
                Memory::Freed => or_free((&mut *device, &mut *packed), bank, |device| {
                    device.rings_or_reset(&plan, shapes)
                }),
                Memory::Kept => device.rings_or_reset(&plan, shapes),
            };
        }
        ready.map_err(|symptom| device.fail(symptom, shapes))?;
        if step.sent.is_some() && !device.holds(bank) {
            // The records were lost to a reset that the rings needed.
            packed[bank] = None;
            return Err(InputError::NotPrepared.into());
        }
        self.begin(step, watch, accesses)
    }
}
