//! The input and output of a step: plain data of the caller.

mod body;
mod collision;
mod collisions;
mod impulses;
mod order;
mod parameters;
mod passes;
mod shape;
mod structures;
mod tangents;

pub use body::{Bodies, Body, BodyArrays, Pose, Real, Velocity};
pub use collision::{CONTACT_POINTS, Collision, Contact};
pub use collisions::{CollisionArrays, Collisions, WarmCollisions};
pub use impulses::Impulses;
pub use order::Order;
pub use parameters::StepParameters;
pub(crate) use passes::Passes;
pub use shape::{Shape, ShapeError};
pub use structures::Structures;
pub(crate) use tangents::{along, in_world};
