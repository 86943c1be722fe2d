//! The one place through which every call of C goes: no panic leaves it, and a failure becomes a
//! status and a text.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::failure::Failure;
use crate::handle::{AcceleratorHandle, State};
use crate::last_error;
use crate::status::Status;

/// Makes a call without an accelerator. The text of a failure is the thread's.
pub(crate) fn call(body: impl FnOnce() -> Result<(), Failure>) -> Status {
    match guarded(body) {
        Ok(()) => Status::Ok,
        Err(Failure { status, text }) => {
            last_error::set(text);
            status
        }
    }
}

/// Makes a call with an accelerator that no other thread may use meanwhile. The text of a failure
/// is the accelerator's; the thread's, where another call has the accelerator or there is none.
pub(crate) fn call_with(
    handle: Result<&AcceleratorHandle, Failure>,
    body: impl FnOnce(&mut State) -> Result<(), Failure>,
) -> Status {
    let handle = match handle {
        Ok(handle) => handle,
        Err(failure) => return call(|| Err(failure)),
    };
    let Err(Failure { status, text }) = guarded(|| body(&mut *handle.lock()?)) else {
        return Status::Ok;
    };
    match status {
        // The text of the accelerator is that of the other call, or the parent's.
        Status::Busy | Status::Forked => last_error::set(text),
        _ => handle.note(Failure { status, text }),
    }
    status
}

/// Turns a panic into a failure.
fn guarded<T>(body: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    // The state of an accelerator stands behind a lock, which a panic poisons.
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|payload| {
        let text = format!("the library met a mistake of its own: {}", message(&*payload));
        Err(Failure { status: Status::Panic, text })
    })
}

/// The message of a panic.
fn message(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message")
}

#[cfg(all(test, feature = "emulation"))]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_status_and_the_accelerator_refuses_every_later_call() {
        let handle = AcceleratorHandle::open("emulated").expect("a board");
        assert_eq!(call_with(Ok(&handle), |_| Ok(())), Status::Ok);
        assert_eq!(call_with(Ok(&handle), |_| panic!("a {}", "test")), Status::Panic);
        assert_eq!(call_with(Ok(&handle), |_| Ok(())), Status::Panic);
        assert_eq!(call(|| panic!("a test")), Status::Panic);
    }

    #[test]
    fn a_second_call_at_the_same_time_is_refused() {
        let handle = AcceleratorHandle::open("emulated").expect("a board");
        let outer = call_with(Ok(&handle), |_| {
            assert_eq!(call_with(Ok(&handle), |_| Ok(())), Status::Busy);
            Ok(())
        });
        assert_eq!(outer, Status::Ok);
    }
}
