//! The order in which a caller wants the collisions to be solved.

/// A kind of order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Order {
    /// As given, past the board's issue queue if it has one. Sorted collisions use the same body
    /// many times in a row: hazards abound. The board gets an [empty collision](crate::Collision)
    /// as padding, which takes its place among the others.
    AsGiven,
    /// A few hundred places of the list in turn, a window of 8,192 collisions at a time, for a
    /// board whose issue queue keeps the hazards apart that are left. It follows from the number
    /// of collisions alone, so that the host does next to nothing. The board gets an empty
    /// collision as padding.
    Interleaved,
    /// No hazards at all: uses of a body a whole depth apart, empty entries where nothing fits, and
    /// collisions near to their given places, so that packing finds them in the caches. The board
    /// gets no empty collision, and they change no order of the others. For a board without a
    /// queue.
    HazardFree,
}

impl Order {
    /// Whether the order is free of hazards, whatever the window.
    #[must_use]
    pub const fn is_hazard_free(self) -> bool {
        matches!(self, Self::HazardFree)
    }
}
