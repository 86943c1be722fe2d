//! Lets a board save time of its host through one interface.
//!
//! A board without a [`ShortCut`] is the reference: it moves beats and computes records slice by
//! slice. A short cut must not change any state that a driver or a test can observe.

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

    /// Lets whole slices of a stretch pass while only beats and records flow. Returns the number of
    /// cycles; the parts in `stretch` are in their state after these cycles.
    fn fast_forward(&mut self, stretch: Stretch<'_>) -> u64;
}

/// A stretch of time in which no fault is due, no packet ends on a stream, and the host does
/// nothing.
#[derive(Debug)]
pub(crate) struct Stretch<'a> {
    pub(crate) now: u64,
    /// The cycle of the host's next act.
    pub(crate) until: u64,
    pub(crate) accelerator: &'a mut Accelerator,
    /// One core for each input.
    pub(crate) cores: &'a mut [Core],
    pub(crate) inputs: &'a mut [Stream],
    pub(crate) outputs: &'a mut [Stream],
    pub(crate) memory: &'a mut Memory,
    pub(crate) moved: &'a mut Moved,
    pub(crate) arbiter: Arbiter,
    pub(crate) turn: &'a mut Turn,
}
