//! Registers, memory, interrupts and time, as a board gives them; the only folder with `unsafe`.

mod buffer;
#[cfg(feature = "emulation")]
mod emulated;
mod fence;
mod mapped;
mod uio;
mod wait;
mod window;

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use bitstream_model::interface::record::Beat;
use thiserror::Error;

pub(crate) use buffer::{BusAddress, CpuBuffer, DeviceBuffer, SharedWords};
#[cfg(feature = "emulation")]
pub(crate) use emulated::EmulatedPlatform;
pub(crate) use fence::{acquire_from_device, release_to_device};
pub use uio::{UIO_CLASS, UioMap, UioNode, uio_nodes};
pub(crate) use wait::{Deadline, poll_until};
pub(crate) use window::{AccessCounts, RegisterMap, RegisterWindow, Window, fields};
#[cfg(test)]
pub(crate) use {uio::fake as uio_fake, window::fake};

/// What the device will do with a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// Read it (MM2S).
    Read,
    /// Write it (S2MM).
    Write,
}

/// A board: its register windows, its memory, its one interrupt, its clock.
///
/// Memory is addressed by the bus address of its first byte, as `allocate` returned it.
pub(crate) trait Platform: fmt::Debug + Send + Sync {
    /// The registers of AXI DMA `core`.
    fn dma_window(&self, core: usize) -> Result<Box<dyn RegisterWindow>, PlatformError>;
    /// The registers of the accelerator.
    fn control_window(&self) -> Result<Box<dyn RegisterWindow>, PlatformError>;

    /// Contiguous memory, aligned to 64 bytes on the bus, owned by the CPU.
    fn allocate(&self, beats: usize) -> Result<(u64, Box<[Beat]>), PlatformError>;
    /// Coherent words that both sides may touch at any time.
    fn allocate_shared(&self, words: usize) -> Result<(u64, Arc<[AtomicU32]>), PlatformError>;
    /// Gives memory to the device.
    fn hand_over(
        &self,
        address: u64,
        beats: Box<[Beat]>,
        access: Access,
    ) -> Result<(), PlatformError>;
    /// Takes memory back that the device has finished with.
    fn take_back(&self, address: u64) -> Result<Box<[Beat]>, PlatformError>;
    /// Frees memory that the CPU owns, or shared words that no engine runs on.
    fn release(&self, address: u64) -> Result<(), PlatformError>;

    /// Time since an arbitrary moment.
    fn now(&self) -> Duration;
    /// Lets time pass.
    fn pause(&self, duration: Duration);
    /// Waits for the interrupt, which masks it; `None` if `timeout` passes first.
    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError>;
    /// Lets the interrupt through again.
    fn unmask_interrupt(&self) -> Result<(), PlatformError>;
}

/// Why the platform could not do what it was asked for.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlatformError {
    /// Memory was refused.
    #[error("cannot {act} DMA memory ({what} {value:#x})")]
    Memory {
        /// What was tried.
        act: &'static str,
        /// What is known of the memory: its length in bytes, or its address.
        what: &'static str,
        /// The length or the address.
        value: u64,
        /// Why.
        #[source]
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Memory lies where the DMA cores cannot reach it.
    #[error(
        "a buffer of {bytes} bytes at {address:#x} is out of reach of DMA cores with \
         {address_width}-bit addresses: reserve memory below 2^{address_width}"
    )]
    OutOfReach {
        /// Bus address of the buffer.
        address: u64,
        /// Its length, bytes.
        bytes: u64,
        /// What the cores can address, bits.
        address_width: u32,
    },
    /// A range does not lie inside its buffer.
    #[error("{bytes} bytes at offset {offset} do not lie in a buffer of {buffer_bytes} bytes")]
    OutOfBuffer {
        /// First byte asked for.
        offset: u64,
        /// Number of bytes asked for.
        bytes: u64,
        /// Length of the buffer, bytes.
        buffer_bytes: u64,
    },
    /// A register region is too short.
    #[error(
        "register region {region} has {found} bytes, at least {expected} are needed: is this the device tree of the bitstream?"
    )]
    ShortRegion {
        /// Name of the region.
        region: String,
        /// Bytes needed.
        expected: u32,
        /// Bytes found.
        found: u64,
    },
    /// A file of the kernel's could not be used.
    #[error("cannot {act} {}", path.display())]
    File {
        /// What was tried.
        act: &'static str,
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// A file of the kernel's says something else than a number.
    #[error("expected a number in {}, found {found:?}", path.display())]
    NotANumber {
        /// Which file.
        path: PathBuf,
        /// What it says.
        found: String,
    },
}
