//! Implements the platform three times: for hardware, for the emulated board, and for a board that
//! another process serves.

#[cfg(feature = "emulation")]
pub(crate) mod emulated;
pub(crate) mod hardware;
#[cfg(feature = "emulation")]
pub(crate) mod served;
