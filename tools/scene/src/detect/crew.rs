//! This file keeps the threads that detection shares its work among. They wait from one time to the
//! next, so that nothing is started and nothing allocated.
//!
//! Nobody waits for a thread that has not begun: one that comes late finds nothing to do.

#![allow(unsafe_code, reason = "threads that outlive a call borrow what it borrows")]

use std::any::Any;
use std::fmt;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

/// What every thread does, as often as it comes.
type Work = dyn Fn() + Sync;

#[derive(Default)]
struct State {
    work: Option<&'static Work>,
    /// How often there was work.
    times: u64,
    /// Helpers that are at work.
    busy: usize,
    /// What a helper panicked with.
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

    /// What a helper does as long as there is a crew.
    fn help(&self) {
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
            let done = catch_unwind(AssertUnwindSafe(work));
            state = self.state();
            state.busy -= 1;
            if let Err(panic) = done {
                state.panic = Some(panic);
            }
            self.left.notify_one();
        }
    }
}

/// The calling thread and its helpers.
#[derive(Default)]
pub(super) struct Crew {
    shared: Arc<Shared>,
    helpers: Vec<JoinHandle<()>>,
}

impl fmt::Debug for Crew {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Crew").field("helpers", &self.helpers.len()).finish_non_exhaustive()
    }
}

impl Crew {
    /// The caller and so many helpers, or as many as the system gives.
    pub(super) fn new(helpers: usize) -> Self {
        let shared = Arc::<Shared>::default();
        let helper = |number| {
            let shared = Arc::clone(&shared);
            Builder::new().name(format!("scene {number}")).spawn(move || shared.help()).ok()
        };
        let helpers = (1..=helpers).map_while(helper).collect();
        Self { shared, helpers }
    }

    /// How many threads there are, the caller's among them.
    pub(super) fn threads(&self) -> usize {
        self.helpers.len() + 1
    }

    /// Does something with each of some shares, whichever thread comes first.
    pub(super) fn each<S>(&mut self, shares: S, work: impl Fn(S::Item) + Sync)
    where
        S: Iterator + Send,
        S::Item: Send,
    {
        if self.helpers.is_empty() || matches!(shares.size_hint().1, Some(0 | 1)) {
            shares.for_each(work);
            return;
        }
        let shares = Mutex::new(shares);
        self.run(&|| {
            loop {
                let share = shares.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(share) = share else { break };
                work(share);
            }
        });
    }

    /// Has every thread do the work that comes in time.
    fn run(&mut self, work: &(dyn Fn() + Sync)) {
        // SAFETY: `Leave` takes the work back and waits for the helpers that are at it, also when
        // the caller's part panics: no helper has it when this returns and the borrow ends.
        let lent = unsafe { mem::transmute::<&(dyn Fn() + Sync), &'static Work>(work) };
        let leave = Leave(&self.shared);
        let mut state = self.shared.state();
        state.work = Some(lent);
        // One that nobody was told of, because the caller panicked too.
        state.panic = None;
        state.times += 1;
        drop(state);
        self.shared.begun.notify_all();
        work();
        drop(leave);
        let panic = self.shared.state().panic.take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

/// Ends the work: no helper begins it any more, and those that have are waited for.
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
        self.shared.state().end = true;
        self.shared.begun.notify_all();
        for helper in self.helpers.drain(..) {
            // What it panicked with was passed on.
            let _ = helper.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Barrier, mpsc};
    use std::thread;
    use std::time::Duration;

    use super::*;

    /// Does something that never ends if a thread stays away, which is a failure.
    fn in_time(work: impl FnOnce() + Send + 'static) {
        let (done, ended) = mpsc::channel::<()>();
        let worker = thread::spawn(move || {
            // Gone on return and on panic.
            let _done = done;
            work();
        });
        // Miri, which runs one thread at a time, is slow.
        let limit = Duration::from_secs(if cfg!(miri) { 600 } else { 60 });
        let ended = ended.recv_timeout(limit);
        assert_eq!(ended, Err(mpsc::RecvTimeoutError::Disconnected), "a thread stayed away");
        if let Err(panic) = worker.join() {
            resume_unwind(panic);
        }
    }

    #[test]
    fn each_share_is_worked_on_once_and_all_are_done_on_return() {
        let times = if cfg!(miri) { 20 } else { 400 };
        for helpers in [0, 1, 3] {
            let mut crew = Crew::new(helpers);
            assert_eq!(crew.threads(), helpers + 1);
            for count in [0, 1, 2, 50].into_iter().cycle().take(times) {
                let mut shares = vec![0; count];
                crew.each(shares.iter_mut(), |share| *share += 1);
                assert_eq!(shares, vec![1; count]);
            }
        }
    }

    #[test]
    fn every_thread_takes_a_share_while_the_others_are_at_theirs() {
        in_time(|| {
            let times = if cfg!(miri) { 5 } else { 100 };
            for helpers in [0, 1, 3] {
                let mut crew = Crew::new(helpers);
                let all = Barrier::new(crew.threads());
                for _ in 0..times {
                    let mut shares = vec![None; crew.threads()];
                    crew.each(shares.iter_mut(), |share| {
                        all.wait();
                        *share = Some(thread::current().id());
                    });
                    for (number, id) in shares.iter().enumerate() {
                        assert!(id.is_some() && !shares[..number].contains(id), "{shares:?}");
                    }
                }
            }
        });
    }

    /// What a crew's work panicked with, which is the number of a share or of a time.
    fn panic_of(work: impl FnOnce()) -> usize {
        let panic = catch_unwind(AssertUnwindSafe(work)).expect_err("a panic");
        *panic.downcast().expect("a number")
    }

    #[test]
    fn a_panic_of_a_share_is_the_callers_and_the_crew_works_on() {
        let mut crew = Crew::new(2);
        for culprit in 0..20 {
            let mut shares: Vec<usize> = (0..20).collect();
            let panic = panic_of(|| {
                crew.each(shares.iter_mut(), |share| {
                    if *share == culprit {
                        resume_unwind(Box::new(culprit));
                    }
                });
            });
            assert_eq!(panic, culprit);
        }
        let mut shares = [1; 20];
        crew.each(shares.iter_mut(), |share| *share = 2);
        assert_eq!(shares, [2; 20]);
    }

    #[test]
    fn a_panic_of_a_helper_is_the_callers_at_once_and_never_again() {
        in_time(|| {
            let mut crew = Crew::new(2);
            let all = Barrier::new(crew.threads());
            // Either helper, then all threads: of those the caller has a panic of its own.
            let culprits = [Some("scene 1"), Some("scene 2"), None];
            for (time, culprit) in culprits.into_iter().cycle().enumerate().take(12) {
                let mut shares = [0; 3];
                let panic = panic_of(|| {
                    crew.each(shares.iter_mut(), |share| {
                        all.wait();
                        if culprit.is_none() || thread::current().name() == culprit {
                            resume_unwind(Box::new(time));
                        }
                        *share = 1;
                    });
                });
                assert_eq!(panic, time);
                let done: usize = shares.iter().sum();
                assert_eq!(done, if culprit.is_some() { 2 } else { 0 });
                crew.each(shares.iter_mut(), |share| *share = 2);
                assert_eq!(shares, [2; 3]);
            }
        });
    }
}
