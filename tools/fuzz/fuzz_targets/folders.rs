//! The target `folders` for libFuzzer.
#![no_main]
include!("run.rs");
