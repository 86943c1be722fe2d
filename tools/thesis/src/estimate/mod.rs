//! Cycles, memory bandwidth, ports and on-chip memory of a profile, by formula.
//!
//! The formulas give the cost of a step without stalls and waits, and without a run. The emulated
//! board counts the same cycles, plus stalls and waits. All figures follow from the table of
//! profiles ([`interface::profile`](pgs_interface::profile)); [`thesis`] holds the figures of the
//! thesis, for comparison.

mod arrays;
mod blocks;
mod cycles;
mod ports;
mod resources;
mod step;
pub mod thesis;
mod time;
mod traffic;
mod warm;

pub use arrays::OnChipArray;
pub use blocks::{BLOCK_BITS, BLOCKS, BlockShape, ShapedBlocks};
pub use cycles::StepCycles;
pub use ports::{PORTS, PortAccount, PortUse};
pub use resources::{ArrayUse, MemoryUse};
pub use step::StepShape;
pub use time::{PartTime, StepTime};
pub use traffic::{Records, StepTraffic, Transfer};
pub use warm::{WarmCost, WarmStart};
