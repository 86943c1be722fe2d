//! This folder runs a program so that its accesses to a board's registers go to the host.
//!
//! The program is traced. Where it maps a register region of a UIO node, the mapping is made without
//! rights; each access then stops the program, and is made by the host in its place. The program is
//! not changed, and sees neither.

mod regions;
#[cfg(all(target_arch = "aarch64", target_os = "linux"))]
mod tracer;

use zynq_pgs::PlatformError;
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
