//! The poses of a run as files: arrays, glTF, a page that plays them, and a picture of one moment.
//!
//! A [`Recording`] keeps the poses of the moving bodies at some steps. [`npz`], [`gltf`] and
//! [`page`] turn it into the bytes of a file; [`picture`] draws bodies without one. Nothing here
//! writes a file.
//!
//! The bits of every result are the same on every machine: arithmetic is written out, angles come
//! from `libm`, and the compressors work on integers.

#![forbid(unsafe_code)]

mod error;
pub mod gltf;
mod kinds;
mod mesh;
pub mod npz;
pub mod page;
pub mod picture;
mod quantise;
mod recording;

pub use error::{TooLarge, ViewError};
pub use recording::{Frame, Recording};
