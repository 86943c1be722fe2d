//! This folder lays records out over the channels of a board, and reads results back from them.

mod deal;
#[cfg(test)]
mod look_tests;
pub(crate) mod pack;
#[cfg(test)]
mod pack_tests;
mod stage;
pub(crate) mod stripe;
pub(crate) mod unpack;
pub(crate) mod writer;
