//! This file is the accelerator as a caller sees it.

use super::board::{BoardDescription, OpenOptions};
use super::report::StepReport;
use crate::accelerator::Capabilities;
use crate::error::Error;
use crate::scene::{Bodies, Collisions, Shape, StepParameters};

/// An open accelerator.
#[derive(Debug)]
pub struct Accelerator {
    board: BoardDescription,
    capabilities: Capabilities,
}

impl Accelerator {
    /// Opens a board and identifies its bitstream.
    ///
    /// # Errors
    /// No board, or not a bitstream that this driver knows.
    pub fn open(options: OpenOptions) -> Result<Self, Error> {
        let _ = options;
        Err(Error::MustReopen)
    }

    /// Which board was opened, and why.
    #[must_use]
    pub fn board(&self) -> &BoardDescription {
        &self.board
    }

    /// What the bitstream says of itself.
    #[must_use]
    pub fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Loads the shapes that bodies refer to by index.
    ///
    /// # Errors
    /// A shape that the bitstream cannot take; nothing was sent.
    pub fn set_shapes(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        let _ = shapes;
        Err(Error::MustReopen)
    }

    /// Solves and integrates one step.
    ///
    /// # Errors
    /// Bad input (nothing was sent), or a fault of the board. The bodies are as they were.
    pub fn step<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &mut B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<StepReport, Error> {
        let _ = (bodies, collisions, parameters);
        Err(Error::MustReopen)
    }
}
