//! This file says what a shape is: the mass properties that bodies refer to by index.

/// Mass properties shared by bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Inverse mass, 1/kg; 0 is static.
    pub inverse_mass: f32,
    /// Diagonal of the inverse inertia, 1/(kg m²). The three must be equal: anisotropic shapes are
    /// refused.
    pub inverse_inertia: [f32; 3],
}

impl Shape {
    /// A shape that never moves.
    pub const STATIC: Self = Self { inverse_mass: 0.0, inverse_inertia: [0.0; 3] };

    /// A shape whose inertia is the same about every axis (cube, sphere).
    #[must_use]
    pub const fn isotropic(inverse_mass: f32, inverse_inertia: f32) -> Self {
        Self { inverse_mass, inverse_inertia: [inverse_inertia; 3] }
    }
}
