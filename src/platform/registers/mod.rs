//! Register windows and the log of their accesses.

pub(crate) mod access_log;
pub(crate) mod window;
