//! The calls of a narrow phase that hands its collisions over one after the other.

#![allow(unsafe_code, reason = "exported names, and arguments that are raw pointers")]

use crate::arrays::BodyArrays;
use crate::barrier::call_with;
use crate::collision::{Collision, Impulses};
use crate::exports::{outputs_apart, read_bodies, read_parameters};
use crate::handle::AcceleratorHandle;
use crate::memory::{self, span};
use crate::parameters::Parameters;
use crate::status::Status;

/// Begins a list of collisions in memory of the library, in place of an earlier one. `zpgs_push`
/// appends to it, and `zpgs_end` submits its step. A list may begin and grow while a step is in
/// flight.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_begin(accelerator: *mut AcceleratorHandle) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        state.pushed().begin();
        Ok(())
    })
}

/// Appends `count` collisions to the list, all or none. The arrays are the caller's again when the
/// call returns.
///
/// A collision of count 0 keeps its index. `impulses` has the impulses that a step with
/// `warm_start` begins with, one `zpgs_impulses` a collision, zeros for a new one. It may be null
/// if no step of the list starts warm. `zpgs_end` checks the values of both. A warm start by place
/// needs the arrays of `zpgs_collisions`, in `zpgs_step`, `zpgs_submit` or `zpgs_prepare`.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `collisions`
/// is null or the address of `count` collisions, and `impulses` is null or that of `count`
/// impulses; no thread writes them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_push(
    accelerator: *mut AcceleratorHandle,
    collisions: *const Collision,
    impulses: *const Impulses,
    count: usize,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: `collisions` is null or leads to `count` collisions that no thread writes; every
        // bit pattern is one, and the driver's have the same layout.
        let collisions = unsafe { memory::slice(collisions.cast(), count, "collisions") }?;
        let impulses = match impulses.is_null() {
            true => None,
            // SAFETY: `impulses` leads to `count` impulses that no thread writes; every bit pattern
            // is one, and the driver's have the same layout.
            false => Some(unsafe { memory::slice(impulses.cast(), count, "impulses") }?),
        };
        state.pushed().push(collisions, impulses)
    })
}

/// Submits the step of the list, as `zpgs_submit`, and ends the list. The bodies are read now.
/// `zpgs_wait` ends the step.
///
/// A list that has ended takes no more collisions. It stays until the next `zpgs_begin`, so that
/// its step can be submitted again, as after a fault. If the call fails the list is as before.
///
/// # Safety
/// As `zpgs_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_end(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    parameters: *const Parameters,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: `bodies` is null or leads to its structure; the arrays in it live through the
        // call, and this call alone uses them.
        let structures = [unsafe { span(bodies) }];
        // SAFETY: `bodies` is null or leads to its structure, whose arrays live through the call,
        // which alone uses them.
        let bodies = unsafe { read_bodies(bodies) }?;
        // SAFETY: `parameters` is null or leads to a structure of the size in it.
        let parameters = unsafe { read_parameters(parameters) }?;
        outputs_apart(&bodies, None, None, structures.into_iter())?;
        state.submit_pushed(&bodies, &parameters)
    })
}
