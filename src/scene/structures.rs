//! Collisions that a caller keeps as structures, which a step reads in place.

use super::Collision;

/// Where collisions lie ([`Collisions::structures`](crate::scene::Collisions::structures)).
#[derive(Debug, Clone, Copy)]
pub enum Structures<'a> {
    /// One behind the other, in their order.
    Array(&'a [Collision]),
    /// In an order of their own.
    Ordered {
        /// One behind the other.
        all: &'a [Collision],
        /// Where each of them lies in `all`. Beyond its end is one without contact points, which has no
        /// effect, and which a step refuses if it is a caller's.
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

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
