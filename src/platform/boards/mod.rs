//! The three kinds of board: hardware, emulated, served by another process.

#[cfg(feature = "emulation")]
pub(crate) mod emulated;
pub(crate) mod hardware;
#[cfg(feature = "emulation")]
pub(crate) mod served;
