//! The target `answers` for libFuzzer.
#![no_main]
include!("run.rs");
