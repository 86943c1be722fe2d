//! Cycles, memory bandwidth, ports and on-chip memory of a profile, by formula.
//!
//! The formulas give the cost of a step without stalls and waits, and without a run. The emulated
//! board counts the same cycles, plus stalls and waits. All figures follow from the table of
//! profiles ([`interface::profile`](pgs_interface::profile)) and from three designs that are no
//! boards ([`DESIGNS`]); [`thesis`] holds the figures of the thesis, for comparison.

mod blocks;
mod cycles;
mod designs;
mod ports;
mod resources;
mod schedule;
mod step;
pub mod thesis;
mod time;
mod traffic;
mod warm;

pub use blocks::{BLOCK_BITS, BLOCKS, BlockShape, ShapedBlocks};
pub use cycles::StepCycles;
pub use designs::{DESIGNS, MIXED, OnChipArray, WINDOWED, WINDOWED16, Window, words};
pub use ports::{LoadPorts, PORTS, PortAccount, PortUse};
pub use resources::{ArrayUse, MemoryUse};
pub use schedule::{Access, AccessKind, Slot, schedule};
pub use step::StepShape;
pub use time::{PartLimit, PartTime, StepTime};
pub use traffic::{HP_PORT_BITS, HP_PORTS, Records, StepTraffic, StreamDemand, Transfer};
pub use warm::{WarmCost, WarmStart};
