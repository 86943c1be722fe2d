//! A board in another process: its registers, interrupt and time go through a Unix socket, its
//! memory is a file without a name that comes through that socket.
//!
//! ```text
//! driver's process                              board's process
//!   register accesses, waits --> requests  -->    Server   --> EmulatedBoard
//!                            <-- answers   <--
//!   DMA buffers ---------------> the file <---------------------- DMA engines
//! ```
//!
//! Both sides share [`pgs_interface::message`], [`connect()`], [`receive_files`] and [`SEALS`]. The
//! rest is the board's side: it serves one driver after the other, each with memory of its own. A
//! driver that vanishes leaves the board as it is, engines running, as a killed process leaves a
//! real board; its memory stays until they are stopped.

mod connect;
mod connection;
mod memory;
mod passing;
mod pending;
mod server;
mod visit;

pub use connect::connect;
pub use connection::Ended;
pub use memory::{MemoryError, SEALS};
pub use passing::{receive_files, send_file};
pub use server::{ServeError, Server, Stopper};
pub use visit::Visit;
