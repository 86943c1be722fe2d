//! What a caller gives a step and gets back.

mod body;
mod collision;
mod parameters;
mod shape;

pub use crate::beat::pack::source::Structures;
pub use body::{Bodies, Body, BodyArrays, Pose, Velocity};
pub use collision::{CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact};
pub use parameters::StepParameters;
pub use shape::Shape;
