//! One step, from the caller's bodies to the caller's bodies.

mod bank;
mod board;
#[cfg(test)]
mod board_tests;
mod bring_up;
mod cancellation;
mod completion;
mod device;
mod diagnosis;
mod echo;
mod fault;
#[cfg(all(test, feature = "emulation"))]
mod fault_tests;
mod in_flight;
mod lane;
#[cfg(all(test, feature = "emulation"))]
mod life_tests;
mod load;
mod locate;
#[cfg(all(test, feature = "emulation"))]
mod memory_tests;
#[cfg(all(test, feature = "emulation"))]
mod mistakes;
mod oddities;
mod ordering;
mod packing;
mod phase;
mod plan;
#[cfg(all(test, feature = "emulation"))]
mod planned_tests;
mod prepared;
#[cfg(all(test, feature = "emulation"))]
mod prepared_fault_tests;
#[cfg(all(test, feature = "emulation"))]
mod prepared_tests;
mod recovery;
mod report;
mod results;
mod retry;
mod root_cause;
mod solver;
mod symptom;
#[cfg(all(test, feature = "emulation"))]
mod tampered;
#[cfg(all(test, feature = "emulation"))]
mod tests;
#[cfg(all(test, feature = "emulation"))]
mod wait_tests;
mod written;
#[cfg(all(test, feature = "emulation"))]
mod written_tests;

pub use board::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
pub use cancellation::Cancellation;
pub use diagnosis::{ChannelState, ControlState, Diagnosis};
pub use fault::{AcceleratorError, Awaited, Fault, Subject};
pub use in_flight::InFlight;
pub use phase::Phase;
pub use prepared::Prepared;
pub use report::{HostTimes, Limit, OrderChoice, StepCycles, StepReport};
#[cfg(feature = "bench")]
pub(crate) use results::{Results, commit};
pub use solver::Accelerator;
pub(crate) use {
    board::Found,
    bring_up::{Core, check_given_width, connect, drain_interrupt},
    device::Device,
    echo::{Dirt, ECHO_LIMIT, Echo, Echoed, source_of},
    solver::find,
};
