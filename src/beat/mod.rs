//! This folder lays records out over the channels of a board, and reads results back from them.

#[cfg(feature = "bench")]
pub(crate) mod bare;
pub(crate) mod bodies;
mod body_records;
mod collect;
mod collision_records;
pub(crate) mod collisions;
mod deal;
mod format;
#[cfg(test)]
mod look_body_tests;
#[cfg(test)]
mod look_properties;
#[cfg(test)]
mod look_tests;
#[cfg(test)]
mod pack_tests;
mod pattern;
#[cfg(test)]
mod range_tests;
pub(crate) mod ranges;
pub(crate) mod stripe;
pub(crate) mod target;
mod unit;
pub(crate) mod unpack;
pub(crate) mod writer;
