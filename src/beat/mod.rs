//! This folder lays records out over the channels of a board, and reads results back from them.

pub(crate) mod bodies;
mod body_records;
mod collision_records;
pub(crate) mod collisions;
mod deal;
#[cfg(test)]
mod look_tests;
#[cfg(test)]
mod pack_tests;
#[cfg(test)]
mod range_tests;
pub(crate) mod ranges;
mod stage;
pub(crate) mod stripe;
pub(crate) mod target;
pub(crate) mod unpack;
pub(crate) mod writer;
