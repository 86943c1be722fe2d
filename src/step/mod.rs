//! One step, from the caller's bodies to the caller's bodies.

mod board;
mod bring_up;
mod completion;
#[cfg(all(test, feature = "emulation"))]
mod confinement_tests;
mod device;
mod diagnosis;
mod echo;
mod fault;
mod lane;
mod locate;
#[cfg(all(test, feature = "emulation"))]
mod memory_tests;
mod oddities;
mod ordering;
mod phase;
mod plan;
mod recovery;
mod report;
mod retry;
mod root_cause;
mod solver;
mod symptom;
#[cfg(all(test, feature = "emulation"))]
mod tests;

pub use board::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
pub use diagnosis::{ChannelState, ControlState, Diagnosis};
pub use fault::{AcceleratorError, Awaited, Fault, Subject};
pub use phase::Phase;
pub use report::{HostTimes, Limit, StepCycles, StepReport};
pub use solver::Accelerator;
pub(crate) use {
    board::Found,
    bring_up::{Core, check_given_width, connect, drain_interrupt},
    device::Device,
    echo::{Dirt, ECHO_LIMIT, Echo, Echoed, source_of},
    solver::find,
};
