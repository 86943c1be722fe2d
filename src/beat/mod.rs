//! Lays records out over the channels of a board, and reads results back from them.

#[cfg(feature = "bench")]
pub(crate) mod bare;
mod format;
pub(crate) mod pack;
pub(crate) mod stripe;
#[cfg(test)]
mod tests;
pub(crate) mod unpack;
