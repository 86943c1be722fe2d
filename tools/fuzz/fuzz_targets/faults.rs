//! The target `faults` for libFuzzer.
#![no_main]
include!("run.rs");
