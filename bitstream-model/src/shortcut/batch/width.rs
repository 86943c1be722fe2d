//! Chooses how many collisions are computed at a time.

use pgs_support::lanes::{InstructionSet, Work};

/// The number of collisions that are computed at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Width {
    /// One collision after the other.
    One,
    /// One in each lane, by these instructions.
    Lanes(InstructionSet),
}

impl Width {
    /// Every width, the fastest first.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        InstructionSet::all().map(Self::Lanes).chain([Self::One])
    }

    /// The fastest that the processor has.
    pub(crate) fn found() -> Self {
        Self::Lanes(InstructionSet::found())
    }

    /// Runs something with the lanes, or gives it back where there are none.
    #[inline]
    pub(crate) fn run<W: Work<Output = ()>>(self, work: W) -> Result<(), W> {
        match self {
            Self::One => return Err(work),
            Self::Lanes(instructions) => instructions.run(work),
        }
        Ok(())
    }
}
