//! Sets the floating-point environment in which results are computed, whatever the caller's is.
//!
//! The environment of a thread says how it rounds, whether it takes subnormal numbers for zero, and
//! which exceptions trap: MXCSR on x86-64, FPCR on aarch64. Engines change it for their own work, a
//! thread that is started inherits it, and Rust compiles for the standard one alone: round to
//! nearest, ties to even; subnormal numbers kept; no exception traps.
//!
//! [`standard`] sets the standard environment around some work, and restores what it found when the
//! work returns or panics: the sticky exception flags, too. Every door to code whose results must
//! not depend on its caller is a call of it, and a [`Crew`](crate::Crew) does all of its work in
//! it, on every thread. [`standard_around`] lets the work run a part of itself, code of the
//! caller's, in the caller's environment.
//!
//! On other processors, and under Miri, nothing is set: the environment is taken to be the standard
//! one.
//!
//! # Why the compiler keeps the work inside
//!
//! The compiler knows of no environment: nothing that it sees orders arithmetic and the
//! instructions that set one, and it may move the one across the other. So the work is done in a
//! function of its own that is never inlined: arithmetic does not leave it. The call of that
//! function in turn stays between the instructions before and after it, because all three have
//! effects whose order the compiler keeps: each is an `asm!` that may touch memory, and the
//! function begins with an empty one.

use std::cell::Cell;

#[cfg(any(test, feature = "foreign-environment"))]
pub mod foreign;
mod registers;
#[cfg(test)]
mod tests;

use registers::Registers;

/// Does some work in the standard environment; on return, or when the work panics, the thread has
/// the environment that it had before.
///
/// The registers are written only where they differ: a thread that has the standard environment
/// already pays for a read before and one after, and for a write if the work has raised an
/// exception flag.
#[inline]
pub fn standard<R>(work: impl FnOnce() -> R) -> R {
    standard_around(|_| work())
}

/// As [`standard`], for work that calls code which wants the environment of the caller:
/// [`Outside::run`] does.
#[inline]
pub fn standard_around<R>(work: impl FnOnce(&Outside) -> R) -> R {
    let outside = Outside::leave();
    apart(|| work(&outside))
}

/// Does some work, and says whether certainly no operand and no result that it used was a subnormal
/// number: then arithmetic that takes subnormal numbers for zero has the same results. Without
/// `watches` it only does the work, and certainty is not asked for. The thread is in the standard
/// environment.
///
/// The proof are the sticky flags of the processor:
///
/// - x86-64: a subnormal operand raises the denormal flag, an inexact subnormal result underflow.
///   An exact one raises nothing until it is an operand; so the caller looks at the results that
///   it hands on. Nor does an operand beside a NaN or divided by zero: the work divides by zero
///   constants alone, and compares what may be NaN.
/// - aarch64: without flushing an exact subnormal result raises nothing, and neither does a
///   subnormal operand. So the work is done with FZ set: a flushed operand raises IDC, a flushed
///   result UFC, also one that would have been rounded up to a normal number.
/// - On other processors nothing is certain.
pub fn without_subnormals<R>(watches: bool, work: impl FnOnce() -> R) -> (R, bool) {
    if !watches {
        return (work(), true);
    }
    let watched = Watched(Registers::read());
    watched.0.watching().restore();
    let result = apart(work);
    (result, Registers::read().saw_no_subnormal())
}

/// The environment from before, which is set again when this goes.
struct Watched(Registers);

impl Drop for Watched {
    fn drop(&mut self) {
        self.0.restore();
    }
}

/// The environment of the caller, who is given it back when this goes.
#[derive(Debug)]
pub struct Outside(Cell<Registers>);

impl Outside {
    /// From the environment of this thread into the standard one.
    #[inline]
    fn leave() -> Self {
        let found = Registers::read();
        Registers::STANDARD.enter_from(found);
        Self(Cell::new(found))
    }

    /// Does some work in the environment of the caller: what it changes there, exception flags too,
    /// is what the caller finds in the end.
    pub fn run<R>(&self, work: impl FnOnce() -> R) -> R {
        let _inside = Inside::leave(self);
        apart(work)
    }
}

impl Drop for Outside {
    #[inline]
    fn drop(&mut self) {
        self.0.get().restore();
    }
}

/// The environment inside, which is set again when this goes.
struct Inside<'a> {
    outside: &'a Outside,
    found: Registers,
}

impl<'a> Inside<'a> {
    fn leave(outside: &'a Outside) -> Self {
        let found = Registers::read();
        outside.0.get().restore();
        Self { outside, found }
    }
}

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.outside.0.set(Registers::read());
        self.found.restore();
    }
}

/// Does some work in a function of its own, which no arithmetic enters or leaves: see the module's
/// head.
#[inline(never)]
fn apart<R>(work: impl FnOnce() -> R) -> R {
    registers::effect();
    work()
}
