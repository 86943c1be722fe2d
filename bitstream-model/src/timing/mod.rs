//! Cycles, memory bandwidth and on-chip memory of a profile, by formula.
//!
//! What a step costs when nothing stalls: the emulated board counts the same cycles, plus stalls
//! and waits; this module says them without running anything.

mod cycles;
mod resources;

pub use cycles::{PassLimit, StepCycles, StepShape, StepTime};
pub use resources::MemoryUse;
