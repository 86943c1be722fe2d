//! This file opens a board: the one place that knows every kind.

use std::fmt;

/// How to open the accelerator. The default takes whatever board is there.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Which board.
    pub board: BoardChoice,
    /// Width of the DMA cores' length registers, bits; `None` believes the bitstream. Either is
    /// checked against the cores themselves.
    pub length_width: Option<u32>,
}

/// Which board to open.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum BoardChoice {
    /// The UIO node `pgs` if there is one, else an emulated board, which is said at warn level.
    #[default]
    Automatic,
    /// The UIO node of that name (`linux,uio-name`).
    Uio {
        /// The name, as in `/sys/class/uio/uio*/name`.
        node: String,
    },
}

/// What kind of board was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardKind {
    /// A software-emulated board.
    Emulated,
    /// A board behind a UIO node.
    Uio,
}

/// Which board was opened, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct BoardDescription {
    /// What kind.
    pub kind: BoardKind,
    /// Its name: the UIO node, or "emulated".
    pub name: String,
    /// Why this board and no other.
    pub reason: String,
}

impl fmt::Display for BoardDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.reason)
    }
}
