//! This file says which faults the emulated board can be told to have.

use crate::axi_dma::Direction;
use crate::interface::control::ErrorCode;

/// A fault that happens once, at the next occasion after it is injected. A reset of the DMA core
/// concerned, or of the accelerator, forgets one that is still due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The next data access of that channel is answered with a decode error.
    DecodeError {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// That channel moves no more beats until its core is reset.
    Stall {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// The accelerator sets its sticky error at its next beat.
    AcceleratorError {
        /// Which.
        code: ErrorCode,
    },
}
