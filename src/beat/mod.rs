//! Lays records out over the channels of a board, and reads results back from them.
//!
//! Records go by blocks that lie in the first cache: rows of 32-bit words ([`record`]), words of
//! the stream ([`format`]), the channels' buffers ([`deal`]).
//!
//! [`record`]: crate::record

pub(crate) mod bodies;
pub(crate) mod collisions;
pub(crate) mod deal;
pub(crate) mod format;
pub(crate) mod impulses;
pub(crate) mod pool;
pub(crate) mod results;
pub(crate) mod stripe;
#[cfg(test)]
mod tests;
pub(crate) mod writer;

use crate::validate::Scene;

/// The design that records are packed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<'a> {
    /// Variant, shapes, and the checks of all input.
    pub(crate) scene: &'a Scene<'a>,
    /// Whether velocity records bring the inverse mass of their body.
    pub(crate) streamed_masses: bool,
}
