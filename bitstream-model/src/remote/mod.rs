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
//! [`pgs_interface::message`], [`mark`] and [`connect()`] are what both sides share. The rest is the
//! board's side: it serves one driver after the other. One that vanishes leaves the board as it is,
//! engines running, as a process that is killed leaves a real one.

pub mod mark;

mod connect;
mod connection;
mod lobby;
mod memory_file;
mod server;
mod visit;

pub use connect::connect;
pub use memory_file::{MemoryFile, MemoryFileError};
pub use server::{ServeError, Server, Stopper};
pub use visit::{Ended, Visit};
