//! The order in which a caller wants the collisions to be solved.

/// A kind of order.
///
/// [Empty collisions](crate::Collision) change no order of the others. The board gets none of them,
/// but for the order as given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Order {
    /// As given. Sorted collisions use the same body many times in a row: hazards abound. Where a
    /// caller asks for this order, the board gets an empty collision as padding, which takes its
    /// place among the others.
    AsGiven,
    /// No hazards at all and few bodies alive: swept along the longest axis of the scene, with uses
    /// of a body a whole depth apart and empty entries where nothing fits.
    HazardFree,
    /// No hazards at all, and collisions near to their given places. A step then finds the caller's
    /// memory in the caches, and packs sooner. About the same number of bodies are alive as in the
    /// order given.
    ///
    /// Any order has an entry for each collision, and a window between two uses of a body. This
    /// order may be longer than that minimum by one entry in 64 and four windows. If it would be
    /// longer still, or longer than the [limit](crate::order::Orderer::set_limit),
    /// [`Order::HazardFree`] takes its place, and [`Orderer::made`](crate::order::Orderer::made)
    /// tells so.
    HazardFreeNearby,
}

impl Order {
    /// Whether the order is free of hazards, whatever the window.
    #[must_use]
    pub const fn is_hazard_free(self) -> bool {
        matches!(self, Self::HazardFree | Self::HazardFreeNearby)
    }
}
