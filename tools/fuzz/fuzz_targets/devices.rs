//! The target `devices` for libFuzzer.
#![no_main]
include!("run.rs");
