//! The interface of the zynq-pgs accelerator, and a software-emulated board that implements it.
//!
//! [`interface`] is the contract with a bitstream. Everything else, behind the feature
//! `emulation`, is a board that sees register accesses, physical memory and interrupts and nothing
//! of the driver.

pub mod interface;
