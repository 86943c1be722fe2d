//! Shared by the commands of `pgs` and the experiments of the thesis part: options, an open board,
//! its failures, and output.

#![forbid(unsafe_code)]

pub mod board;
pub mod common;
pub mod diagnosis;
pub mod environment;
pub mod failure;
pub mod interrupt;
pub mod numbers;
pub mod options;
pub mod output;
pub mod pile;
pub mod step_input;
