//! One step, from the caller's bodies to the caller's bodies.

mod board;
mod report;
mod solver;

pub use board::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
pub use report::{HostTimes, Limit, StepCycles, StepReport};
pub use solver::Accelerator;
