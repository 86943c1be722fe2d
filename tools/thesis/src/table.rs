//! The origin of a row's figures, beside the tables of every command.

pub(crate) use pgs_command::output::table::{Cell, Table, anchor, escaped, text};

/// The origin of a row's figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Counted.
    Exact,
    /// Computed by a cycle, memory or bandwidth model.
    Modelled,
    /// Taken from the thesis.
    Recorded,
    /// Unknown.
    Open,
}

impl Kind {
    pub(crate) fn cell(self) -> Cell {
        text(match self {
            Self::Exact => "exact",
            Self::Modelled => "modelled",
            Self::Recorded => "recorded",
            Self::Open => "open",
        })
    }
}
