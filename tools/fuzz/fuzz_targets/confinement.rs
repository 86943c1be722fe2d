//! The target `confinement` for libFuzzer.
#![no_main]
include!("run.rs");
