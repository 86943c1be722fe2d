//! A software-emulated board with the zynq-pgs accelerator.
//!
//! The board sees register accesses, physical memory and interrupts, and nothing of the driver. It
//! follows the contract of [`interface`], as a bitstream does.

mod accelerator;
mod axi_dma;
mod board;
mod cast;
mod config;
pub mod estimate;
mod fault;
mod handle;
mod memory;
#[cfg(unix)]
pub mod remote;
mod shortcut;

pub use pgs_interface as interface;
pub use {
    axi_dma::{Direction, PacketCount},
    board::Counts,
    board::violation::{RegisterAccess, Violation, ViolationKind},
    config::quirks::{Coherency, InterruptWiring, Quirks, Resettable},
    config::{Bandwidth, BoardConfig, ConfigError, Delays, Hazards, Subnormals, THREADS_MAX},
    fault::{Consequence, Fault, FaultError, FaultKind, FaultPlan, Place, StepPhase, When},
    handle::{CpuPort, EmulatedBoard},
    memory::external::DeviceMemory,
    memory::{Denied, DeviceAccess, MemoryError},
};
