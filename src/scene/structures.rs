//! Collisions that a caller keeps as structures. A step reads them in place.

use super::Collision;

/// Collisions in memory ([`Collisions::structures`](crate::scene::Collisions::structures)).
#[derive(Debug, Clone, Copy)]
pub enum Structures<'a> {
    /// An array in the order of the collisions.
    Array(&'a [Collision]),
    /// An array, and the order of the collisions in it.
    Ordered {
        /// The array.
        all: &'a [Collision],
        /// The index of each collision in `all`. An index past the end stands for an empty
        /// collision, whose count is 0.
        order: &'a [u32],
    },
}

impl Structures<'_> {
    /// Number of collisions.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Array(all) => all.len(),
            Self::Ordered { order, .. } => order.len(),
        }
    }

    /// Whether there are no collisions.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
