//! The state of a body, as the arrays and the records hold it.

/// Position and orientation of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub(crate) position: [f32; 3],
    pub(crate) orientation: [f32; 4],
}

/// Velocities of a body, as they lie in block RAM.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Velocity {
    pub(crate) linear: [f32; 3],
    pub(crate) angular: [f32; 3],
}
