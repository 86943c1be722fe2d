//! One step, from the caller's bodies to the caller's bodies.

mod board;
mod completion;
mod device;
mod fault;
mod lane;
#[cfg(all(test, feature = "emulation"))]
mod memory_tests;
mod plan;
mod recovery;
mod report;
mod solver;
#[cfg(all(test, feature = "emulation"))]
mod tests;

pub use board::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
pub use fault::{Fault, RegisterDump};
pub use report::{HostTimes, Limit, StepCycles, StepReport};
pub use solver::Accelerator;
