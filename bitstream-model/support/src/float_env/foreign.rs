//! Puts tests in a caller's environment that is not the standard one, and says whether it is still
//! there.
//!
//! Feature `foreign-environment`, for tests alone: Rust does not promise what its code computes
//! there.

use super::apart;
use super::registers::Registers;

/// The contents of a thread's registers: the control bits and the exception flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Environment(pub(super) Registers);

/// Environments that callers have, by name, with exception flags up in some. Empty on a
/// processor whose environment is unknown.
pub fn environments() -> impl Iterator<Item = (&'static str, Environment)> {
    Registers::FOREIGN.iter().map(|&(name, registers)| (name, Environment(registers)))
}

impl Environment {
    /// That of this thread, now.
    #[must_use]
    pub fn current() -> Self {
        Self(Registers::read())
    }

    /// Whether code computes in it as in the standard one: the exception flags may differ.
    #[must_use]
    pub fn is_standard(self) -> bool {
        self.0.control() == Registers::STANDARD.control()
    }
}

/// Does some work in an environment, and restores the previous one.
///
/// # Safety
/// The work computes nothing in floating point but in [`standard`](super::standard), and nothing
/// that it calls does: in another environment Rust's arithmetic is undefined.
pub unsafe fn under<R>(environment: Environment, work: impl FnOnce() -> R) -> R {
    let _restored = Restored(Registers::read());
    environment.0.restore();
    apart(work)
}

/// The environment from before, which is set again when this goes.
struct Restored(Registers);

impl Drop for Restored {
    fn drop(&mut self) {
        self.0.restore();
    }
}
