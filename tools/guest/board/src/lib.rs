//! The emulated board as the programmable logic of a guest in QEMU.
//!
//! ```text
//! guest (arm64 Linux)                                      host
//!
//! driver --load/store--> page without rights
//!    ^                        | SIGSEGV
//!    |                        v
//!    |                    pgs-trap --mailbox page--> guest-board: EmulatedBoard
//!    |                                                   |            |
//!    +--- buffers, descriptors: reserved memory <---file-+            |
//!    +--- /dev/uioN <--- GIC <--- SPI 89 <------------------ qtest ---+
//! ```
//!
//! The driver is unmodified: it opens UIO nodes, maps them, and makes volatile accesses.
//! `README.md` tells what this proves, and what it does not.

pub mod guest_file;
pub mod instruction;
pub mod mailbox;
pub mod one_cube;
pub mod qtest;
pub mod server;
pub mod trap;
