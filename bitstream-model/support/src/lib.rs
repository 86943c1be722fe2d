//! Threads that share work which borrows from the caller. They wait from one time to the next:
//! nothing is started and nothing allocated in between.
//!
//! The caller waits only for threads that have begun: a late one finds nothing to do.
//!
//! All work is done in the [standard floating-point environment](float_env), on every thread: what
//! is computed depends neither on the thread that computes it nor on who started that.
//!
//! ```
//! let mut crew = pgs_support::Crew::new("sums", 1);
//! let (numbers, mut sums) = ([1, 2, 3, 4, 5, 6], [0; 2]);
//! crew.each(sums.iter_mut().zip(numbers.chunks(3)), |(to, part)| *to = part.iter().sum());
//! assert_eq!(sums, [6, 15]);
//! ```

#![allow(
    unsafe_code,
    reason = "threads that outlive a call borrow from its caller; registers and SIMD instructions"
)]

// Here, because everything else depends on this crate: no other error comes before it.
#[cfg(not(all(target_os = "linux", target_pointer_width = "64")))]
compile_error!(
    "zynq-pgs, with its emulated board, is for Linux on 64-bit processors: it reaches boards through the \
     kernel's UIO and shares memory with them. On another system, build it in a Linux container or \
     virtual machine."
);

pub mod float_env;
pub mod lanes;
mod process;
pub mod random;
#[cfg(test)]
mod tests;

use std::any::Any;
use std::mem::{self, ManuallyDrop};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::{fmt, io};

use float_env::standard;
pub use process::Process;
#[cfg(any(test, feature = "forked-child"))]
pub use process::in_forked_child;

/// The work of every thread that comes in time; the argument is the thread's number, the caller's
/// 0.
type Work = dyn Fn(usize) + Sync;

#[derive(Default)]
struct State {
    work: Option<&'static Work>,
    /// How often there was work.
    times: u64,
    /// Helpers that are at work.
    busy: usize,
    /// The first panic of a helper.
    panic: Option<Box<dyn Any + Send>>,
    end: bool,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    begun: Condvar,
    left: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing that may panic is done under the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The loop of a helper, until the crew ends.
    fn help(&self, number: usize) {
        let mut seen = 0;
        let mut state = self.state();
        while !state.end {
            let work = if state.times == seen { None } else { state.work };
            seen = state.times;
            let Some(work) = work else {
                state = self.begun.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.busy += 1;
            drop(state);
            let done = catch_unwind(AssertUnwindSafe(|| standard(|| work(number))));
            state = self.state();
            state.busy -= 1;
            // The first is passed on.
            let another = done.err().and_then(|panic| match &mut state.panic {
                Some(_) => Some(panic),
                none => {
                    *none = Some(panic);
                    None
                }
            });
            // Only the caller waits for it.
            self.left.notify_one();
            if another.is_some() {
                drop(state);
                // Dropping its payload may panic, too.
                let _ = catch_unwind(AssertUnwindSafe(|| drop(another)));
                state = self.state();
            }
        }
    }
}

/// The calling thread and its helpers, which end when it goes. By default there are none.
#[derive(Default)]
pub struct Crew {
    shared: Arc<Shared>,
    helpers: Vec<JoinHandle<()>>,
    process: Process,
    refused: Option<io::Error>,
}

impl fmt::Debug for Crew {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Crew").field("helpers", &self.helpers.len()).finish_non_exhaustive()
    }
}

impl Crew {
    /// A crew of the caller and `helpers` helpers, or fewer if the system refuses a thread. The
    /// helpers' threads are called `name` and their number, from 1.
    #[must_use]
    pub fn new(name: &str, helpers: usize) -> Self {
        let mut crew = Self::default();
        for number in 1..=helpers {
            let shared = Arc::clone(&crew.shared);
            let thread = Builder::new().name(format!("{name} {number}"));
            match thread.spawn(move || shared.help(number)) {
                Ok(helper) => crew.helpers.push(helper),
                Err(error) => {
                    crew.refused = Some(error);
                    break;
                }
            }
        }
        crew
    }

    /// The number of threads, the caller's included.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.helpers.len() + 1
    }

    /// Whether there is no thread but the caller's.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.helpers.is_empty()
    }

    /// The error that left the crew with fewer helpers than requested, if any.
    #[must_use]
    pub fn refused(&self) -> Option<&io::Error> {
        self.refused.as_ref()
    }

    /// Calls `work` for each share, on the first thread that is free, and returns when all shares
    /// are done. A single share wakes no helper.
    ///
    /// # Panics
    ///
    /// If `work` panics, on any thread; some shares may then be left out. The crew stays usable.
    pub fn each<T>(&mut self, shares: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
        if self.is_alone() || matches!(shares.size_hint().1, Some(0 | 1)) {
            standard(|| shares.for_each(work));
            return;
        }
        let shares = Mutex::new(shares);
        self.run(&|_| {
            loop {
                let share = shares.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(share) = share else { break };
                work(share);
            }
        });
    }

    /// Calls `work` once on the caller's thread, number 0, and on every helper that comes in time.
    /// Returns when the caller's call has ended and no helper is in one.
    ///
    /// # Panics
    ///
    /// If `work` panics on any thread, after all threads have ended. The crew stays usable.
    pub fn run(&mut self, work: &(dyn Fn(usize) + Sync)) {
        if self.is_alone() {
            standard(|| work(0));
            return;
        }
        // SAFETY: `Leave` takes the work back and waits for the helpers that are at it, also when
        // the caller's part panics: no helper has it when this returns and the borrow ends.
        let lent = unsafe { mem::transmute::<&(dyn Fn(usize) + Sync), &'static Work>(work) };
        let leave = Leave(&self.shared);
        let mut state = self.shared.state();
        state.work = Some(lent);
        // A panic that was never reported, because the caller panicked too.
        let untold = state.panic.take();
        state.times += 1;
        drop(state);
        drop(untold);
        self.shared.begun.notify_all();
        standard(|| work(0));
        drop(leave);
        let panic = self.shared.state().panic.take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

/// Ends the work: no helper begins it any more, and the busy ones are waited for.
struct Leave<'a>(&'a Shared);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.work = None;
        while state.busy > 0 {
            state = self.0.left.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        if !self.process.is_this() {
            // A forked child has no helpers: their end would never come, and the lock may be held.
            let _ = ManuallyDrop::new(mem::take(&mut self.helpers));
            return;
        }
        self.shared.state().end = true;
        self.shared.begun.notify_all();
        for helper in self.helpers.drain(..) {
            // Its panic was passed on already.
            let _ = helper.join();
        }
    }
}
