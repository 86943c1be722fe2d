//! One step, from the caller's bodies to the caller's bodies.

mod board;
mod bring_up;
mod cancellation;
mod completion;
mod device;
mod echo;
mod fault;
mod in_flight;
mod lane;
#[cfg(all(test, feature = "emulation"))]
mod life_tests;
#[cfg(all(test, feature = "emulation"))]
mod memory_tests;
mod ordering;
mod packing;
mod plan;
mod recovery;
mod report;
mod results;
mod solver;
#[cfg(all(test, feature = "emulation"))]
mod tests;

pub use board::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
pub use cancellation::Cancellation;
pub use fault::{Fault, RegisterDump};
pub use in_flight::InFlight;
pub use report::{HostTimes, Limit, StepCycles, StepReport};
pub use solver::Accelerator;
pub(crate) use {
    board::Found,
    bring_up::{Core, check_given_width, connect, drain_interrupt},
    device::Device,
    echo::{Dirt, ECHO_LIMIT, Echo, Echoed, source_of},
    solver::find,
};
