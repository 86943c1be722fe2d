//! A failed call: its status, and its text with every cause.

use std::error::Error as _;

use zynq_pgs::{Error, Fault};

use crate::status::Status;

/// Why a call failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) text: String,
}

impl Failure {
    /// A null pointer.
    pub(crate) fn null(name: &str) -> Self {
        let text = format!("the pointer to the {name} is null: give an address");
        Self { status: Status::NullPointer, text }
    }

    /// An argument that the interface cannot take.
    pub(crate) fn argument(text: impl Into<String>) -> Self {
        Self { status: Status::Argument, text: text.into() }
    }

    /// A call that does not fit the state of the accelerator.
    pub(crate) fn sequence(text: &str) -> Self {
        Self { status: Status::Sequence, text: text.to_owned() }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self { status: status(&error), text: chain(&error) }
    }
}

/// The status of an error of the driver.
fn status(error: &Error) -> Status {
    if matches!(error, Error::OtherProcess { .. }) {
        Status::Forked
    // A board that is lost is lost, also where a cancellation was the cause.
    } else if error.must_reopen() {
        Status::Reopen
    } else if matches!(error.fault(), Some(Fault::Cancelled)) {
        Status::Cancelled
    } else if error.may_retry() {
        Status::Again
    } else if error.is_input() {
        Status::Input
    } else if matches!(error, Error::Open(_)) {
        Status::Open
    } else {
        Status::Failed
    }
}

/// The error, its causes, and the next step after a failure to open a board.
fn chain(error: &Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        source = cause.source();
    }
    if let Some(next) = error.next_step() {
        text.push_str("; ");
        text.push_str(&next);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::InputError;
    use zynq_pgs::error::Aftermath;

    fn step(fault: Fault, aftermath: Aftermath) -> Failure {
        Error::Step { fault: Box::new(fault), aftermath, diagnosis: None }.into()
    }

    #[test]
    fn each_error_of_the_driver_has_the_status_that_says_what_to_do() {
        use Aftermath::{MustReopen, Ready, Untouched};
        let status = |fault, aftermath| step(fault, aftermath).status;
        let gone = || Fault::Gone { region: "a test".to_owned() };
        assert_eq!(status(gone(), Ready), Status::Again);
        assert_eq!(status(gone(), Untouched), Status::Failed);
        assert_eq!(status(gone(), MustReopen), Status::Reopen);
        assert_eq!(status(Fault::Cancelled, Ready), Status::Cancelled);
        assert_eq!(status(Fault::Cancelled, MustReopen), Status::Reopen);
        assert_eq!(Failure::from(Error::MustReopen).status, Status::Reopen);
        assert_eq!(Failure::from(Error::OtherProcess { opener: 1 }).status, Status::Forked);
        assert_eq!(Failure::from(Error::Input(InputError::NoShapes)).status, Status::Input);
    }

    #[test]
    fn the_text_has_the_error_and_its_cause() {
        let failure = step(Fault::NotFinite { body: 3 }, Aftermath::Untouched);
        assert!(failure.text.starts_with("the step was refused and changed nothing"));
        assert!(failure.text.contains(": ") && failure.text.contains("body 3"), "{}", failure.text);
    }
}
