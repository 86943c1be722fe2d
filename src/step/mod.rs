//! One step, from the caller's bodies to the caller's bodies.

mod accelerator;
mod detached;
mod echo;
mod flight;
mod impulses;
mod in_flight;
mod last_step;
mod locate;
mod ordering;
mod pack;
mod packing;
mod prepared;
pub(crate) mod report;
mod reserve;
mod results;
mod retry;
mod stopwatch;
mod submit;
#[cfg(all(test, feature = "emulation"))]
mod tests;
mod unique_id;
mod written;

pub use accelerator::Accelerator;
pub(crate) use accelerator::find;
pub use detached::Detached;
pub(crate) use echo::{ECHO_LIMIT, Echo, EchoResult, FillPattern, source_of};
pub use in_flight::InFlight;
pub use last_step::{LastStep, Place, PlacedCollisions};
pub use prepared::Prepared;
pub use report::{HostTimes, Limit, OrderChoice, StepCycles, StepReport};
#[cfg(feature = "bench")]
pub(crate) use results::{Results, commit};
