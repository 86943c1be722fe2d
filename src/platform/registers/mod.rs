//! Reads and writes registers, and keeps a log of the accesses.

pub(crate) mod access_log;
pub(crate) mod map;
pub(crate) mod window;
