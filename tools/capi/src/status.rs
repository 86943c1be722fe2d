//! The status that every call of the C interface returns.

/// How a call ended, and what the caller can do next. A call that did not end in `ZPGS_STATUS_OK`
/// has changed nothing of the caller's, and `zpgs_last_error` has its text. Only `zpgs_open` then
/// stores a null handle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is null that must not be: a mistake of the program.
    NullPointer = 1,
    /// An argument that the interface itself cannot take: a misaligned pointer, a stride, a size, a
    /// flag, a text that is not UTF-8.
    Argument = 2,
    /// The driver refused the input before it sent anything: correct the input.
    Input = 3,
    /// No board could be opened.
    Open = 4,
    /// The step failed, and the board was reset and works again: make the same call again.
    Again = 5,
    /// The step failed, and the same call would fail in the same way. The board works.
    Failed = 6,
    /// The board could not be reset: close the accelerator and open it again.
    Reopen = 7,
    /// `zpgs_cancel` ended the step. The board works, and the next step is not cancelled.
    Cancelled = 8,
    /// The call does not fit: a step is in flight, or none is; or no list of collisions is open.
    Sequence = 9,
    /// Another thread is in a call with the same accelerator.
    Busy = 10,
    /// The library met a mistake of its own: close the accelerator. Every later call with the same
    /// accelerator ends like this, too.
    Panic = 11,
    /// The call came from a child that was forked since `zpgs_open`: the accelerator is its
    /// parent's, and nothing was done. Open one after the fork. `zpgs_close` frees memory of the
    /// child alone.
    Forked = 12,
}
