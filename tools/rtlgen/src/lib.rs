//! Generates the accelerator's hardware: the equations of a step become an operation graph, the
//! graph a modulo schedule, and the schedule pipelines in Verilog-2001.
//!
//! The parts that a generator would only copy (operators, memories, streams, sequence, registers)
//! are written by hand in `bitstream-model/rtl`.
#![forbid(unsafe_code)]

pub mod design;
pub mod emit;
pub mod ending;
pub mod equations;
pub mod graph;
pub mod operators;
pub mod pool;
pub mod schedule;
pub mod simulator;
pub mod sources;
pub mod verify;
