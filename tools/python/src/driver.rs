//! The calls of the C interface, by types whose addresses are alive.
//!
//! The module exists for functions that take raw pointers, which Rust calls `unsafe`.

#![allow(unsafe_code, reason = "the calls of the C interface, and the address of an array")]

use std::ffi::{CStr, c_void};
use std::ptr::{self, NonNull};

use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::Bound;
use zynq_pgs_c::{
    AcceleratorHandle, BodyArrays, CollisionArray, Parameters, Report, Shape, Status, Strided,
    ZPGS_CONTACT_POINTS, zpgs_cancel, zpgs_close, zpgs_last_error, zpgs_open, zpgs_prepare,
    zpgs_read_impulses, zpgs_set_shapes, zpgs_step, zpgs_submit, zpgs_wait, zpgs_wait_and_start,
};

use crate::failure::Failure;

/// Numbers of the impulses of a collision: four along the normal, two of friction.
pub(crate) const IMPULSES: usize = ZPGS_CONTACT_POINTS + 2;

/// The address of the first element of an array.
pub(crate) fn data(array: &Bound<'_, PyUntypedArray>) -> *mut c_void {
    // SAFETY: the object of an array is the structure of numpy, and `array` keeps it alive.
    unsafe { (*array.as_array_ptr()).fields.data.cast() }
}

/// The structures of a call.
///
/// Invariant: it is a part of `Arrays`, which keeps its arrays alive, so that every address leads
/// to all elements of its array. Threads of Python must not write the arrays during a call, as
/// during numpy's own functions.
pub(crate) struct Call {
    pub(crate) bodies: BodyArrays,
    /// `None` for a call that ends a step.
    pub(crate) collisions: Option<CollisionArray>,
    pub(crate) parameters: Parameters,
}

impl Call {
    /// The collisions; null, which C refuses, where there are none.
    fn collisions(&self) -> *const CollisionArray {
        self.collisions.as_ref().map_or(ptr::null(), ptr::from_ref)
    }

    /// The number of collisions, if the step gives their impulses out.
    pub(crate) fn impulses_out(&self) -> Option<usize> {
        self.collisions.filter(|_| self.parameters.impulses_out == 1).map(|all| all.count)
    }
}

// SAFETY: the addresses lead to memory that any thread may use.
unsafe impl Sync for Call {}

/// An open accelerator. One thread at a time calls it, but for `cancel`.
#[derive(Debug)]
pub(crate) struct Handle(NonNull<AcceleratorHandle>);

// SAFETY: an accelerator may be used, and closed, by any thread.
unsafe impl Send for Handle {}
// SAFETY: it refuses a second call at the same time, so that shared references do no harm.
unsafe impl Sync for Handle {}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: from `zpgs_open`, closed here alone, and no reference to it is left.
        let closed = unsafe { zpgs_close(self.0.as_ptr()) };
        debug_assert_eq!(closed, Status::Ok);
    }
}

impl Handle {
    /// Opens the board that the text names.
    pub(crate) fn open(board: &CStr) -> Result<Self, Failure> {
        let mut handle = ptr::null_mut();
        // SAFETY: a text that ends with a null byte, and a pointer of this function's own.
        let status = unsafe { zpgs_open(board.as_ptr(), &raw mut handle) };
        NonNull::new(handle).map(Self).ok_or_else(|| Failure { status, text: text(ptr::null()) })
    }

    /// The failure of a call that has just ended, if it is one. No other thread has begun a call
    /// since, but for `cancel`, whose text is the thread's.
    fn check(&self, status: Status) -> Result<(), Failure> {
        match status {
            Status::Ok => Ok(()),
            // These two texts are the thread's.
            Status::Busy | Status::Forked => Err(Failure { status, text: text(ptr::null()) }),
            _ => Err(Failure { status, text: text(self.0.as_ptr()) }),
        }
    }

    pub(crate) fn cancel(&self) -> Result<(), Failure> {
        // SAFETY: open as long as `self`.
        self.check(unsafe { zpgs_cancel(self.0.as_ptr()) })
    }

    pub(crate) fn set_shapes(&self, shapes: &[Shape]) -> Result<(), Failure> {
        // SAFETY: open as long as `self`; the slice has this length.
        self.check(unsafe { zpgs_set_shapes(self.0.as_ptr(), shapes.as_ptr(), shapes.len()) })
    }

    pub(crate) fn step(&self, call: &Call) -> Result<Report, Failure> {
        let (Call { bodies, parameters, .. }, collisions) = (call, call.collisions());
        let mut report = empty_report();
        // SAFETY: open as long as `self`; the structures have their sizes, and their arrays are
        // alive and in no other use (the invariant).
        let status =
            unsafe { zpgs_step(self.0.as_ptr(), bodies, collisions, parameters, &raw mut report) };
        self.check(status).map(|()| report)
    }

    /// Starts a step, or packs it where another one is in flight.
    pub(crate) fn submit(&self, call: &Call, second: bool) -> Result<(), Failure> {
        let (Call { bodies, parameters, .. }, collisions) = (call, call.collisions());
        let start = if second { zpgs_prepare } else { zpgs_submit };
        // SAFETY: open as long as `self`; the structures have their sizes, and their arrays are
        // alive and in no other use (the invariant).
        self.check(unsafe { start(self.0.as_ptr(), bodies, collisions, parameters) })
    }

    /// Ends the step in flight, and starts the second one if there is one: the outcome of each.
    pub(crate) fn wait(
        &self,
        call: &Call,
        second: bool,
    ) -> (Result<Report, Failure>, Result<(), Failure>) {
        let (handle, bodies, mut report) =
            (self.0.as_ptr(), &raw const call.bodies, empty_report());
        let (mut started, report_at) = (Status::Ok, &raw mut report);
        let done = match second {
            // SAFETY: open as long as `self`; the arrays are alive and in no other use (the
            // invariant); report and status are this function's own.
            true => unsafe { zpgs_wait_and_start(handle, bodies, report_at, &raw mut started) },
            // SAFETY: open as long as `self`; the arrays are alive and in no other use (the
            // invariant); the report is this function's own.
            false => unsafe { zpgs_wait(handle, bodies, report_at) },
        };
        let done = self.check(done).map(|()| report);
        // The accelerator has the text of one failure.
        let started = match (&done, started) {
            (_, Status::Ok) => Ok(()),
            (Ok(_), status) => self.check(status),
            (Err(_), status) => Err(Failure::new(
                status,
                "the step did not start; the one before it had failed, too: the bodies are as they \
                 were",
            )),
        };
        (done, started)
    }

    /// Stores the impulses of the last step that gave them out.
    pub(crate) fn impulses(&self, into: &mut [f32]) -> Result<(), Failure> {
        let stride = size_of::<[f32; IMPULSES]>();
        let array = Strided { data: into.as_mut_ptr().cast(), stride };
        // SAFETY: open as long as `self`; a slice of these rows, which this call alone uses.
        self.check(unsafe { zpgs_read_impulses(self.0.as_ptr(), array, into.len() / IMPULSES) })
    }
}

/// A report to be filled in.
fn empty_report() -> Report {
    Report { size: size_of::<Report>(), ..Report::default() }
}

/// The text of the last failure, of the accelerator or of the thread.
fn text(of: *const AcceleratorHandle) -> String {
    // SAFETY: null, or open as long as the caller's reference.
    let text = unsafe { zpgs_last_error(of) };
    // SAFETY: it ends with a null byte and stays until the next failure, which no thread causes
    // before this one goes on (`Handle::check`).
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}
