//! The functions of the header, in its order.
//!
//! The module exists for exported names and for arguments that are raw pointers: Rust calls both
//! `unsafe`. No function computes anything here: each hands its pointers to [`memory`], under the
//! promises of its `# Safety` section.

#![allow(unsafe_code, reason = "exported names, and arguments that are raw pointers")]

use std::ffi::{CStr, c_char};

use zynq_pgs::StepParameters;

use crate::arrays::{BodyArrays, CollisionArray, Strided, StridedConst};
use crate::barrier::{call, call_with};
use crate::collision::{Collision, Impulses, count_with_friction};
use crate::failure::Failure;
use crate::handle::{AcceleratorHandle, State};
use crate::last_error;
use crate::memory::{self, BodiesView, CollisionsView, Out, Span, span};
use crate::parameters::Parameters;
use crate::report::Report;
use crate::shape::Shape;
use crate::status::Status;

/// Version of the binary interface: the number in the shared library's name. It grows when a
/// program that was built with an older header would no longer work.
pub const ZPGS_ABI_VERSION: u32 = 0;

const VERSION: &CStr =
    match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("a version without null bytes"),
    };

/// The version of the library, such as "0.1.0". The text lives as long as the library.
#[unsafe(no_mangle)]
pub extern "C" fn zpgs_version() -> *const c_char {
    VERSION.as_ptr()
}

/// The `ZPGS_ABI_VERSION` of the library.
#[unsafe(no_mangle)]
pub extern "C" fn zpgs_abi_version() -> u32 {
    ZPGS_ABI_VERSION
}

/// Opens a board.
///
/// `board` names it: `auto`, `uio` or `uio:NODE`, `devmem`, `emulated` or with a build, such as
/// `emulated:float,world`, or `socket:PATH`. `accelerator` receives the handle, or null where the
/// call fails; `zpgs_last_error` of null then has the text.
///
/// # Safety
/// `board` is null or a text that ends with a null byte and that no thread writes during the call;
/// `accelerator` is null or the address of a pointer that no other thread uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_open(
    board: *const c_char,
    accelerator: *mut *mut AcceleratorHandle,
) -> Status {
    let open = || {
        // SAFETY: `board` is null or ends with a null byte, and no thread writes it while `text` is
        // in use: `# Safety` of this function.
        let board = unsafe { memory::text(board, "text that names the board") }?;
        AcceleratorHandle::open(board)
    };
    // SAFETY: `accelerator` is null or leads to a pointer that this call alone uses: `# Safety` of
    // this function.
    call(|| unsafe { memory::open_into(accelerator, open) })
}

/// Closes an accelerator, and stops a step in flight. Null does nothing. In a child that was forked
/// since `zpgs_open` it frees memory of the child alone, and the parent's board goes on.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, is closed once, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_close(accelerator: *mut AcceleratorHandle) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, closed for the first time, and used by no
    // other call from here on: `# Safety` of this function.
    call(|| unsafe { memory::close(accelerator) })
}

/// The text of the last failed call with that accelerator: what was expected, what was found and
/// what to do, with every cause. It stays until another call with the accelerator fails. Empty if
/// none failed.
///
/// With null: the text of this thread's last failed call without an accelerator (`zpgs_open`, a
/// null handle), or with one that another thread used (`ZPGS_STATUS_BUSY`). It stays until the
/// thread's next call of this kind fails. Never null. In a forked child this is the text with the
/// accelerator of its parent, too.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_last_error(accelerator: *const AcceleratorHandle) -> *const c_char {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    match unsafe { memory::handle(accelerator) } {
        Ok(handle) => handle.text(),
        Err(_) => last_error::get(),
    }
}

/// Loads `count` shapes, in place of all earlier ones; bodies refer to them by index. Not while a
/// step is in flight.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns; `shapes` is
/// null or the address of `count` shapes that no thread writes during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_set_shapes(
    accelerator: *mut AcceleratorHandle,
    shapes: *const Shape,
    count: usize,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: `shapes` is null or leads to `count` initialised shapes that no thread writes
        // during the call; a shape takes every bit pattern.
        state.set_shapes(unsafe { memory::slice(shapes, count, "shapes") }?)
    })
}

/// Fills in the parameters of a step: Bullet's at 60 steps a second, without damping of spin.
/// `size` is `sizeof(zpgs_parameters)`.
///
/// # Safety
/// `parameters` is null or the address of `size` bytes that no other thread uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_parameters_default(
    parameters: *mut Parameters,
    size: usize,
) -> Status {
    call(|| {
        // SAFETY: `parameters` is null or leads to `size` bytes that this call alone uses.
        unsafe { Out::of_size(parameters, size) }?.write(Parameters::default());
        Ok(())
    })
}

/// The `count` of a collision with a friction coefficient of its own, rounded to three digits, for
/// `pair_friction` of `zpgs_parameters`. A step refuses a friction that is negative or not finite.
/// A count of 0 stays 0.
#[unsafe(no_mangle)]
pub extern "C" fn zpgs_count_with_friction(count: u32, friction: f32) -> u32 {
    count_with_friction(count, friction)
}

/// Solves the contacts of one time step, and integrates it if the parameters say so. Returns when
/// it is done. The bodies change only if the step succeeds, and then all at once.
///
/// `report` may be null.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. Every other
/// pointer is null or the address of its structure, with the size in it. The arrays are as
/// `zpgs_bodies` and `zpgs_collisions` describe. No other thread uses the structures or the arrays
/// during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_step(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    collisions: *const CollisionArray,
    parameters: *const Parameters,
    report: *mut Report,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: the pointers are null or lead to their structures, whose arrays live through the
        // call; this call alone uses the bodies, and no thread writes the others.
        let (mut bodies, collisions, parameters, inputs) =
            unsafe { read_input(bodies, collisions, parameters) }?;
        // SAFETY: `report` is null or leads to a structure of the size in it, which this call alone
        // uses.
        let report = unsafe { Out::<Report>::optional(report) }?;
        outputs_apart(&bodies, report.as_ref(), None, inputs.into_iter())?;
        let done = state.step(&mut bodies, &collisions, &parameters)?;
        report.into_iter().for_each(|report| report.write(Report::from(&done)));
        Ok(())
    })
}

/// Starts a step and returns at once. The arrays are the caller's again when the call returns. At
/// most one step of an accelerator is in flight; `zpgs_wait` ends it.
///
/// # Safety
/// As `zpgs_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_submit(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    collisions: *const CollisionArray,
    parameters: *const Parameters,
) -> Status {
    // SAFETY: `# Safety` of this function.
    unsafe { with_input(accelerator, bodies, collisions, parameters, State::submit) }
}

/// Waits for the step in flight and stores its results in `bodies`. The caller gives the bodies of
/// `zpgs_submit`, whose arrays may have moved. Afterwards no step is in flight, also where the call
/// fails, unless the status is `ZPGS_STATUS_NULL_POINTER`, `ZPGS_STATUS_ARGUMENT` or
/// `ZPGS_STATUS_BUSY`.
///
/// `report` may be null.
///
/// # Safety
/// As `zpgs_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_wait(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    report: *mut Report,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: `bodies` is null or leads to its structure; the arrays in it live through the
        // call, and this call alone uses them.
        let structure = [unsafe { span(bodies) }];
        // SAFETY: `bodies` is null or leads to its structure, whose arrays live through the call,
        // which alone uses them.
        let mut bodies = unsafe { read_bodies(bodies) }?;
        // SAFETY: `report` is null or leads to a structure of the size in it, which this call alone
        // uses.
        let report = unsafe { Out::<Report>::optional(report) }?;
        outputs_apart(&bodies, report.as_ref(), None, structure.into_iter())?;
        let done = state.wait(&mut bodies)?;
        report.into_iter().for_each(|report| report.write(Report::from(&done)));
        Ok(())
    })
}

/// Stores the impulses of each collision of the last step that succeeded with `impulses_out`, in
/// the order of its collisions. `impulses` has `count` elements of `zpgs_impulses`, and `count` is
/// the number of collisions of that step. For the warm start of the next step, sounds, damage.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `impulses` is
/// as `zpgs_strided` describes, and no other thread uses its elements during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_read_impulses(
    accelerator: *mut AcceleratorHandle,
    impulses: Strided,
    count: usize,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        let found = state.impulses();
        if found.len() != count {
            return Err(Failure::argument(format!(
                "found {count} as the number of impulses, but the last step with impulses_out had \
                 {} collisions: give that number",
                found.len()
            )));
        }
        // SAFETY: `count` elements that this call alone uses: `# Safety` of this function.
        unsafe { memory::store_impulses(impulses, found) }
    })
}

/// Keeps the impulses of the last step that succeeded with `impulses_out`, for the places of the
/// next step of the same world. `collisions` are the ones of that step, unchanged; its `world` names
/// the world, its places are not looked at. Call it after each step that has succeeded, before
/// another one of the accelerator ends, and after no other: a step that failed then begins with the
/// same impulses when it is given again.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `collisions`
/// is null or the address of its structure, with the size in it, whose arrays are as it describes;
/// no other thread writes them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_commit(
    accelerator: *mut AcceleratorHandle,
    collisions: *const CollisionArray,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: the pointer is null or leads to its structure, whose arrays live through the
        // call; no thread writes them.
        let collisions = unsafe { read_collisions(collisions) }?;
        state.commit(&collisions)
    })
}

/// Forgets the last step of a world that `zpgs_commit` has kept, and frees its memory: all
/// collisions of the next step are then new. A world without a kept step is no error.
/// `zpgs_close` forgets every world.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_forget(accelerator: *mut AcceleratorHandle, world: u32) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        state.forget(world);
        Ok(())
    })
}

/// Ends the step in flight or in work, or else the next one, within about ten milliseconds of the
/// board's time: the call that waits for it returns `ZPGS_STATUS_CANCELLED`, and the bodies stay.
/// The step after it is not cancelled. Any thread may call it at any time, also during another
/// call.
///
/// # Safety
/// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zpgs_cancel(accelerator: *const AcceleratorHandle) -> Status {
    call(|| {
        // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this
        // call returns: `# Safety` of this function.
        unsafe { memory::handle(accelerator) }?.cancel()
    })
}

/// Refuses a call whose outputs, the bodies among them, share bytes with each other or with its
/// input.
pub(crate) fn outputs_apart(
    bodies: &BodiesView<'_>,
    report: Option<&Out<Report>>,
    started: Option<Span>,
    inputs: impl Iterator<Item = Span> + Clone,
) -> Result<(), Failure> {
    let none = Span::of::<u8>("", std::ptr::null());
    let [positions, orientations, linear, angular] = bodies.outputs();
    let report = report.map_or(none, Out::span);
    let outputs = [positions, orientations, linear, angular, report, started.unwrap_or(none)];
    memory::refuse_overlap(&outputs, inputs.chain(bodies.inputs()))
}

/// Refuses a warm start whose impulses are all 0, which would be a cold one that takes longer.
fn check_impulses(
    collisions: &CollisionsView<'_>,
    parameters: &StepParameters,
) -> Result<(), Failure> {
    if parameters.warm_start && !collisions.has_impulses() {
        return Err(Failure::argument(
            "a warm start without impulses: set impulses or places of zpgs_collisions, or leave \
             warm_start 0"
                .to_owned(),
        ));
    }
    if parameters.warm_start && collisions.places.is_some() && collisions.factor == 0.0 {
        return Err(Failure::argument(
            "a warm start by place with 0 as the factor of zpgs_collisions: give the share of the \
             impulses, such as 0.85, or leave warm_start 0"
                .to_owned(),
        ));
    }
    Ok(())
}

/// Acts with the input of a step.
///
/// # Safety
/// As [`zpgs_step`].
pub(crate) unsafe fn with_input<'a>(
    accelerator: *mut AcceleratorHandle,
    bodies: *const BodyArrays,
    collisions: *const CollisionArray,
    parameters: *const Parameters,
    act: fn(
        &mut State,
        &BodiesView<'a>,
        &CollisionsView<'a>,
        &StepParameters,
    ) -> Result<(), Failure>,
) -> Status {
    // SAFETY: `accelerator` is null or from `zpgs_open`, and closed by no thread before this call
    // returns: `# Safety` of this function.
    let handle = unsafe { memory::handle(accelerator) };
    call_with(handle, |state| {
        // SAFETY: the pointers are null or lead to their structures, whose arrays live through the
        // call; this call alone uses the bodies, and no thread writes the others.
        let (bodies, collisions, parameters, inputs) =
            unsafe { read_input(bodies, collisions, parameters) }?;
        // The call that ends the step would refuse them for ever.
        outputs_apart(&bodies, None, None, inputs.into_iter())?;
        act(state, &bodies, &collisions, &parameters)
    })
}

/// Reads and checks the input of a step; the spans are of all but the arrays of the bodies.
///
/// # Safety
/// Each pointer is null or leads to its structure, with the size in it, whose arrays are as it
/// describes.
pub(crate) unsafe fn read_input<'a>(
    bodies: *const BodyArrays,
    collisions: *const CollisionArray,
    parameters: *const Parameters,
) -> Result<(BodiesView<'a>, CollisionsView<'a>, StepParameters, [Span; 6]), Failure> {
    // SAFETY: each pointer is null or leads to its structure, whose arrays are as it describes:
    // `# Safety` of this function.
    let first = unsafe { span(bodies) };
    // SAFETY: `collisions` is null or leads to its structure with the size in it: `# Safety` of
    // this function.
    let second = unsafe { span(collisions) };
    // SAFETY: `parameters` is null or leads to its structure with the size in it: `# Safety` of
    // this function.
    let third = unsafe { span(parameters) };
    // SAFETY: `bodies` is null or leads to its structure, whose arrays are as it describes: `#
    // Safety` of this function.
    let bodies = unsafe { read_bodies(bodies) }?;
    // SAFETY: `collisions` is null or leads to its structure, whose arrays are as it describes: `#
    // Safety` of this function.
    let collisions = unsafe { read_collisions(collisions) }?;
    // SAFETY: `parameters` is null or leads to its structure with the size in it: `# Safety` of
    // this function.
    let parameters = unsafe { read_parameters(parameters) }?;
    check_impulses(&collisions, &parameters)?;
    let [all, impulses, places] = collisions.inputs();
    let inputs = [first, second, third, all, impulses, places];
    Ok((bodies, collisions, parameters, inputs))
}

/// Reads and checks the parameters of a step.
///
/// # Safety
/// The pointer is null or leads to its structure, with the size in it.
pub(crate) unsafe fn read_parameters(
    pointer: *const Parameters,
) -> Result<StepParameters, Failure> {
    // SAFETY: the pointer is null or leads to a structure of the size in it: `# Safety` of this
    // function.
    unsafe { memory::read(pointer, Parameters::default()) }?.driver()
}

/// Reads and checks the caller's bodies.
///
/// # Safety
/// The pointer is null or leads to the structure, whose arrays are as it describes.
pub(crate) unsafe fn read_bodies<'a>(
    pointer: *const BodyArrays,
) -> Result<BodiesView<'a>, Failure> {
    // SAFETY: the pointer is null or leads to the structure: `# Safety` of this function.
    let arrays = unsafe { memory::read(pointer, BodyArrays::default()) }?;
    // SAFETY: the arrays are as the structure describes: `# Safety` of this function.
    unsafe { BodiesView::new(arrays) }
}

/// Reads and checks the caller's collisions.
///
/// # Safety
/// The pointer is null or leads to the structure, whose array is as it describes.
unsafe fn read_collisions<'a>(
    pointer: *const CollisionArray,
) -> Result<CollisionsView<'a>, Failure> {
    let collisions = StridedConst { data: std::ptr::null(), stride: size_of::<Collision>() };
    let impulses = StridedConst { data: std::ptr::null(), stride: size_of::<Impulses>() };
    let places = std::ptr::null();
    let nothing =
        CollisionArray { size: 0, count: 0, collisions, impulses, places, factor: 0.0, world: 0 };
    // SAFETY: the pointer is null or leads to the structure: `# Safety` of this function.
    let array = unsafe { memory::read(pointer, nothing) }?;
    // SAFETY: the array is as the structure describes: `# Safety` of this function.
    unsafe { CollisionsView::new(array) }
}
