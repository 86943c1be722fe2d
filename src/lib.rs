//! Userspace driver for an FPGA Projected Gauss-Seidel accelerator on the Zynq UltraScale+.

mod beat;
mod record;
pub mod scene;

pub use bitstream_model::interface;
pub use scene::{
    Bodies, Body, BodyArrays, CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact,
    InputError, Pose, Shape, StepParameters, Velocity,
};
