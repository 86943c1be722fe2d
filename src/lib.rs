//! Userspace driver for an FPGA Projected Gauss-Seidel accelerator on the Zynq `UltraScale+`.
//!
//! ```text
//! caller -> records -> beats -> channels -> device -> results -> caller
//! ```
//!
//! [`Accelerator::open`] finds a board, [`Accelerator::set_shapes`] loads the mass properties, and
//! [`Accelerator::step`] solves the contacts of one time step and integrates it. Without a board
//! all of it runs on a software-emulated one (feature `emulation`, on by default), which
//! [`OpenOptions::emulated`] builds from one text.
//!
//! # A cube on the ground
//!
//! ```
//! use zynq_pgs::{Accelerator, Body, Collision, Contact, OpenOptions, Pose, Shape};
//! use zynq_pgs::{StepParameters, Velocity};
//!
//! # fn main() -> Result<(), zynq_pgs::Error> {
//! let mut accelerator = Accelerator::open(OpenOptions::default())?;
//! accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)])?;
//!
//! let at = |y, shape, speed| Body {
//!     pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
//!     velocity: Velocity { linear: [0.0, speed, 0.0], angular: [0.0; 3] },
//!     shape,
//! };
//! let mut bodies = vec![at(-1.0, 0, 0.0), at(0.99, 1, -2.0)];
//!
//! // The cube is B, its four lower corners are 0.01 m deep in the ground, which is A.
//! let corner = |x, z| Contact { point: [x, -0.01, z], distance: -0.01 };
//! let contacts = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
//! let pair = Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 4, contacts };
//!
//! let step = accelerator.submit(&bodies, &[pair], &StepParameters::default())?;
//! // Sound, pictures, input, while the board works.
//! let report = step.wait(&mut bodies)?;
//! assert!(bodies[1].velocity.linear[1] > -0.2, "the ground has stopped the cube");
//! assert!(report.impulse_sum.is_some_and(|sum| sum > 0.0));
//! # Ok(())
//! # }
//! ```
//!
//! - Bodies and collisions may be arrays of structures, separate arrays
//!   ([`BodyArrays`](scene::BodyArrays), [`CollisionArrays`](scene::CollisionArrays)), or the
//!   caller's own storage ([`Bodies`], [`Collisions`]).
//! - [`Accelerator::step`] is [`Accelerator::submit`] and [`InFlight::wait`] in one call. A step
//!   that is dropped, by a panic too, is stopped.
//! - [`InFlight::detach`] lets a step go on without a borrow of its accelerator, for callers that
//!   own it.
//! - [`InFlight::prepare`] packs another world's step while the board works, and
//!   [`InFlight::wait_and_start`] starts it the moment that the board is free.
//! - [`Accelerator::write`] takes each collision as the narrow phase finds it.
//!
//! `docs/library.md` has an example of each.
//!
//! # The floating-point environment
//!
//! The caller's thread may round in another mode than to nearest, flush subnormal numbers to zero,
//! or trap on exceptions. No result depends on it, and nothing traps, on x86-64 and on `AArch64`:
//! the driver and the emulated board compute in the standard environment and restore the caller's,
//! exception flags too. They call the methods of [`Bodies`] and [`Collisions`] in the standard
//! environment. The narrow phase that `write` runs stays in the caller's environment;
//! [`Writer::push`] sets the standard one where it computes. `docs/library.md` lists the calls.
//!
//! # When something fails
//!
//! Every error says what was expected, what was found and what to do; the bodies are as they were.
//! [`Error::is_input`], [`Error::may_retry`] and [`Error::must_reopen`] say how to go on, and
//! [`StepParameters::retries`] goes on without the caller. [`Error::fault`] is the cause;
//! [`Error::diagnosis`] is the state of every channel before the reset.

mod axi_dma;
mod beat;
#[cfg(feature = "bench")]
pub mod bench;
pub mod board;
pub mod check;
mod control_block;
#[cfg(feature = "emulation")]
pub mod emulation;
pub mod error;
mod fault;
pub mod order;
pub mod platform;
mod record;
pub mod scene;
mod simd;
mod step;
pub mod validate;

/// Channels, registers and their states, as errors and logs have them.
pub mod diagnosis {
    pub use crate::axi_dma::{
        ChannelName, DescriptorState, DescriptorStatus, Direction, DmaError, Dmacr, Dmasr,
    };
    pub use crate::control_block::{ControlError, IdentityError};
    pub use crate::fault::{
        AcceleratorError, Awaited, ChannelFault, ChannelState, ControlState, Diagnosis, Phase,
        Subject,
    };
    pub use crate::platform::{AccessKind, RegisterAccess};
}

/// The parts of a [`StepReport`].
pub mod report {
    pub use crate::control_block::Saturated;
    pub use crate::step::{HostTimes, Limit, OrderChoice, StepCycles};
}

pub use beat::writer::Writer;
/// The emulated board itself: its configuration, its builder's handle, violations, faults.
#[cfg(feature = "emulation")]
pub use bitstream_model as model;
pub use board::{BoardChoice, Cancellation, OpenOptions};
pub use check::{CheckReport, check};
pub use control_block::Capabilities;
pub use error::Error;
pub use fault::Fault;
pub use pgs_interface as interface;
pub use scene::{
    Bodies, Body, Collision, Collisions, Contact, Impulses, LastStep, Place, Pose, Shape,
    StepParameters, Velocity, WarmCollisions,
};
pub use step::{Accelerator, Detached, InFlight, Prepared, StepReport};
pub use validate::InputError;

/// The examples of the documents, which are tests.
#[cfg(all(doctest, feature = "emulation"))]
#[allow(dead_code, reason = "rustdoc alone reads them")]
mod documents {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/library.md")]
    struct Library;
}
