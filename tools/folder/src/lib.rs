//! One step as a folder of `.npy` arrays, as the command line tool reads it, and a digest of the
//! state that it leaves.
//!
//! A crate of its own, so that the loader can be driven without a process and a disk.
//! [`replace`] is how every file of results is written.

#![forbid(unsafe_code)]

pub mod digest;
pub mod folder;
pub mod npy;
pub mod replace;
