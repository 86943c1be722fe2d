//! The target `calls` for libFuzzer.
#![no_main]
include!("run.rs");
