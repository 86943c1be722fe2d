//! The target `chains` for libFuzzer.
#![no_main]
include!("run.rs");
