//! The accelerator's control block: identity, arguments, shape table, counters.

mod control;
mod counters;
mod fingerprint;
mod identity;
mod shapes;

use thiserror::Error;

use crate::platform::PlatformError;

pub(crate) use control::{Control, StepArguments};
pub use counters::Saturated;
pub(crate) use counters::{Counters, StickyError, impulse, time_of};
pub(crate) use fingerprint::{Changed, Fingerprint};
#[cfg(test)]
pub(crate) use identity::fake;
pub(crate) use identity::identify;
pub use identity::{Capabilities, IdentityError};

/// Why the accelerator could not be brought into a state.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// A register reads all ones.
    #[error(
        "the control block reads all ones: is the bitstream still loaded and its clock running?"
    )]
    Gone,
    /// The reset did not end in time.
    #[error(
        "the accelerator was expected to be out of reset within {limit:?}, RESET reads \
         {found:#010x}"
    )]
    Reset {
        /// The time limit.
        limit: std::time::Duration,
        /// Value of the register.
        found: u32,
    },
    /// Its registers could not be reached.
    #[error(transparent)]
    Platform(#[from] PlatformError),
}
