//! Tests of a crew: every share once, every thread in time, panics passed on.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Barrier, mpsc};
use std::thread;
use std::time::Duration;

use super::*;

/// How often something is done, which Miri, who runs one thread at a time, does less often.
const fn times(natively: usize, under_miri: usize) -> usize {
    if cfg!(miri) { under_miri } else { natively }
}

/// Does something that never ends if a thread stays away, which is a failure.
fn in_time(work: impl FnOnce() + Send + 'static) {
    let (done, ended) = mpsc::channel::<()>();
    let worker = thread::spawn(move || {
        // Gone on return and on panic.
        let _done = done;
        work();
    });
    let limit = Duration::from_secs(if cfg!(miri) { 600 } else { 60 });
    let ended = ended.recv_timeout(limit);
    assert_eq!(ended, Err(mpsc::RecvTimeoutError::Disconnected), "a thread stayed away");
    if let Err(panic) = worker.join() {
        resume_unwind(panic);
    }
}

#[test]
fn a_crew_has_the_threads_it_was_asked_for_and_by_default_none() {
    for helpers in [0, 1, 3] {
        let crew = Crew::new("test", helpers);
        assert!(crew.refused().is_none(), "{:?}", crew.refused());
        assert_eq!((crew.threads(), crew.is_alone()), (helpers + 1, helpers == 0));
    }
    let mut crew = Crew::default();
    assert_eq!((crew.threads(), crew.is_alone()), (1, true));
    let (caller, done) = (thread::current().id(), AtomicUsize::new(0));
    crew.run(&|number| {
        assert_eq!((number, thread::current().id()), (0, caller));
        done.fetch_add(1, Ordering::AcqRel);
    });
    assert_eq!(done.into_inner(), 1);
}

#[test]
fn each_share_is_worked_on_once_and_all_are_done_on_return() {
    for helpers in [0, 1, 3] {
        let mut crew = Crew::new("test", helpers);
        for count in [0, 1, 2, 7, 8, 9, 50].into_iter().cycle().take(times(700, 21)) {
            let mut shares = vec![(0, usize::MAX); count];
            crew.each(shares.iter_mut().enumerate(), |(number, share)| {
                *share = (share.0 + 1, 3 * number);
            });
            assert!(shares.iter().copied().eq((0..count).map(|number| (1, 3 * number))));
        }
    }
}

#[test]
fn work_without_shares_has_ended_when_run_returns() {
    let mut crew = Crew::new("test", 3);
    for _ in 0..times(1000, 10) {
        let (left, done) = (AtomicUsize::new(50), AtomicUsize::new(0));
        crew.run(&|_| {
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
fn every_thread_takes_a_share_while_the_others_are_at_theirs() {
    in_time(|| {
        for helpers in [0, 1, 3] {
            let mut crew = Crew::new("test", helpers);
            let all = Barrier::new(crew.threads());
            for _ in 0..times(100, 5) {
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

#[test]
fn threads_are_numbered_and_named_and_the_caller_is_the_first() {
    in_time(|| {
        let mut crew = Crew::new("test", 2);
        let (all, caller) = (Barrier::new(crew.threads()), thread::current().id());
        for _ in 0..times(100, 5) {
            let met: [AtomicUsize; 3] = Default::default();
            crew.run(&|number| {
                all.wait();
                met[number].fetch_add(1, Ordering::AcqRel);
                assert_eq!(number == 0, thread::current().id() == caller);
                if number > 0 {
                    assert_eq!(thread::current().name(), Some(&*format!("test {number}")));
                }
            });
            assert_eq!(met.map(AtomicUsize::into_inner), [1; 3]);
        }
    });
}

/// The panic of a crew's work: the number of a share, a thread or a time.
fn panic_of(work: impl FnOnce()) -> usize {
    let panic = catch_unwind(AssertUnwindSafe(work)).expect_err("a panic");
    *panic.downcast().expect("a number")
}

#[test]
fn a_panic_of_a_share_is_the_callers_and_the_crew_works_on() {
    let mut crew = Crew::new("test", 2);
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
fn a_panic_of_any_thread_is_the_callers() {
    in_time(|| {
        let mut crew = Crew::new("test", 2);
        let all = Barrier::new(crew.threads());
        for culprit in 0..3 {
            let ended = AtomicUsize::new(0);
            let panic = panic_of(|| {
                crew.run(&|number| {
                    all.wait();
                    if number == culprit {
                        resume_unwind(Box::new(number));
                    }
                    ended.fetch_add(1, Ordering::AcqRel);
                });
            });
            // The others have ended before the caller panics.
            assert_eq!((panic, ended.into_inner()), (culprit, 2));
        }
        crew.run(&|_| {});
    });
}

#[test]
fn a_panic_of_a_helper_is_the_callers_at_once_and_never_again() {
    in_time(|| {
        let mut crew = Crew::new("test", 2);
        let all = Barrier::new(crew.threads());
        // Either helper, then all threads: then the caller has a panic of its own.
        let culprits = [Some("test 1"), Some("test 2"), None];
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
