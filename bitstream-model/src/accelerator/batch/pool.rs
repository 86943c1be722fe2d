//! This file keeps the threads that help with loading, decoding, passes and integration. They wait in
//! between; nothing is started and nothing allocated from one step to the next.
//!
//! Nobody waits for a thread that has not begun: one that comes late finds nothing to do.

#![allow(unsafe_code, reason = "threads that outlive a call borrow what it borrows")]

use std::any::Any;
use std::fmt;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Work that threads share; each is called with its number, the caller of [`Pool::run`] with 0.
type Job = dyn Fn(usize) + Sync;

#[derive(Default)]
struct State {
    job: Option<&'static Job>,
    /// Jobs begun so far.
    jobs: u64,
    /// Workers that have begun the job and not left it.
    active: usize,
    /// What a worker panicked with.
    panic: Option<Box<dyn Any + Send>>,
    stop: bool,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    begins: Condvar,
    left: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // No code of others runs under the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a worker does until the pool goes.
    fn work(&self, number: usize) {
        let mut seen = 0;
        let mut state = self.state();
        while !state.stop {
            let job = state.job.filter(|_| state.jobs != seen);
            seen = state.jobs;
            let Some(job) = job else {
                state = self.begins.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.active += 1;
            drop(state);
            let done = catch_unwind(AssertUnwindSafe(|| job(number)));
            state = self.state();
            state.active -= 1;
            if let Err(panic) = done {
                state.panic = Some(panic);
            }
            self.left.notify_all();
        }
    }
}

/// The threads.
pub(super) struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pool").field("workers", &self.workers.len()).finish_non_exhaustive()
    }
}

impl Pool {
    /// As many workers as asked for, or as the system gives.
    pub(super) fn new(workers: usize) -> Self {
        let shared = Arc::<Shared>::default();
        let workers = (1..=workers).map_while(|number| {
            let shared = Arc::clone(&shared);
            let thread = std::thread::Builder::new().name(format!("board {number}"));
            let worker = thread.spawn(move || shared.work(number));
            worker.inspect_err(|error| log::warn!("no thread to help the board: {error}")).ok()
        });
        let workers = workers.collect();
        Self { shared, workers }
    }

    /// Whether there is no thread but the caller's.
    pub(super) fn is_empty(&self) -> bool {
        self.workers.is_empty()
    }

    /// Does something with each of some things on all threads, in no particular order. For a single
    /// one nobody is woken.
    pub(super) fn share<T>(
        &mut self,
        things: impl Iterator<Item = T> + Send,
        with: impl Fn(T) + Sync,
    ) {
        if self.is_empty() || things.size_hint().1.is_some_and(|things| things < 2) {
            things.for_each(with);
            return;
        }
        let things = Mutex::new(things);
        self.run(&|_| {
            loop {
                let thing = things.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(thing) = thing else { break };
                with(thing);
            }
        });
    }

    /// Runs work on the calling thread and on every worker that comes in time; returns when the
    /// caller's has ended and no worker is in it.
    pub(super) fn run(&mut self, job: &(dyn Fn(usize) + Sync)) {
        if self.workers.is_empty() {
            job(0);
            return;
        }
        // SAFETY: `Leave` takes the job back and waits for all that have begun it, also when the
        // caller's part panics: no worker has it when this returns and the borrow ends.
        let shared_job = unsafe { mem::transmute::<&(dyn Fn(usize) + Sync), &'static Job>(job) };
        let leave = Leave(&self.shared);
        let mut state = self.shared.state();
        state.job = Some(shared_job);
        // One that nobody was told of, because the caller panicked too.
        state.panic = None;
        state.jobs += 1;
        drop(state);
        self.shared.begins.notify_all();
        job(0);
        drop(leave);
        let panic = self.shared.state().panic.take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

/// Ends a job: nobody begins it any more, and those that have are waited for.
struct Leave<'a>(&'a Shared);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.job = None;
        while state.active > 0 {
            state = self.0.left.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.state().stop = true;
        self.shared.begins.notify_all();
        for worker in self.workers.drain(..) {
            // What it panicked with was passed on.
            let _ = worker.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn work_is_shared_and_has_ended_when_run_returns() {
        let mut pool = Pool::new(3);
        for _ in 0..1000 {
            let (left, done) = (AtomicUsize::new(50), AtomicUsize::new(0));
            pool.run(&|_| {
                while left
                    .fetch_update(Ordering::AcqRel, Ordering::Acquire, |n| n.checked_sub(1))
                    .is_ok()
                {
                    done.fetch_add(1, Ordering::AcqRel);
                }
            });
            assert_eq!(done.into_inner(), 50);
        }
    }

    #[test]
    fn each_thing_is_for_one_thread() {
        let mut pool = Pool::new(2);
        for count in [0, 1, 7, 8, 9, 1000] {
            let (mut to, made) = (vec![usize::MAX; count], AtomicUsize::new(0));
            pool.share(to.iter_mut().enumerate(), |(number, to)| {
                made.fetch_add(1, Ordering::AcqRel);
                *to = 3 * number;
            });
            assert_eq!(made.into_inner(), count);
            assert!((0..).zip(&to).all(|(number, to)| *to == 3 * number));
        }
    }

    #[test]
    fn a_panic_of_any_thread_is_the_callers() {
        let mut pool = Pool::new(2);
        assert_eq!(pool.workers.len(), 2, "threads start");
        for culprit in 0..2 {
            let met = AtomicUsize::new(0);
            let outcome = catch_unwind(AssertUnwindSafe(|| {
                pool.run(&|number| {
                    met.fetch_add(usize::from(number == culprit), Ordering::AcqRel);
                    assert!(number != culprit, "thread {number}");
                    while met.load(Ordering::Acquire) == 0 {
                        std::thread::yield_now();
                    }
                });
            }));
            assert!(outcome.is_err());
        }
        pool.run(&|_| {});
    }
}
