//! Runs a program and forwards its accesses to a board's registers to the host.
//!
//! The program is traced. Its mappings of a register region of a UIO node are made without rights;
//! each access then stops the program, and the host makes it in its place. The program needs no
//! change and does not notice the trap.

mod regions;
#[cfg(all(target_arch = "aarch64", target_os = "linux"))]
mod tracer;

use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::UioWindow;

use crate::mailbox::Words;

pub use regions::{Node, Regions};
#[cfg(all(target_arch = "aarch64", target_os = "linux"))]
pub use tracer::{Counts, TraceError, become_traced, run};

impl Words for UioWindow {
    type Error = PlatformError;

    fn load(&self, at: u32) -> Result<u32, PlatformError> {
        self.read32(at)
    }

    fn store(&mut self, at: u32, value: u32) -> Result<(), PlatformError> {
        self.write32(at, value)
    }
}
