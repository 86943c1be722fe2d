//! Decides in which order the collisions of a step enter the pipeline.
//!
//! A collision reads the velocities of its bodies when it enters and writes them back a *window*
//! later. A collision that shares a moving body with one of the `depth - 1` issue slots before it
//! meets a *hazard*. A board with an issue queue keeps hazards apart by itself, and gets
//! [`Order::Interleaved`], which costs the host next to nothing. Hardware that waits on a hazard
//! loses up to a window, and hardware that ignores it reads a stale velocity, so that the impulse
//! of the earlier one is lost: for these [`Order::HazardFree`] spaces the uses of every body so
//! that none is left, keeps the collisions near to where they were given, and leaves slots empty
//! only where nothing fits. Hardware that ignores hazards, hardware that waits on them and a
//! sequential solver then give the same bits.
//!
//! An order is a function of its input alone. It is the same on every machine, and does not depend
//! on earlier orders, so that a step that is repeated from a stored state is the same step.
//!
//! # Example
//!
//! ```
//! use zynq_pgs::order::{Checker, IssueWindow, Order, OrderInput, Orderer};
//!
//! # fn main() -> Result<(), zynq_pgs::order::OrderError> {
//! // A row of five bodies on the ground, which is body 0.
//! let input = OrderInput {
//!     pairs: &[[0, 1], [0, 2], [0, 3], [0, 4], [0, 5], [1, 2], [2, 3], [3, 4], [4, 5]],
//!     moving: &[false, true, true, true, true, true],
//! };
//! let window = IssueWindow::new(3, 1)?;
//! let mut orderer = Orderer::new();
//! let schedule = orderer.order(&input, Order::HazardFree, window)?;
//! Checker::new().verify(schedule, &input, window)?;
//! assert_eq!(schedule.collisions(), 9);
//! # Ok(())
//! # }
//! ```
//!
//! Source: thesis §4.7 and §5.4.4; interface specification, hazards.

mod check;
mod error;
mod groups;
mod input;
mod interleave;
mod interlock;
mod orderer;
mod schedule;
mod tail;
mod window;

pub use crate::scene::Order;
pub use check::Checker;
pub use error::OrderError;
pub use input::{InputBuffers, OrderInput};
pub(crate) use interlock::Interlock;
pub use orderer::{OrderCosts, Orderer};
pub use schedule::{Ordered, Schedule};
pub use window::IssueWindow;

#[cfg(test)]
mod tests;
