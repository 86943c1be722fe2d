//! The target `packets` for libFuzzer.
#![no_main]
include!("run.rs");
