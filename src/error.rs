//! The public error: what failed, and what the caller can do next.

use thiserror::Error;

use crate::axi_dma::DmaError;
use crate::control_block::{ControlError, IdentityError};
#[cfg(feature = "emulation")]
use crate::emulation::BuildError;
use crate::fault::{Diagnosis, Fault};
use crate::platform::PlatformError;
use crate::scene::ShapeError;
use crate::validate::InputError;

/// Why a call failed. The cause is the [`source`](std::error::Error::source).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// The input was refused, before anything of it was sent to the board.
    #[error(transparent)]
    Input(#[from] InputError),
    /// No board could be opened.
    #[error("cannot open a board")]
    Open(#[from] OpenError),
    /// A step failed; the caller's bodies are as they were.
    #[error("{}", match aftermath {
        Aftermath::Ready => "the step failed and changed nothing; the board was reset and is \
                             ready for the next",
        Aftermath::Untouched => "the step was refused and changed nothing; the board is ready for \
                                 the next",
        Aftermath::MustReopen => "the step failed and changed nothing; the board could not be \
                                  reset: open it again",
    })]
    Step {
        /// The cause.
        #[source]
        fault: Box<Fault>,
        /// The state of the board after the failure.
        aftermath: Aftermath,
        /// The state of every channel before the reset; `None` if the board had no part in the
        /// failure or cannot be reached.
        diagnosis: Option<Box<Diagnosis>>,
    },
    /// An earlier fault could not be cleared.
    #[error("the board was given up after an earlier fault: open it again")]
    MustReopen,
    /// The call came from another process than the one that opened the accelerator: from a child
    /// that was forked since. No register was touched. A child that drops the accelerator frees
    /// memory of its own alone.
    #[error(
        "the accelerator belongs to process {opener}, which opened it, and this is a process \
         forked from it: open a board after the fork, in the process that uses it"
    )]
    OtherProcess {
        /// Number of the process that opened it.
        opener: u32,
    },
}

/// The state of the board after a failed step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aftermath {
    /// It was reset and works again: the same call may be made again.
    Ready,
    /// It works; the same call would fail in the same way.
    Untouched,
    /// It could not be reset.
    MustReopen,
}

impl From<ShapeError> for Error {
    fn from(error: ShapeError) -> Self {
        Self::Input(error.into())
    }
}

impl Error {
    /// The cause of the failure, if a step failed.
    #[must_use]
    pub fn fault(&self) -> Option<&Fault> {
        match self {
            Self::Step { fault, .. } => Some(fault),
            _ => None,
        }
    }

    /// The state of every channel when a step had failed, before the reset.
    #[must_use]
    pub fn diagnosis(&self) -> Option<&Diagnosis> {
        match self {
            Self::Step { diagnosis, .. } => diagnosis.as_deref(),
            _ => None,
        }
    }

    /// Whether the input was refused, before anything of it was sent to the board.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Input(_))
    }

    /// Whether the same call may be made again as it is: the board works again.
    #[must_use]
    pub fn may_retry(&self) -> bool {
        matches!(self, Self::Step { aftermath: Aftermath::Ready, .. })
    }

    /// The user's next step after a failure to open a board, if it depends on the kernel's answer
    /// and is not in the messages.
    #[must_use]
    pub fn next_step(&self) -> Option<String> {
        match self {
            Self::Open(OpenError::Platform(error)) => error.next_step(),
            _ => None,
        }
    }

    /// Whether the board must be opened again first.
    #[must_use]
    pub fn must_reopen(&self) -> bool {
        match self {
            Self::MustReopen | Self::OtherProcess { .. } => true,
            Self::Step { aftermath, .. } => *aftermath == Aftermath::MustReopen,
            _ => false,
        }
    }
}

impl From<BoardTextError> for Error {
    fn from(error: BoardTextError) -> Self {
        Self::Open(error.into())
    }
}

/// A text that names no board.
#[derive(Debug, Clone, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardTextError {
    /// There is no such kind of board.
    #[error(
        "found {found:?} as a board: give auto, uio[:NODE], devmem, emulated[:BUILD] or socket:PATH"
    )]
    Unknown {
        /// The text.
        found: String,
    },
    /// The build of an emulated board is wrong.
    #[cfg(feature = "emulation")]
    #[error(transparent)]
    Build(#[from] BuildError),
    /// An emulated board, here or in another process, and no emulation.
    #[cfg(not(feature = "emulation"))]
    #[error(
        "an emulated board is asked for, and this build has none: name a real board, or build with \
         the feature `emulation`"
    )]
    NoEmulation,
}

/// Why no board could be opened.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system has no node of the board, and this build no emulated board.
    #[error(
        "{reason}, and this build has no emulated board: load the overlay, or build with the \
         feature `emulation`"
    )]
    NoEmulation {
        /// The missing node, in words.
        reason: String,
    },
    /// The text that names the board is wrong.
    #[error(transparent)]
    Text(#[from] BoardTextError),
    /// Memory was chosen for an emulated board.
    #[error("an emulated board has memory of its own: leave out the choice of memory")]
    EmulatedMemory,
    /// A length width that no DMA core can have.
    #[error("the length width must be {low} to {high} bits, found {found}")]
    LengthWidth {
        /// The requested width.
        found: u32,
        /// The narrowest.
        low: u32,
        /// The widest.
        high: u32,
    },
    /// Registers, memory, files.
    #[error(transparent)]
    Platform(#[from] PlatformError),
    /// The bitstream is not one for this driver.
    #[error(transparent)]
    Identity(#[from] IdentityError),
    /// The capabilities changed while the board was opened.
    #[error(
        "the capabilities have changed while the board was opened: was another bitstream loaded, \
         or the power lost? open it again, with nobody loading one"
    )]
    OtherBitstream,
    /// A DMA core did not follow.
    #[error(transparent)]
    Core(#[from] DmaError),
    /// The control block did not follow.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The emulated board could not be built.
    #[cfg(feature = "emulation")]
    #[error("cannot build the emulated board")]
    Emulation(#[from] bitstream_model::ConfigError),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(aftermath: Aftermath) -> Error {
        Error::Step { fault: Box::new(Fault::NotFinite { body: 3 }), aftermath, diagnosis: None }
    }

    #[test]
    fn each_error_says_what_to_do_next() {
        let answers = |error: &Error| (error.is_input(), error.may_retry(), error.must_reopen());
        assert_eq!(answers(&Error::Input(InputError::NoShapes)), (true, false, false));
        assert_eq!(answers(&step(Aftermath::Ready)), (false, true, false));
        assert_eq!(answers(&step(Aftermath::Untouched)), (false, false, false));
        assert_eq!(answers(&step(Aftermath::MustReopen)), (false, false, true));
        assert_eq!(answers(&Error::MustReopen), (false, false, true));
        assert_eq!(answers(&Error::OtherProcess { opener: 1 }), (false, false, true));
    }

    #[test]
    fn the_cause_is_the_source_and_not_in_the_text() {
        let error = step(Aftermath::Ready);
        let source = std::error::Error::source(&error).expect("a fault").to_string();
        assert!(source.contains("body 3") && !error.to_string().contains("body 3"));
    }
}
