//! The accelerator's control block.

mod identity;

pub use identity::Capabilities;
