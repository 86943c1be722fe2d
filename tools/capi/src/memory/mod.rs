//! The memory of the C caller: checks each address as far as an address can be checked, then reads
//! and writes there.
//!
//! The rest is the caller's promise, which the header states: an address that is not null leads to
//! memory of the size that the caller gives, it lives through the call, and no other thread writes
//! it meanwhile. Every `unsafe` function here asks for this promise, and nothing else.

#![allow(unsafe_code, reason = "the memory of a C caller is reached by raw pointers alone")]

mod column;
mod overlap;
mod pointer;
mod sized;
mod view;

pub(crate) use overlap::{Span, refuse_overlap};
pub(crate) use pointer::{close, handle, open_into, slice, store, text};
pub(crate) use sized::{Out, read, span};
pub(crate) use view::{BodiesView, CollisionsView, store_impulses};
