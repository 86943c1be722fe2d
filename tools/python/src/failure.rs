//! A failed call as an exception of Python.

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use zynq_pgs_c::Status;

create_exception!(
    zynq_pgs,
    Error,
    PyRuntimeError,
    "A call that the driver refused or that failed; `kind` says what to do next."
);

/// The status of a call that failed, and its text.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) text: String,
}

impl Failure {
    pub(crate) fn new(status: Status, text: &str) -> Self {
        Self { status, text: text.to_owned() }
    }

    /// Whether the arguments were refused before the driver saw them.
    pub(crate) fn is_of_arguments(&self) -> bool {
        matches!(self.status, Status::NullPointer | Status::Argument)
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        if failure.is_of_arguments() {
            return PyValueError::new_err(failure.text);
        }
        // The name of the status: again, busy, cancelled, and so on.
        let kind = format!("{:?}", failure.status).to_lowercase();
        let error = Error::new_err(failure.text);
        let named = Python::attach(|py| error.value(py).setattr("kind", kind));
        named.err().unwrap_or(error)
    }
}
