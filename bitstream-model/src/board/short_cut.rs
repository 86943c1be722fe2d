//! The seam through which a board may save time of its host.
//!
//! A board without a [`ShortCut`] is the reference: it moves beats and computes records slice by
//! slice. One with a short cut must show the same to everybody who looks.

use std::fmt;

use super::arbiter::{Arbiter, Turn};
use crate::accelerator::Accelerator;
use crate::accelerator::defer::Defer;
use crate::axi_dma::{Core, Moved};
use crate::memory::Memory;
use crate::stream::Stream;

/// Defers the accelerator's arithmetic, and lets undisturbed time pass at once.
pub(crate) trait ShortCut: fmt::Debug + Send {
    /// The accelerator's part of the short cut.
    fn defer(&mut self) -> &mut (dyn Defer + 'static);

    /// Lets whole slices of a stretch pass, as long as nothing but beats and records flows in them.
    /// Returns the cycles that have passed, and everything in the stretch is as it is after them.
    fn fast_forward(&mut self, stretch: Stretch<'_>) -> u64;
}

/// A stretch of time in which no fault is due, no packet ends on a stream, and the host does
/// nothing.
#[derive(Debug)]
pub(crate) struct Stretch<'a> {
    pub(crate) now: u64,
    /// The host does something then.
    pub(crate) until: u64,
    pub(crate) accelerator: &'a mut Accelerator,
    /// As many as there are inputs.
    pub(crate) cores: &'a mut [Core],
    pub(crate) inputs: &'a mut [Stream],
    pub(crate) outputs: &'a mut [Stream],
    pub(crate) memory: &'a mut Memory,
    pub(crate) moved: &'a mut Moved,
    pub(crate) arbiter: Arbiter,
    pub(crate) turn: &'a mut Turn,
}
