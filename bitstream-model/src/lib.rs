//! A software-emulated board with the zynq-pgs accelerator.
//!
//! The board sees register accesses, physical memory and interrupts, and nothing of the driver. It
//! follows the contract of [`interface`], as a bitstream does.

mod accelerator;
mod arbiter;
mod axi_dma;
mod board;
mod cast;
mod config;
pub mod external;
mod fast;
mod fault;
mod handle;
mod memory;
pub mod recording;
pub mod reference;
#[cfg(unix)]
pub mod remote;
mod stream;
mod violation;

pub use crate::violation::{RegisterAccess, Violation, ViolationKind};
pub use axi_dma::PacketCount;
pub use board::Counts;
pub use config::quirks::{Coherency, InterruptWiring, Master, Quirks, Resettable};
pub use config::{Bandwidth, BoardConfig, ConfigError, Delays, Hazards, THREADS_MAX};
pub use fault::{Consequence, Fault, FaultError, FaultKind, FaultPlan, Place, StepPhase, When};
pub use handle::{CpuPort, EmulatedBoard};
pub use memory::external::{ByteMemory, DeviceMemory};
pub use memory::{Denied, DeviceAccess, MemoryError};
pub use pgs_interface as interface;
pub use pgs_interface::axi_dma::Direction;
