//! Decodes the collisions of a step once, and computes its passes when somebody can see them.

pub(crate) mod bodies;
pub(crate) mod decode_once;
pub(crate) mod eligible;
pub(crate) mod passes;
