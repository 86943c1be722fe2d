//! How to build an emulated board, as one text.
//!
//! ```
//! use zynq_pgs::emulation::Build;
//!
//! # fn main() -> Result<(), zynq_pgs::emulation::BuildError> {
//! let build: Build = "half,f32,unchecked,threads=1".parse()?;
//! assert_eq!(build.config().profile.name, "half");
//! assert_eq!(build.to_string(), "half,f32,unchecked,threads=1");
//! # Ok(())
//! # }
//! ```
//!
//! A text is a list that begins with the profile; the other options follow in any order. A number,
//! and `on` and `off`, stand behind the option's key, every other name alone.
//!
//! | key | values | default |
//! |---|---|---|
//! | `profile` | the name of a [profile](pgs_interface::profile::PROFILES) | `float` |
//! | `arithmetic` | precision of the operators: `f32`, `binary16` | the profile's |
//! | `hazards` | on a hazard wait, or read the stale velocity: `interlocked`, `unchecked` | `interlocked` |
//! | `queue` | depth of the issue queue in collisions, 0 for none; only an interlocked `float` has one | the profile's |
//! | `window` | hazard window in issue slots | the profile's |
//! | `inertia` | inertia of a body, equal about every axis or any: `isotropic`, `world` | `isotropic` |
//! | `bandwidth` | memory bandwidth in GB/s, or `unlimited` | 12.8 |
//! | `length-width` | width of the DMA length registers, bits | 26 |
//! | `address-width` | width of DMA addresses, bits | 40 |
//! | `fence` | the only memory that the DMA cores reach, as `0x50000000+64M` | none |
//! | `threads` | threads of this machine for the board's arithmetic; no result depends on them | one per processor, at most 4 |
//! | `fast` | take whole steps at once, `on` or `off`; no result depends on it | `on` |
//!
//! [`OpenOptions::emulated`](crate::OpenOptions::emulated) opens such a board. Its builder's
//! handle, which tells violations and injects faults, is in [`model`](crate::model):
//!
//! ```
//! use zynq_pgs::model::EmulatedBoard;
//! use zynq_pgs::{Accelerator, BoardChoice, OpenOptions, emulation::Build};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let build: Build = "float,world".parse()?;
//! let board = EmulatedBoard::new(build.config())?;
//! let choice = BoardChoice::Emulated(board.cpu_port());
//! let accelerator = Accelerator::open(OpenOptions { board: choice, ..OpenOptions::default() })?;
//! # drop(accelerator);
//! assert!(board.violations().is_empty());
//! # Ok(())
//! # }
//! ```

mod build;
mod options;
#[cfg(test)]
mod tests;
mod text;
mod values;

pub use build::Build;
pub use text::BuildError;
