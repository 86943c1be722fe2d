//! The contract between the driver and the bitstream: constants and nothing else.
//!
//! Every address, offset, bit, record layout and profile is defined here, once. The driver and the
//! emulated board are two independent implementations of it. `bitstream-model/README.md` is the
//! specification in prose.

pub mod address_map;
pub mod axi_dma;
pub mod control;
pub mod descriptor;
pub mod fence;
pub mod message;
pub mod number;
pub mod profile;
pub mod record;
pub mod register;
pub mod stripe;
pub mod usr_access;
