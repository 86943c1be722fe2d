//! The target `registers` for libFuzzer.
#![no_main]
include!("run.rs");
