//! Tells the process that made a value from the children that it has forked since.

/// The process that made a value.
///
/// A forked child has a copy of the value, but no thread of the parent's, and it shares files,
/// locks and sockets with its parent. Code that reaches outside of its own memory must not act
/// there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Process(u32);

impl Default for Process {
    fn default() -> Self {
        Self::this()
    }
}

impl Process {
    /// The process that calls.
    #[must_use]
    pub fn this() -> Self {
        Self(std::process::id())
    }

    /// Whether it is the process that calls. This asks the kernel (`getpid`), well below a
    /// microsecond.
    #[must_use]
    pub fn is_this(self) -> bool {
        self == Self::this()
    }

    /// Its number.
    #[must_use]
    pub fn id(self) -> u32 {
        self.0
    }
}

/// For tests: does some work in a forked child. Returns the number that it gives, or `None` if the
/// child was killed; 60 s later it is.
///
/// # Panics
///
/// If no child can be made.
#[cfg(any(test, feature = "forked-child"))]
pub fn in_forked_child(work: impl FnOnce() -> u8) -> Option<u8> {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    unsafe extern "C" {
        safe fn fork() -> i32;
        safe fn alarm(seconds: u32) -> u32;
        safe fn _exit(code: i32) -> !;
        fn waitpid(child: i32, status: *mut i32, options: i32) -> i32;
    }
    let child = fork();
    assert!(child >= 0, "no child: {}", std::io::Error::last_os_error());
    if child == 0 {
        alarm(60);
        // Without the exit handlers of the parent's test.
        _exit(catch_unwind(AssertUnwindSafe(work)).map_or(101, i32::from));
    }
    let mut status = 0_i32;
    // SAFETY: `status` lives through the call, and nothing else uses it.
    let waited = unsafe { waitpid(child, &raw mut status, 0) };
    assert_eq!(waited, child, "{}", std::io::Error::last_os_error());
    // Bits 6:0 have the signal that has ended it, bits 15:8 its code.
    let [signal, code, ..] = status.to_le_bytes();
    (signal & 0x7F == 0).then_some(code)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Crew;

    #[test]
    fn a_forked_child_is_another_process() {
        let here = Process::this();
        assert!(here.is_this() && here == Process::default());
        assert_eq!(in_forked_child(|| u8::from(here.is_this())), Some(0));
        assert!(here.is_this());
    }

    /// Helpers that a child has no part of would never end.
    #[test]
    fn a_forked_child_drops_a_crew_and_the_parents_goes_on() {
        let mut crew = Crew::new("forked", 2);
        let sum = |crew: &mut Crew| {
            let sums = std::sync::Mutex::new(0);
            crew.each(0..100, |n| *sums.lock().expect("no panic") += n);
            sums.into_inner().expect("no panic")
        };
        assert_eq!(sum(&mut crew), 4950);
        assert_eq!(
            in_forked_child(|| {
                drop(std::mem::take(&mut crew));
                7
            }),
            Some(7)
        );
        assert_eq!(sum(&mut crew), 4950);
        assert_eq!(crew.threads(), 3);
    }
}
