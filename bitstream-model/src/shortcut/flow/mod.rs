//! Counts beats that flow undisturbed instead of moving them one by one.

pub(crate) mod bodies;
pub(crate) mod collisions;
pub(crate) mod dma;
pub(crate) mod fast_forward;
pub(crate) mod periods;
