//! Mass properties as C has them.

/// Mass properties that bodies refer to by index.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Shape {
    /// Inverse mass, 1/kg; 0 is static.
    pub inverse_mass: f32,
    /// Diagonal of the inverse inertia about the body's own axes, 1/(kg m^2). Three unequal numbers
    /// need a bitstream with world inertia.
    pub inverse_inertia: [f32; 3],
}

impl From<Shape> for zynq_pgs::Shape {
    fn from(shape: Shape) -> Self {
        let Shape { inverse_mass, inverse_inertia } = shape;
        Self { inverse_inertia, ..Self::isotropic(inverse_mass, 0.0) }
    }
}
