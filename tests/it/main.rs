//! Tests of the driver through its public interface.
//!
//! One program, as each more would be linked with all of the crate. A test that counts the
//! allocations of its whole process is a program of its own, beside this folder.

#[cfg(feature = "emulation")]
#[path = "../common/mod.rs"]
mod common;
#[cfg(feature = "emulation")]
#[path = "../vectors/mod.rs"]
mod vectors;

mod asked;
mod board_text;
mod cheapest_order;
mod check;
mod empty;
mod float_environment;
mod forked;
mod interface;
mod landing;
mod order;
mod overlap;
mod pack_threads;
mod places;
mod prepared;
mod profiles;
mod queue;
mod refusals;
mod served;
mod shapes;
mod storage;
mod warm_start;
mod widths;
