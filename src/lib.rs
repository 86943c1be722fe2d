//! Userspace driver for an FPGA Projected Gauss-Seidel accelerator on the Zynq `UltraScale+`.
//!
//! ```text
//! caller -> records -> beats -> channels -> device -> results -> caller
//! ```
//!
//! [`Accelerator::open`] finds a board, [`Accelerator::set_shapes`] loads the mass properties, and
//! [`Accelerator::step`] solves the contacts of one time step and integrates it. Without a board
//! all of it runs on a software-emulated one (feature `emulation`, on by default).
//!
//! # A cube on the ground
//!
//! Bodies and collisions may be arrays of structures:
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
//! let collisions = vec![Collision {
//!     body_a: 0,
//!     body_b: 1,
//!     normal: [0.0, -1.0, 0.0],
//!     count: 4,
//!     contacts: [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)],
//! }];
//!
//! let report = accelerator.step(&mut bodies, &collisions, &StepParameters::default())?;
//! assert!(bodies[1].velocity.linear[1] > -0.2, "the ground has stopped the cube");
//! assert!(report.impulse_sum.is_some_and(|sum| sum > 0.0));
//! println!("{} cycles on {}", report.cycles.total, accelerator.board());
//! # Ok(())
//! # }
//! ```
//!
//! or separate arrays, without a copy in between and with the same bits:
//!
//! ```
//! use zynq_pgs::{Accelerator, BodyArrays, CollisionArrays, OpenOptions, Shape, StepParameters};
//! # use zynq_pgs::{Body, Collision, Contact, Pose, Velocity};
//!
//! # fn main() -> Result<(), zynq_pgs::Error> {
//! let mut accelerator = Accelerator::open(OpenOptions::default())?;
//! accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)])?;
//!
//! let mut positions = [[0.0, -1.0, 0.0], [0.0, 0.99, 0.0]];
//! let mut orientations = [[0.0, 0.0, 0.0, 1.0]; 2];
//! let mut linear_velocities = [[0.0; 3], [0.0, -2.0, 0.0]];
//! let mut angular_velocities = [[0.0; 3]; 2];
//! let mut bodies = BodyArrays {
//!     positions: &mut positions,
//!     orientations: &mut orientations,
//!     linear_velocities: &mut linear_velocities,
//!     angular_velocities: &mut angular_velocities,
//!     shapes: &[0, 1],
//! };
//! let collisions = CollisionArrays {
//!     bodies: &[[0, 1]],
//!     normals: &[[0.0, -1.0, 0.0]],
//!     counts: &[4],
//!     contacts: &[[
//!         [-1.0, -0.01, -1.0, -0.01],
//!         [1.0, -0.01, -1.0, -0.01],
//!         [-1.0, -0.01, 1.0, -0.01],
//!         [1.0, -0.01, 1.0, -0.01],
//!     ]],
//! };
//! accelerator.step(&mut bodies, &collisions, &StepParameters::default())?;
//! # // The same scene as an array of structures.
//! # let at = |y, shape, speed| Body {
//! #     pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
//! #     velocity: Velocity { linear: [0.0, speed, 0.0], angular: [0.0; 3] },
//! #     shape,
//! # };
//! # let mut structures = vec![at(-1.0, 0, 0.0), at(0.99, 1, -2.0)];
//! # let corner = |x, z| Contact { point: [x, -0.01, z], distance: -0.01 };
//! # let contacts =
//! #     [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
//! # let normal = [0.0, -1.0, 0.0];
//! # let same = vec![Collision { body_a: 0, body_b: 1, normal, count: 4, contacts }];
//! # accelerator.step(&mut structures, &same, &StepParameters::default())?;
//! # for (index, body) in structures.iter().enumerate() {
//! #     assert_eq!(body.pose.position.map(f32::to_bits), positions[index].map(f32::to_bits));
//! #     assert_eq!(body.pose.orientation.map(f32::to_bits), orientations[index].map(f32::to_bits));
//! #     let Velocity { linear, angular } = body.velocity;
//! #     assert_eq!(linear.map(f32::to_bits), linear_velocities[index].map(f32::to_bits));
//! #     assert_eq!(angular.map(f32::to_bits), angular_velocities[index].map(f32::to_bits));
//! # }
//! assert!(linear_velocities[1][1] > -0.2, "the ground has stopped the cube");
//! # Ok(())
//! # }
//! ```
//!
//! # While the board works
//!
//! [`Accelerator::submit`] starts a step and returns; [`InFlight::wait`] gives its results. What the
//! caller does in between costs no time. A step that is dropped, by a panic too, is stopped.
//!
//! ```
//! # use zynq_pgs::{Accelerator, Body, Collision, OpenOptions, Pose, Shape};
//! # use zynq_pgs::{StepParameters, Velocity};
//! # fn main() -> Result<(), zynq_pgs::Error> {
//! # let mut accelerator = Accelerator::open(OpenOptions::default())?;
//! # accelerator.set_shapes(&[Shape::isotropic(1.0, 1.5)])?;
//! # let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
//! # let mut bodies = vec![Body { pose, velocity: Velocity::default(), shape: 0 }];
//! # let collisions: Vec<Collision> = Vec::new();
//! let step = accelerator.submit(&bodies, &collisions, &StepParameters::default())?;
//! // Sound, pictures, input.
//! step.wait(&mut bodies)?;
//! # assert!(bodies[0].velocity.linear[1] < 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! What does not depend on its results can be packed meanwhile, as the step of another world:
//! [`InFlight::prepare`] validates, orders and packs it, and [`InFlight::wait_and_start`] starts it the
//! moment that the board is through with the first. Collisions that are found one after the other
//! need no array: [`Accelerator::write`] takes each as it is found.
//!
//! # The floating-point environment
//!
//! The caller's thread may round otherwise than to nearest, flush subnormal numbers to zero, or trap on
//! exceptions, as game engines do. No result depends on it, and nothing traps: the driver and the emulated
//! board compute in the standard environment, and the caller finds its own as it was, exception flags too.
//! This holds on x86-64 and on `AArch64`.
//!
//! These calls set it, and restore the caller's on the way out: [`Accelerator::open`], `set_shapes`,
//! `submit`, `write` and `start`; [`InFlight::wait`], `wait_and_start`, `prepare`, `write` and its drop;
//! [`check`]; the constructors of [`Shape`]; the functions of [`order`] that order or measure. A
//! [step](Accelerator::step) is a `submit` and a `wait`. The threads that share the work set it themselves, and
//! so does the emulated board at each access.
//!
//! The methods of [`Bodies`] and [`Collisions`] are called in the standard environment. The narrow phase
//! that `write` is given runs in the caller's, and [`Writer::push`] sets the standard one where it computes.
//!
//! # When something fails
//!
//! Every error says what was expected, what was found and what to do; the bodies are as they were.
//! [`Error::is_input`], [`Error::may_retry`] and [`Error::must_reopen`] say how to go on;
//! [`StepParameters::retries`] goes on by itself. [`Error::fault`] is the cause, and
//! [`Error::diagnosis`] how every channel stood before the board was reset.

mod axi_dma;
mod beat;
#[cfg(feature = "bench")]
pub mod bench;
mod board;
mod check;
mod control_block;
mod error;
mod fault;
pub mod order;
pub mod platform;
mod record;
pub mod scene;
mod simd;
mod step;
mod validate;

pub use axi_dma::{
    ChannelName, DescriptorState, DescriptorStatus, Direction, DmaError, Dmacr, Dmasr,
};
pub use beat::pack::writer::Writer;
pub use board::{BoardChoice, BoardDescription, BoardKind, Cancellation, OpenOptions};
pub use check::{CheckLine, CheckReport, Outcome, check};
pub use control_block::{Capabilities, ControlError, IdentityError, Saturated};
pub use error::{Aftermath, Error, OpenError};
pub use fault::{
    AcceleratorError, Awaited, ChannelState, ControlState, Diagnosis, Fault, Phase, Subject,
};
pub use pgs_interface as interface;
pub use platform::{
    AccessKind, Caching, DevMemWindows, ManagerChoice, MemoryChoice, PlatformError, RegisterAccess,
    UIO_CLASS, UioMap, UioNode, uio_nodes,
};
pub use scene::{
    Bodies, Body, BodyArrays, CONTACT_POINTS, Collision, CollisionArrays, Collisions, Contact,
    Pose, Shape, ShapeError, StepParameters, Structures, Velocity,
};
pub use step::{
    Accelerator, HostTimes, InFlight, Limit, OrderChoice, Prepared, StepCycles, StepReport,
};
pub use validate::{CapableProfiles, InputError};

/// The README's library example is a test.
#[cfg(all(doctest, feature = "emulation"))]
#[doc = include_str!("../README.md")]
#[derive(Debug)]
pub struct Readme;
