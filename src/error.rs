//! This file holds the public error: what failed, and what the caller can do next.

use thiserror::Error;

/// Why a call failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An earlier fault could not be cleared.
    #[error("the board was given up after an earlier fault: open it again")]
    MustReopen,
}

impl Error {
    /// Whether the input was refused; nothing was sent to the board.
    #[must_use]
    pub fn is_input(&self) -> bool {
        false
    }

    /// Whether the same call may be made again as it is: the board works again.
    #[must_use]
    pub fn may_retry(&self) -> bool {
        false
    }

    /// Whether the board must be opened again first.
    #[must_use]
    pub fn must_reopen(&self) -> bool {
        matches!(self, Self::MustReopen)
    }
}
