//! A board in another process: its registers, interrupt and time go through a Unix socket, its
//! memory is a file that both processes open.
//!
//! ```text
//! driver's process                              board's process
//!   register accesses, waits --> requests  -->    Server   --> EmulatedBoard
//!                            <-- answers   <--
//!   DMA buffers ---------------> the file <---------------------- DMA engines
//! ```
//!
//! Both sides share [`pgs_interface::message`], [`mark`] and [`connect()`]. The rest is the board's
//! side: it serves one driver after the other. A driver that vanishes leaves the board as it is,
//! engines running, as a killed process leaves a real board.

pub mod mark;

mod connect;
mod connection;
mod memory_file;
mod pending;
mod server;
mod visit;

pub use connect::connect;
pub use memory_file::{MemoryFile, MemoryFileError};
pub use server::{ServeError, Server, Stopper};
pub use visit::{Ended, Visit};
