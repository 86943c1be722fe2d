//! The two banks of buffers: the board works on one while the next step is packed into the other.
//!
//! Every port has a buffer in each bank. A step stays in the bank that it was packed into. The
//! second bank gets its memory when a step is first prepared.

use std::ops::{Index, IndexMut};

/// One of the two banks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bank {
    First,
    Second,
}

impl Bank {
    pub(crate) const BOTH: [Self; 2] = [Self::First, Self::Second];

    /// The other bank.
    pub(crate) const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// One `T` per bank.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PerBank<T>([T; 2]);

impl<T> Index<Bank> for PerBank<T> {
    type Output = T;

    fn index(&self, bank: Bank) -> &T {
        match bank {
            Bank::First => &self.0[0],
            Bank::Second => &self.0[1],
        }
    }
}

impl<T> IndexMut<Bank> for PerBank<T> {
    fn index_mut(&mut self, bank: Bank) -> &mut T {
        match bank {
            Bank::First => &mut self.0[0],
            Bank::Second => &mut self.0[1],
        }
    }
}
