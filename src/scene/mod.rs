//! The input and output of a step: plain data of the caller.

mod body;
mod collision;
mod impulses;
mod order;
mod parameters;
mod shape;
mod structures;

pub use body::{Bodies, Body, BodyArrays, Pose, Velocity};
pub use collision::{CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact};
pub use impulses::{Impulses, WarmCollisions};
pub use order::{Order, Ties};
pub(crate) use parameters::Passes;
pub use parameters::StepParameters;
pub use shape::{Shape, ShapeError};
pub use structures::Structures;
