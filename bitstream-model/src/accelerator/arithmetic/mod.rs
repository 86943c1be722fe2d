//! The arithmetic of the accelerator, number format by number format.

pub(crate) mod inertia;
pub(crate) mod number;
pub(crate) mod sixteen;
pub(crate) mod vector;
