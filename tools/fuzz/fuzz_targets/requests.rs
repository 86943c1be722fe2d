//! The target `requests` for libFuzzer.
#![no_main]
include!("run.rs");
