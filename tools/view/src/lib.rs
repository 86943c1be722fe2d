//! The poses of a run as files: arrays, a page that plays them, and a picture of one moment or
//! of all; and a page that plays a run while it steps.
//!
//! A [`Recording`] keeps the poses of the moving bodies at some steps. [`npz`], [`page`]
//! and [`picture`] turn it into the bytes of a file. Nothing here writes a file.
//!
//! The bits of every result are the same on every machine: arithmetic is written out, angles come
//! from `libm`, and the compressors work on integers.

#![forbid(unsafe_code)]

mod error;
mod kinds;
#[cfg(feature = "live")]
pub mod live;
mod mesh;
pub mod npz;
pub mod page;
pub mod picture;
mod quantise;
mod recording;

pub use error::{TooLarge, ViewError};
pub use recording::{Frame, Recording};
