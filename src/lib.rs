//! Userspace driver for an FPGA Projected Gauss-Seidel accelerator on the Zynq UltraScale+.

mod accelerator;
mod error;
pub mod scene;
mod step;

pub use accelerator::Capabilities;
pub use bitstream_model::interface;
pub use error::Error;
pub use scene::{
    Bodies, Body, BodyArrays, CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact,
    Pose, Shape, StepParameters, Velocity,
};
pub use step::{
    Accelerator, BoardChoice, BoardDescription, BoardKind, HostTimes, Limit, OpenOptions,
    StepCycles, StepReport,
};
