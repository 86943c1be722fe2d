//! The interface of the zynq-pgs accelerator, and a software-emulated board that implements it.
//!
//! [`interface`] is the contract with a bitstream. Everything else, behind the feature
//! `emulation`, is a board that sees register accesses, physical memory and interrupts and nothing
//! of the driver.

pub mod interface;

#[cfg(feature = "emulation")]
mod accelerator;
#[cfg(feature = "emulation")]
mod axi_dma;
#[cfg(feature = "emulation")]
mod board;
#[cfg(feature = "emulation")]
mod body_pace;
#[cfg(feature = "emulation")]
mod bus;
#[cfg(feature = "emulation")]
mod cast;
#[cfg(feature = "emulation")]
mod config;
#[cfg(feature = "emulation")]
mod fault;
#[cfg(feature = "emulation")]
mod handle;
#[cfg(feature = "emulation")]
mod interrupt;
#[cfg(feature = "emulation")]
mod memory;
#[cfg(feature = "emulation")]
mod outside;
#[cfg(feature = "emulation")]
mod pace;
#[cfg(feature = "emulation")]
mod quirks;
#[cfg(feature = "emulation")]
mod recurrence;
#[cfg(all(feature = "emulation", unix))]
pub mod remote;
#[cfg(feature = "emulation")]
mod span;
#[cfg(feature = "emulation")]
mod stream;
#[cfg(feature = "emulation")]
mod stretch;
#[cfg(feature = "emulation")]
pub mod timing;
#[cfg(feature = "emulation")]
mod violation;

#[cfg(feature = "emulation")]
pub use {
    axi_dma::{Direction, PacketCount},
    board::Counts,
    config::{Bandwidth, BoardConfig, ConfigError, Delays, Hazards, Subnormals, THREADS_MAX},
    fault::{Consequence, Fault, FaultError, FaultKind, FaultPlan, Place, StepPhase, When},
    handle::{CpuPort, EmulatedBoard},
    memory::{Denied, DeviceAccess, MemoryError},
    outside::DeviceMemory,
    quirks::{Coherency, InterruptWiring, Quirks, Resettable},
    violation::{RegisterAccess, Violation, ViolationKind},
};
