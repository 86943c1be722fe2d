//! The accelerator as Python has it, with the steps that it has been given.

use std::ffi::CString;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError, Weak};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use zynq_pgs_c::{Shape, Status};

use crate::arrays::Arrays;
use crate::driver::{Handle, IMPULSES};
use crate::failure::Failure;
use crate::parameters::parameters;
use crate::report::Report;

/// An open board: `auto`, `uio[:NODE]`, `devmem`, `emulated[:BUILD]` or `socket:PATH`.
#[pyclass(frozen, module = "zynq_pgs")]
#[derive(Debug)]
pub(crate) struct Accelerator {
    /// `None` once it is closed.
    state: Mutex<Option<State>>,
    /// For `cancel`, which waits for no call.
    handle: Weak<Handle>,
}

/// The accelerator, and its steps: the board works on the first, and the second is packed.
#[derive(Debug)]
struct State {
    handle: Arc<Handle>,
    first: Option<Flight>,
    second: Option<Flight>,
    /// The start of the second step failed when the first one ended.
    not_started: Option<Failure>,
    /// Number of collisions of the last step that gave its impulses out.
    impulses: usize,
}

/// A step in flight: the bodies that get its results, and the number of its collisions if it gives
/// their impulses out.
type Flight = (Py<PyAny>, Option<usize>);

impl State {
    /// The accelerator, if no step is in flight.
    fn idle(&self) -> Result<&Handle, Failure> {
        match (&self.first, &self.not_started) {
            (None, None) => Ok(&self.handle),
            _ => Err(sequence("a step is in flight: wait for it first")),
        }
    }

    /// Ends the first step, and starts the second.
    fn wait(&mut self, py: Python<'_>) -> PyResult<Report> {
        if let Some(failure) = self.not_started.take() {
            return Err(failure.into());
        }
        let none = || sequence("no step is in flight: submit one first");
        let (bodies, impulses) = self.first.as_ref().ok_or_else(none)?;
        let arrays = Arrays::of_bodies(bodies.bind(py))?;
        let (handle, call, second) = (&self.handle, &arrays.call, self.second.is_some());
        let (done, started) = py.detach(|| handle.wait(call, second));
        if done.as_ref().is_err_and(Failure::is_of_arguments) {
            // Nothing has ended.
            return Ok(done?.into());
        }
        let impulses = impulses.unwrap_or(self.impulses);
        self.not_started = started.err();
        self.first = self.second.take().filter(|_| self.not_started.is_none());
        let report = done?;
        self.impulses = impulses;
        Ok(report.into())
    }
}

/// A call that does not fit the state of the accelerator.
fn sequence(text: &str) -> Failure {
    Failure::new(Status::Sequence, text)
}

impl Accelerator {
    /// The state, for one call. A lock that waits could wait for ever in a forked child.
    fn lock(&self) -> Result<MutexGuard<'_, Option<State>>, Failure> {
        let busy = "another thread is in a call with this accelerator: wait for it";
        match self.state.try_lock() {
            Ok(state) => Ok(state),
            Err(TryLockError::WouldBlock) => Err(Failure::new(Status::Busy, busy)),
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        }
    }

    /// Makes a call with the accelerator.
    fn with<T>(&self, call: impl FnOnce(&mut State) -> PyResult<T>) -> PyResult<T> {
        let closed = || sequence("the accelerator is closed: open another one");
        call(self.lock()?.as_mut().ok_or_else(closed)?)
    }
}

#[pymethods]
impl Accelerator {
    #[new]
    #[pyo3(signature = (board = "auto"))]
    fn new(py: Python<'_>, board: &str) -> PyResult<Self> {
        let board =
            CString::new(board).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let opened = Arc::new(py.detach(|| Handle::open(&board))?);
        let handle = Arc::downgrade(&opened);
        let (first, second, not_started, impulses) = (None, None, None, 0);
        let state = State { handle: opened, first, second, not_started, impulses };
        Ok(Self { state: Mutex::new(Some(state)), handle })
    }

    /// Loads rows of inverse mass and inverse inertia about x, y and z, in place of earlier ones.
    fn set_shapes(&self, shapes: Vec<[f32; 4]>) -> PyResult<()> {
        let shape = |[inverse_mass, x, y, z]: &[f32; 4]| Shape {
            inverse_mass: *inverse_mass,
            inverse_inertia: [*x, *y, *z],
        };
        let shapes: Vec<_> = shapes.iter().map(shape).collect();
        self.with(|state| Ok(state.idle()?.set_shapes(&shapes)?))
    }

    /// Takes one step: the bodies get its results, all at once, or keep their state where it fails.
    ///
    /// Other threads run meanwhile; they must not write the arrays.
    #[pyo3(signature = (bodies, collisions, *, impulses = None, **keywords))]
    fn step<'py>(
        &self,
        bodies: &Bound<'py, PyAny>,
        collisions: &Bound<'py, PyAny>,
        impulses: Option<&Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Report> {
        let arrays = Arrays::of_step(bodies, collisions, impulses, parameters(keywords)?)?;
        let call = &arrays.call;
        self.with(|state| {
            let handle = state.idle()?;
            let report = bodies.py().detach(|| handle.step(call))?;
            state.impulses = call.impulses_out().unwrap_or(state.impulses);
            Ok(report.into())
        })
    }

    /// Starts a step and returns at once. A second one is packed, and starts as soon as the first
    /// has ended.
    #[pyo3(signature = (bodies, collisions, *, impulses = None, **keywords))]
    fn submit<'py>(
        &self,
        bodies: &Bound<'py, PyAny>,
        collisions: &Bound<'py, PyAny>,
        impulses: Option<&Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<()> {
        let arrays = Arrays::of_step(bodies, collisions, impulses, parameters(keywords)?)?;
        let call = &arrays.call;
        self.with(|state| {
            let (handle, second) = (&state.handle, state.first.is_some());
            if state.second.is_some() || state.not_started.is_some() {
                return Err(sequence("two steps are in flight: wait for the first").into());
            }
            bodies.py().detach(|| handle.submit(call, second))?;
            let flight = (bodies.clone().unbind(), call.impulses_out());
            *(if second { &mut state.second } else { &mut state.first }) = Some(flight);
            Ok(())
        })
    }

    /// Ends the oldest step: the bodies of its `submit` get the results.
    fn wait(&self, py: Python<'_>) -> PyResult<Report> {
        self.with(|state| state.wait(py))
    }

    /// The impulses (n, 6) of the last step with `impulses_out`, N s.
    fn impulses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.with(|state| {
            let mut all = vec![0.0; state.impulses * IMPULSES];
            state.handle.impulses(&mut all)?;
            PyArray1::from_vec(py, all).reshape([state.impulses, IMPULSES])
        })
    }

    /// Ends the step in work, or else the next one. Any thread may call it at any time.
    fn cancel(&self) -> PyResult<()> {
        Ok(self.handle.upgrade().map_or(Ok(()), |handle| handle.cancel())?)
    }

    /// Closes the board, and stops a step in flight.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let state = self.lock()?.take();
        py.detach(|| drop(state));
        Ok(())
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }
}
