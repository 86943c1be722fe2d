//! The calls that prepare a step while another is on the board.

#![allow(unsafe_code, reason = "exported names, and arguments that are raw pointers")]

use crate::arrays::{BodyArrays, CollisionArray};
use crate::barrier::call_with;
use crate::exports::{outputs_apart, read_bodies, with_input};
use crate::handle::{AcceleratorHandle, State};
use crate::memory::{self, Out, Span, span};
use crate::parameters::Parameters;
use crate::report::Report;
use crate::status::Status;

/// Checks, orders and packs another step while one is in flight, in place of one that was prepared
/// before. The arrays are the caller's again when the call returns; the step has their values of
/// now, so that it cannot depend on the results of the step in flight.
///
/// # Safety
/// As `zpgs_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_prepare(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    collisions: *const CollisionArray,
    parameters: *const Parameters,
) -> Status {
    // SAFETY: `# Safety` of this function.
    unsafe { with_input(accelerator, bodies, collisions, parameters, State::prepare) }
}

/// Waits as `zpgs_wait`, and starts the prepared step as soon as the board has ended the one in
/// flight: the results are read while the board works on the next step.
///
/// The status is that of the step that has ended. `started` gets the status of the start, and a
/// step is in flight afterwards if it is `ZPGS_STATUS_OK`, whatever became of the step before:
/// `zpgs_wait` ends it, with its own bodies. It is `ZPGS_STATUS_SEQUENCE` where nothing was started
/// because the call was refused. `zpgs_last_error` has the text of the step that has ended or, if
/// that is done, of the start.
///
/// `report` may be null.
///
/// # Safety
/// As `zpgs_step`; `started` is null or the address of a status that no other thread uses during
/// the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_wait_and_start(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    report: *mut Report,
    started: *mut Status,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    let mut start_failed = None;
    let status = call_with(handle, |state| {
        // SAFETY: `bodies` is null or leads to its structure; the arrays in it live through the
        // call, and this call alone uses them.
        let structure = [unsafe { span(bodies) }];
        // SAFETY: `bodies` is null or leads to its structure, whose arrays live through the call,
        // which alone uses them.
        let bodies = unsafe { read_bodies(bodies) };
        // SAFETY: `report` is null or leads to a structure of the size in it, which this call alone
        // uses.
        let report = unsafe { Out::<Report>::optional(report) };
        if let (Ok(bodies), Ok(report)) = (&bodies, &report) {
            let started = Span::of("status of the start", started);
            outputs_apart(bodies, report.as_ref(), Some(started), structure.into_iter())?;
        }
        // SAFETY: `started` is null or leads to a status that this call alone uses.
        unsafe { memory::store(started, "status of the start", Status::Sequence) }?;
        let (mut bodies, report) = (bodies?, report?);
        let (done, start) = state.wait_and_start(&mut bodies)?;
        let status = start.as_ref().err().map_or(Status::Ok, |failure| failure.status);
        start_failed = start.err();
        // SAFETY: `started` is null or leads to a status that this call alone uses: `# Safety` of
        // this function.
        unsafe { memory::store(started, "status of the start", status) }?;
        let done = done?;
        report.into_iter().for_each(|report| report.write(Report::from(&done)));
        Ok(())
    });
    if let (Status::Ok, Some(failure)) = (status, start_failed) {
        // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this
        // call returns.
        if let Ok(handle) = unsafe { memory::handle(accelerator) } {
            handle.note(failure);
        }
    }
    status
}

/// Starts the prepared step, with none in flight. It may be started again, as after a fault.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_start(accelerator: *mut AcceleratorHandle) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| state.start())
}
