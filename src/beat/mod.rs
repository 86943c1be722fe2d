//! Lays records out over the channels of a board, and reads results back from them.

mod format;
pub(crate) mod pack;
pub(crate) mod stripe;
#[cfg(test)]
mod tests;
pub(crate) mod unpack;
