//! The arrays that the command line tool reads: one step as a folder of `.npy` files.
//!
//! A library beside the program, so that the loader can be driven without a process and a disk.

#![forbid(unsafe_code)]

pub mod folder;
pub mod npy;
