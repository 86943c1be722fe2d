//! The accelerator behind the opaque handle of C, with its step in flight.

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use pgs_support::Process;
use zynq_pgs::{
    Accelerator, BoardChoice, Cancellation, Collisions, Detached, Error, Impulses, LastStep,
    OpenOptions, Prepared, StepParameters, StepReport,
};

use crate::failure::Failure;
use crate::last_error::{self, c_string};
use crate::memory::{BodiesView, CollisionsView};
use crate::pushed::{List, Pushed};
use crate::shape::Shape;
use crate::status::Status;

/// An open accelerator: `zpgs_open` makes it, `zpgs_close` ends it.
///
/// One thread at a time may call with it, but for `zpgs_cancel`, which any thread may call. A
/// second call at the same time is refused with `ZPGS_STATUS_BUSY`.
#[derive(Debug)]
pub struct AcceleratorHandle {
    state: Mutex<State>,
    cancellation: Cancellation,
    /// The text of the last call that failed.
    text: Mutex<CString>,
    /// The process that has opened it.
    process: Process,
}

/// The accelerator, and its step in flight.
#[derive(Debug)]
pub(crate) struct State {
    accelerator: Accelerator,
    ticket: Option<Detached>,
    prepared: Option<Prepared>,
    pushed: Pushed,
    /// The shapes that the accelerator has.
    shapes: Vec<Shape>,
    /// The last step of each world.
    last_steps: BTreeMap<u32, LastStep>,
}

impl AcceleratorHandle {
    /// Opens the board that the text names.
    pub(crate) fn open(board: &str) -> Result<Self, Failure> {
        let board: BoardChoice = board.parse().map_err(Error::from)?;
        let mut accelerator = Accelerator::open(OpenOptions { board, ..OpenOptions::default() })?;
        let cancellation = Cancellation::new();
        accelerator.set_cancellation(cancellation.clone());
        let state = Mutex::new(State {
            accelerator,
            ticket: None,
            prepared: None,
            pushed: Pushed::default(),
            shapes: Vec::new(),
            last_steps: BTreeMap::new(),
        });
        Ok(Self { state, cancellation, text: Mutex::default(), process: Process::this() })
    }

    /// Refuses a call in a child that was forked since the opening. It takes no lock: a thread of
    /// the parent may have had it at the fork.
    fn check_process(&self) -> Result<(), Failure> {
        match self.process.is_this() {
            true => Ok(()),
            false => Err(Error::OtherProcess { opener: self.process.id() }.into()),
        }
    }

    /// The state, for one call.
    pub(crate) fn lock(&self) -> Result<MutexGuard<'_, State>, Failure> {
        self.check_process()?;
        let (status, text) = match self.state.try_lock() {
            Ok(state) => return Ok(state),
            Err(TryLockError::WouldBlock) => {
                (Status::Busy, "another thread is in a call with this accelerator: wait for it")
            }
            Err(TryLockError::Poisoned(_)) => (
                Status::Panic,
                "an earlier call met a mistake of the library: close this accelerator",
            ),
        };
        Err(Failure { status, text: text.to_owned() })
    }

    /// Ends the step in flight, or else the next one.
    pub(crate) fn cancel(&self) -> Result<(), Failure> {
        self.check_process()?;
        self.cancellation.cancel();
        Ok(())
    }

    /// Keeps the text of a failure; a cancellation that is reported ends no other step.
    pub(crate) fn note(&self, failure: Failure) {
        if failure.status == Status::Cancelled {
            self.cancellation.clear();
        }
        *self.text.lock().unwrap_or_else(PoisonError::into_inner) = c_string(failure.text);
    }

    /// The text of the last failed call; it stays until another call fails. In a forked child it is
    /// the thread's.
    pub(crate) fn text(&self) -> *const c_char {
        if !self.process.is_this() {
            return last_error::get();
        }
        let text = self.text.lock().unwrap_or_else(PoisonError::into_inner);
        CStr::as_ptr(&text)
    }
}

impl State {
    /// The accelerator, if no step is in flight.
    pub(crate) fn idle(&mut self) -> Result<&mut Accelerator, Failure> {
        match self.ticket {
            None => Ok(&mut self.accelerator),
            Some(_) => Err(Failure::sequence("a step is in flight: call zpgs_wait first")),
        }
    }

    /// Loads shapes, in place of all earlier ones.
    pub(crate) fn set_shapes(&mut self, shapes: &[Shape]) -> Result<(), Failure> {
        let accelerator = self.idle()?;
        let (mut drivers, mut kept) = (Vec::new(), Vec::new());
        let room = drivers.try_reserve_exact(shapes.len());
        room.and_then(|()| kept.try_reserve_exact(shapes.len())).map_err(|error| {
            let count = shapes.len();
            Failure::argument(format!("no memory for {count} shapes ({error}): correct the number"))
        })?;
        drivers.extend(shapes.iter().map(|shape| zynq_pgs::Shape::from(*shape)));
        accelerator.set_shapes(&drivers)?;
        kept.extend_from_slice(shapes);
        self.shapes = kept;
        Ok(())
    }

    /// Loads the shapes of a world where the accelerator has others.
    fn load_shapes(&mut self, bodies: &BodiesView<'_>) -> Result<(), Failure> {
        match bodies.table {
            None => Ok(()),
            Some(table) if table == self.shapes => Ok(()),
            Some(_) if self.ticket.is_some() => Err(Failure::sequence(
                "a step with other shapes is in flight: give the worlds one table of all shapes, \
                 or call zpgs_wait first",
            )),
            Some(table) => self.set_shapes(table),
        }
    }

    /// Takes a step.
    pub(crate) fn step(
        &mut self,
        bodies: &mut BodiesView<'_>,
        collisions: &CollisionsView<'_>,
        parameters: &StepParameters,
    ) -> Result<StepReport, Failure> {
        self.idle()?;
        self.load_shapes(bodies)?;
        let Self { accelerator, last_steps, .. } = self;
        placed(last_steps, collisions, |all| Ok(accelerator.step(bodies, all, parameters)?))
    }

    /// Starts a step and keeps its ticket.
    pub(crate) fn submit(
        &mut self,
        bodies: &BodiesView<'_>,
        collisions: &CollisionsView<'_>,
        parameters: &StepParameters,
    ) -> Result<(), Failure> {
        self.idle()?;
        self.load_shapes(bodies)?;
        let Self { accelerator, last_steps, ticket, .. } = self;
        placed(last_steps, collisions, |all| {
            *ticket = Some(accelerator.submit(bodies, all, parameters)?.detach());
            Ok(())
        })
    }

    /// Keeps the impulses of the last step that gave them out, for the next one of its world.
    pub(crate) fn commit(&mut self, collisions: &CollisionsView<'_>) -> Result<(), Failure> {
        let last = self.last_steps.entry(collisions.world).or_default();
        Ok(last.commit(collisions, self.accelerator.impulses()).map_err(Error::from)?)
    }

    /// Frees the last step of a world.
    pub(crate) fn forget(&mut self, world: u32) {
        self.last_steps.remove(&world);
    }

    /// The list of collisions that are pushed.
    pub(crate) fn pushed(&mut self) -> &mut Pushed {
        &mut self.pushed
    }

    /// Submits the step of the list, and ends the list.
    pub(crate) fn submit_pushed(
        &mut self,
        bodies: &BodiesView<'_>,
        parameters: &StepParameters,
    ) -> Result<(), Failure> {
        self.idle()?;
        self.load_shapes(bodies)?;
        let accelerator = &mut self.accelerator;
        let step = match self.pushed.all(parameters.warm_start)? {
            List::Cold(collisions) => accelerator.submit(bodies, collisions, parameters),
            List::Warm(collisions) => accelerator.submit(bodies, &collisions, parameters),
        }?;
        self.ticket = Some(step.detach());
        self.pushed.end();
        Ok(())
    }

    /// Takes the ticket of the step in flight.
    fn ticket(&mut self) -> Result<Detached, Failure> {
        self.ticket.take().ok_or_else(none_in_flight)
    }

    /// Packs another step while one is in flight.
    pub(crate) fn prepare(
        &mut self,
        bodies: &BodiesView<'_>,
        collisions: &CollisionsView<'_>,
        parameters: &StepParameters,
    ) -> Result<(), Failure> {
        // Without a step in flight the shapes would be loaded.
        if self.ticket.is_none() {
            return Err(none_in_flight());
        }
        self.load_shapes(bodies)?;
        let ticket = self.ticket()?;
        self.prepared = None;
        let mut step = self.accelerator.attach(ticket)?;
        let prepared =
            placed(&self.last_steps, collisions, |all| Ok(step.prepare(bodies, all, parameters)?));
        // The step in flight goes on, whatever became of the other.
        self.ticket = Some(step.detach());
        self.prepared = Some(prepared?);
        Ok(())
    }

    /// Ends the step in flight, and starts the prepared one: the outcome of each.
    #[expect(clippy::type_complexity, reason = "two outcomes, or neither")]
    pub(crate) fn wait_and_start(
        &mut self,
        bodies: &mut BodiesView<'_>,
    ) -> Result<(Result<StepReport, Failure>, Result<(), Failure>), Failure> {
        let prepared = prepared(&self.prepared)?;
        let none = || Failure::sequence("no step is in flight: call zpgs_start");
        let ticket = self.ticket.take().ok_or_else(none)?;
        let (done, started) = self.accelerator.attach(ticket)?.wait_and_start(bodies, prepared);
        let started = started.map(|step| self.ticket = Some(step.detach()));
        Ok((done.map_err(Into::into), started.map_err(Into::into)))
    }

    /// The impulses of the last step that gave them out.
    pub(crate) fn impulses(&self) -> &[Impulses] {
        self.accelerator.impulses()
    }

    /// Starts the prepared step.
    pub(crate) fn start(&mut self) -> Result<(), Failure> {
        self.idle()?;
        let step = self.accelerator.start(prepared(&self.prepared)?)?;
        self.ticket = Some(step.detach());
        Ok(())
    }

    /// Ends the step in flight.
    pub(crate) fn wait(&mut self, bodies: &mut BodiesView<'_>) -> Result<StepReport, Failure> {
        let ticket = self.ticket()?;
        Ok(self.accelerator.attach(ticket)?.wait(bodies)?)
    }
}

/// A call that needs a step in flight.
fn none_in_flight() -> Failure {
    Failure::sequence("no step is in flight: call zpgs_submit or zpgs_end first")
}

/// Hands the collisions over, with the impulses at their places in the last step of their world.
fn placed<T>(
    last_steps: &BTreeMap<u32, LastStep>,
    given: &CollisionsView<'_>,
    take: impl FnOnce(&dyn Collisions) -> Result<T, Failure>,
) -> Result<T, Failure> {
    match given.places {
        None => take(given),
        Some(places) => {
            let none = LastStep::default();
            let last = last_steps.get(&given.world).unwrap_or(&none);
            take(&last.placed(given, places, given.factor).map_err(Error::from)?)
        }
    }
}

/// The prepared step.
fn prepared(prepared: &Option<Prepared>) -> Result<&Prepared, Failure> {
    let none =
        || Failure::sequence("no step is prepared: call zpgs_prepare while a step is in flight");
    prepared.as_ref().ok_or_else(none)
}
