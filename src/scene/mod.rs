//! What a caller gives a step and gets back.

mod body;
mod carriers;
mod collision;
mod input_error;
mod parameters;
mod shape;
mod structures;
pub(crate) mod validate;

pub use body::{Bodies, Body, BodyArrays, Pose, Velocity};
pub use carriers::Carriers;
pub use collision::{CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact};
pub use input_error::InputError;
pub use parameters::StepParameters;
pub use shape::Shape;
pub use structures::Structures;

pub(crate) use carriers::Demand;
pub(crate) use structures::{InArray, InNearbyOrder, InOrder, Lying, Next};
