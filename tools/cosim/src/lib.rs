//! Runs the accelerator as beats in and beats out: the generated Verilog in a simulator beside the
//! model, on the same beats, or against recorded results.
//!
//! ```text
//! scene (recorded or random) -> packets -> accelerator (RTL, model) -> outcome -> difference
//! ```
//!
//! The packets are made here, by the specification, and not by the driver's packer: the bench
//! shares no mistake with the driver.
#![forbid(unsafe_code)]

pub mod accesses;
pub mod crowded;
pub mod flaws;
pub mod full;
pub mod mutation;
pub mod outcome;
pub mod packets;
pub mod random;
pub mod recorded;
pub mod refusal;
pub mod scene;
