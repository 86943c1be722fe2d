//! The order in which a caller wants the collisions to be solved.

/// A kind of order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Order {
    /// As given. Sorted collisions use the same body many times in a row: hazards abound.
    AsGiven,
    /// Body by body, as the thesis proposes (§4.7): few bodies alive, nearly every use a hazard.
    BodyByBody(Ties),
    /// By colour, no body twice in a colour: no hazards if colours are large, but nearly all bodies
    /// alive at once.
    Colours,
    /// No hazards at all and few bodies alive: swept along the longest axis of the scene, with uses
    /// of a body a whole depth apart and empty entries where nothing fits.
    HazardFree,
    /// No hazards at all, and hardly a collision far from where it was given: what a step reads of the
    /// caller's memory is in the caches, so that it is packed sooner. About as many bodies are alive as in
    /// the order given. Any order has an entry for each collision, and a window between two uses of a body:
    /// where this one would be longer than that by more than one entry in 64 and four windows, or longer
    /// than the [limit](crate::order::Orderer::set_limit), it is [`Order::HazardFree`] instead, and [`Orderer::made`](crate::order::Orderer::made) says so.
    HazardFreeNearby,
}

impl Order {
    /// Whether no hazard is in it, whatever the window.
    #[must_use]
    pub const fn is_hazard_free(self) -> bool {
        matches!(self, Self::HazardFree | Self::HazardFreeNearby)
    }
}

/// Which of the active bodies with the fewest collisions left comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ties {
    /// That of the lowest index.
    LowestIndex,
    /// That which became active first.
    Oldest,
    /// That which became active last.
    Newest,
}
