//! Tests of the emulated board as a driver sees it: registers, descriptors, memory and the
//! interrupt.
//!
//! One program, as each more would be linked with all of the crate.

#[path = "../common/mod.rs"]
mod common;

mod accelerator;
mod direct;
mod fast;
mod faults;
mod fence;
mod float_environment;
mod formats;
mod profiles;
mod properties;
mod queue;
mod quirks;
mod recording;
mod registers;
mod scatter_gather;
