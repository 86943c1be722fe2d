//! Reaches the registers, memory, interrupt and clock of a board, on Linux or emulated.
//!
//! The public types work with any UIO node that has registers, an interrupt and memory for DMA.
//! The accelerator's driver is built on them:
//!
//! ```no_run
//! use std::time::Duration;
//! use zynq_pgs::interface::record::Beat;
//! use zynq_pgs::platform::{ReservedMemory, UioDevice};
//!
//! # fn main() -> Result<(), zynq_pgs::platform::PlatformError> {
//! let mut memory = ReservedMemory::open("my-memory")?;
//! memory.write(0, &[Beat([1, 2, 3, 4])])?;
//!
//! let device = UioDevice::open("my-engine")?;
//! let mut registers = device.window("control")?;
//! device.unmask()?;
//! // The engine's own registers: where to read, and go. Addresses have two halves.
//! registers.write32(0x10, memory.address() as u32)?;
//! registers.write32(0x14, (memory.address() >> 32) as u32)?;
//! registers.write32(0x00, 1)?;
//! if device.wait_interrupt(Duration::from_millis(100))?.is_none() {
//!     // Interrupts get lost: the status register is the truth.
//! }
//! let status = registers.read32(0x04)?;
//! registers.write32(0x04, status)?;
//!
//! let mut answer = [Beat::default()];
//! memory.read(16, &mut answer)?;
//! # Ok(())
//! # }
//! ```

pub(crate) mod boards;
mod error;
mod fence;
pub(crate) mod linux;
pub(crate) mod memory;
mod next_step;
pub(crate) mod registers;
mod wait;

use std::fmt;
use std::time::Duration;

#[cfg(feature = "emulation")]
pub(crate) use boards::emulated::EmulatedPlatform;
pub use boards::hardware::MemoryChoice;
pub(crate) use boards::hardware::{HardwarePlatform, RegisterChoice};
#[cfg(feature = "emulation")]
pub(crate) use boards::served::RemotePlatform;
pub use error::PlatformError;
pub(crate) use error::Result;
pub(crate) use fence::{acquire_from_device, release_to_device};
pub use linux::dev_mem::DevMemWindows;
pub use linux::fpga::{FpgaManager, ManagerChoice, find_manager, fpga_managers, require_bitstream};
pub use linux::lock::DeviceLock;
pub use linux::system::{System, UIO_CLASS, try_node};
pub use linux::uio::{NodePart, UioMap, UioNode};
pub use linux::uio_device::UioDevice;
pub use linux::uio_listing::{UioListing, UnreadableNode, uio_listing, uio_nodes};
pub use linux::uio_window::UioWindow;
pub use memory::Caching;
pub(crate) use memory::DmaMemorySource;
pub(crate) use memory::buffer::{BusAddress, CpuBuffer, DeviceBuffer, Reach, SharedWords};
pub(crate) use memory::guard::GuardPlatform;
pub use memory::reserved::ReservedMemory;
pub use memory::u_dma_buf::{try_u_dma_buf, u_dma_buf_names};
pub(crate) use memory::volatile::{DmaMemory, SharedMemory};
pub use registers::access_log::{AccessKind, RegisterAccess};
pub(crate) use registers::map::{Decoded, RegisterMap, fields};
pub(crate) use registers::window::{AccessCounts, RegisterWindow, Window};
pub(crate) use wait::{Deadline, poll_until};
#[cfg(test)]
pub(crate) use {
    linux::fpga::fake as fpga_fake, linux::uio::fake as uio_fake, registers::window::fake,
};

/// The kernel's name for the manager of the chip's own logic.
pub const ZYNQMP_MANAGER: &str = "Xilinx ZynqMP FPGA Manager";

/// The device's use of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// Read it (MM2S).
    Read,
    /// Write it (S2MM).
    Write,
}

/// A board: its register windows, its memory, its one interrupt, its clock.
pub(crate) trait Platform: fmt::Debug + Send + Sync {
    /// The registers of an AXI DMA or of the accelerator.
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>>;
    /// The memory for DMA.
    fn memory(&self) -> &dyn DmaMemorySource;
    /// The guard: memory outside the fence of the bitstream, for a test of the fence alone; `None`
    /// if none is reserved.
    fn guard(&self) -> Result<Option<Box<dyn DmaMemorySource>>> {
        Ok(None)
    }

    /// Time since an arbitrary moment.
    fn now(&self) -> Duration;
    /// Lets time pass.
    fn pause(&self, duration: Duration);
    /// Waits for the interrupt, which masks it; `None` if `timeout` passes first.
    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>>;
    /// Lets the interrupt through again.
    fn unmask_interrupt(&self) -> Result<()>;

    /// Why the board cannot be reached any more. Its registers are then not touched, and read all
    /// ones.
    fn lost(&self) -> Option<PlatformError> {
        None
    }
    /// Makes sure that the registers may still be touched.
    fn check_present(&self) -> Result<()> {
        self.lost().map_or(Ok(()), Err)
    }
}
