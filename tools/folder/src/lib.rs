//! One step as a folder of `.npy` arrays, the input of the command line tool, and a digest of its
//! result.
//!
//! This is a crate of its own, so that a fuzzer can drive the loader without a process and a disk.
//! [`replace`] writes every file of results.

#![forbid(unsafe_code)]

pub mod digest;
pub mod folder;
pub mod npy;
pub mod replace;
