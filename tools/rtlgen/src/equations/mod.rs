//! The equations of the three pipelines, as the interface specification gives them in §7.
//!
//! Each module quotes its part of the specification and builds it in the same order; where the
//! hardware takes another way to the same bits, the reason stands beside it. All numbers of a graph
//! have one precision.
//! The initial impulses are 0, which the core feeds in the first passes. In a warm pass it feeds
//! the given ones in their place.

mod contact;
mod friction;
mod integration;
mod row;

pub use contact::contact;
pub use friction::friction;
pub use integration::integration;
