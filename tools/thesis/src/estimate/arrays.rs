//! The arrays that stay on chip while a step runs.

/// An array that stays on chip while a step runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnChipArray {
    /// Linear and angular velocity of each body.
    Velocities,
    /// World inverse inertia of each body.
    Inertia,
    /// Accumulated impulses of each collision.
    Impulses,
    /// Shape index of each body.
    ShapeIndices,
}

impl OnChipArray {
    /// Whether the array has a row for each body, and not for each collision.
    #[must_use]
    pub const fn is_of_bodies(self) -> bool {
        !matches!(self, Self::Impulses)
    }

    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocities => "velocities",
            Self::Inertia => "world inertia",
            Self::Impulses => "impulses",
            Self::ShapeIndices => "shape indices",
        }
    }
}
