//! The target `loads` for libFuzzer.
#![no_main]
include!("run.rs");
