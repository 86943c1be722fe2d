//! Records to beats: the records of a step, striped over the channels.

pub(crate) mod bodies;
pub(crate) mod body_records;
pub(crate) mod collisions;
pub(crate) mod encode;
pub(crate) mod impulses;
pub(crate) mod pattern;
pub(crate) mod pool;
pub(crate) mod stripe_writer;
pub(crate) mod target;
pub(crate) mod unrolled;
pub(crate) mod writer;
