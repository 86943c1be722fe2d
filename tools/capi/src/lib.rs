//! The C interface of the driver `zynq-pgs`.
//!
//! `include/zynq_pgs.h` is made from this crate, and `docs/engines.md` has its conventions. Every
//! exported function returns a [`Status`], and no panic leaves one.

#[cfg(not(target_pointer_width = "64"))]
compile_error!("the C interface is laid out for 64-bit systems");

mod arrays;
mod barrier;
mod collision;
mod exports;
mod exports_ahead;
mod exports_pushed;
mod failure;
mod handle;
mod last_error;
mod memory;
mod parameters;
mod pushed;
mod report;
mod shape;
mod status;

pub use arrays::{BodyArrays, CollisionArray, Strided, StridedConst};
pub use collision::{
    Collision, Contact, Impulses, Place, ZPGS_CONTACT_POINTS, ZPGS_NEW_COLLISION, ZPGS_NEW_POINT,
};
pub use exports::*;
pub use exports_ahead::*;
pub use exports_pushed::*;
pub use handle::AcceleratorHandle;
pub use parameters::{Order, Parameters};
pub use report::Report;
pub use shape::Shape;
pub use status::Status;
