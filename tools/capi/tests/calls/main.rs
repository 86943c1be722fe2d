//! The calls of the C interface, made as C makes them.

#![allow(unsafe_code, reason = "the calls take raw pointers")]

/// Makes a call whose pointers are null, a handle that is open, or structures and arrays of a test.
macro_rules! made {
    ($call:expr) => {
        // SAFETY: every call below keeps the contract of the header: the handle is open, or null.
        unsafe { $call }
    };
}

mod forked;
mod in_flight;
mod pushed;
mod refusals;
mod step;
mod support;
mod worlds;
