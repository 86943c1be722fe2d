//! Runs a target many times, on several threads, under a watchdog.
//!
//! An execution that hangs cannot be stopped: the campaign ends, and its thread runs on until the
//! program ends.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::finding::{self, Ending, Finding};
use crate::random;
use crate::tally::Tally;
use crate::targets::Target;

/// The number of executions, and their settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Executions, at most.
    pub executions: u64,
    /// Time after which no execution begins.
    pub time: Duration,
    /// Seed of the inputs.
    pub seed: u64,
    /// Threads, at least one; fewer where the system does not give them.
    pub threads: usize,
    /// Time limit of an execution.
    pub limit: Duration,
}

/// The result of a campaign.
#[derive(Debug)]
pub struct Summary {
    /// Its name.
    pub target: &'static str,
    /// Executions that ended.
    pub executions: u64,
    /// Host time.
    pub time: Duration,
    /// Threads that ran them.
    pub threads: Threads,
    /// Counts over all executions.
    pub tally: Tally,
    /// The first execution that failed; none starts after it.
    pub finding: Option<Finding>,
}

/// The threads of a campaign.
#[derive(Debug)]
pub struct Threads {
    /// How many ran executions.
    pub ran: usize,
    /// Why there were fewer than planned; `None` if all came.
    pub refused: Option<io::Error>,
    /// Whether a watchdog looked for hangs. The only thread of a program cannot be watched.
    pub watched: bool,
}

impl Threads {
    /// The missing threads, in words; `None` if all of them ran.
    #[must_use]
    pub fn missing(&self) -> Option<String> {
        let error = self.refused.as_ref()?;
        let watch = if self.watched { "" } else { ", and no watchdog for hangs" };
        Some(format!("{} of the planned threads only{watch}: {error}", self.ran))
    }
}

/// Starts a thread, or says why the system gives none.
type Start = fn(Box<dyn FnOnce() + Send>) -> io::Result<()>;

/// Starts a thread of the system that is never joined.
fn start(work: Box<dyn FnOnce() + Send>) -> io::Result<()> {
    thread::Builder::new().name("fuzz".to_owned()).spawn(work).map(drop)
}

/// Executions that a thread takes at a time.
const BLOCK: u64 = 16;
/// Interval of the watchdog.
const WATCH_INTERVAL: Duration = Duration::from_millis(200);
/// No execution.
const NOTHING: u64 = u64::MAX;

/// The state of a thread.
#[derive(Debug)]
struct At {
    /// The execution's number.
    number: AtomicU64,
    /// Its start, ms since the campaign's start.
    since: AtomicU64,
}

/// The threads' shared state.
#[derive(Debug)]
struct Shared {
    plan: Plan,
    target: &'static Target,
    start: Instant,
    /// The next execution that no thread has taken.
    next: AtomicU64,
    done: AtomicU64,
    stop: AtomicBool,
    at: Vec<At>,
    tally: Mutex<Tally>,
    found: Mutex<Vec<Finding>>,
}

impl Shared {
    fn milliseconds(&self) -> u64 {
        u64::try_from(self.start.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Takes and runs executions until none is left.
    fn work(&self, thread: usize) {
        let at = &self.at[thread];
        let mut input = Vec::new();
        let mut tally = Tally::default();
        'all: loop {
            let first = self.next.fetch_add(BLOCK, Ordering::Relaxed);
            for number in first..first.saturating_add(BLOCK).min(self.plan.executions) {
                if self.stop.load(Ordering::Relaxed) || self.start.elapsed() >= self.plan.time {
                    break 'all;
                }
                self.input(&mut input, number);
                at.since.store(self.milliseconds(), Ordering::Relaxed);
                at.number.store(number, Ordering::Release);
                let ended = finding::run(self.target, &input);
                at.number.store(NOTHING, Ordering::Release);
                match ended {
                    Ok(of_one) => tally += of_one,
                    Err(message) => self.find(number, input.clone(), Ending::Panic(message)),
                }
                self.done.fetch_add(1, Ordering::Relaxed);
            }
            if first.saturating_add(BLOCK) >= self.plan.executions {
                break;
            }
        }
        *self.tally.lock().unwrap_or_else(PoisonError::into_inner) += tally;
    }

    fn input(&self, input: &mut Vec<u8>, number: u64) {
        random::fill(input, self.plan.seed, self.target.name, number, self.target.longest);
    }

    fn find(&self, number: u64, input: Vec<u8>, ending: Ending) {
        let finding = Finding { target: self.target.name, number, input, ending };
        self.found.lock().unwrap_or_else(PoisonError::into_inner).push(finding);
        self.stop.store(true, Ordering::Relaxed);
    }

    /// An execution beyond its time limit, if there is one.
    fn overdue(&self) -> Option<u64> {
        let now = self.milliseconds();
        let limit = u64::try_from(self.plan.limit.as_millis()).unwrap_or(u64::MAX);
        self.at
            .iter()
            .map(|at| (at.number.load(Ordering::Acquire), at.since.load(Ordering::Relaxed)))
            .find(|(number, since)| *number != NOTHING && now.saturating_sub(*since) > limit)
            .map(|(number, _)| number)
    }
}

/// Runs a target. `progress` gets the number of ended executions from time to time.
pub fn run(target: &'static Target, plan: &Plan, progress: impl FnMut(u64)) -> Summary {
    run_on(start, target, plan, progress)
}

/// The same on threads that come from `start`.
fn run_on(
    start: Start,
    target: &'static Target,
    plan: &Plan,
    mut progress: impl FnMut(u64),
) -> Summary {
    let threads = plan.threads.max(1);
    let at = || At { number: AtomicU64::new(NOTHING), since: AtomicU64::new(0) };
    let shared = Arc::new(Shared {
        plan: *plan,
        target,
        start: Instant::now(),
        next: AtomicU64::new(0),
        done: AtomicU64::new(0),
        stop: AtomicBool::new(false),
        at: (0..threads).map(|_| at()).collect(),
        tally: Mutex::default(),
        found: Mutex::default(),
    });
    let (ended, end) = mpsc::channel::<()>();
    let mut used = Threads { ran: 0, refused: None, watched: true };
    while used.ran < threads {
        let (shared, ended, thread) = (Arc::clone(&shared), ended.clone(), used.ran);
        // After a hang the caller does not wait for this thread.
        let work = move || {
            shared.work(thread);
            drop(ended);
        };
        match start(Box::new(work)) {
            Ok(()) => used.ran += 1,
            Err(error) => {
                used.refused = Some(error);
                break;
            }
        }
    }
    drop(ended);
    if used.ran == 0 {
        used = Threads { ran: 1, watched: false, ..used };
        shared.work(0);
    }
    // The channel closes when the last thread ends.
    while end.recv_timeout(WATCH_INTERVAL) == Err(RecvTimeoutError::Timeout) {
        progress(shared.done.load(Ordering::Relaxed));
        if let Some(number) = shared.overdue() {
            let mut input = Vec::new();
            shared.input(&mut input, number);
            shared.find(number, input, Ending::Hang(plan.limit));
            break;
        }
    }
    let mut found = shared.found.lock().unwrap_or_else(PoisonError::into_inner).clone();
    found.sort_by_key(|finding| finding.number);
    let tally = *shared.tally.lock().unwrap_or_else(PoisonError::into_inner);
    Summary {
        target: target.name,
        executions: shared.done.load(Ordering::Relaxed),
        time: shared.start.elapsed(),
        threads: used,
        tally,
        finding: found.into_iter().next(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(executions: u64, threads: usize) -> Plan {
        let limit = Duration::from_secs(20);
        Plan { executions, time: Duration::MAX, seed: 3, threads, limit }
    }

    fn counts(input: &[u8]) -> Tally {
        Tally { beats: input.iter().map(|byte| u64::from(*byte)).sum(), ..Tally::default() }
    }

    #[test]
    fn every_execution_is_run_once_whatever_the_number_of_threads() {
        static TARGET: Target = Target { name: "counts", about: "", run: counts, longest: 9 };
        let one = run(&TARGET, &plan(1000, 1), |_| ());
        let four = run(&TARGET, &plan(1000, 4), |_| ());
        assert_eq!((one.executions, four.executions), (1000, 1000));
        assert!(one.tally.beats > 0 && one.tally == four.tally);
        assert!(one.finding.is_none() && four.finding.is_none());
    }

    /// Gives two threads, then none, as a container's limit on processes does.
    fn two(work: Box<dyn FnOnce() + Send>) -> io::Result<()> {
        static GIVEN: AtomicU64 = AtomicU64::new(0);
        match GIVEN.fetch_add(1, Ordering::Relaxed) {
            0 | 1 => start(work),
            _ => none(work),
        }
    }

    fn none(_: Box<dyn FnOnce() + Send>) -> io::Result<()> {
        Err(io::ErrorKind::WouldBlock.into())
    }

    #[test]
    fn where_the_system_refuses_threads_fewer_run_everything_and_the_summary_says_so() {
        static TARGET: Target = Target { name: "counts", about: "", run: counts, longest: 9 };
        let all = run(&TARGET, &plan(1000, 4), |_| ());
        assert!(all.threads.missing().is_none() && all.threads.ran == 4, "{:?}", all.threads);
        for (start, ran, watched) in [(two as Start, 2, true), (none, 1, false)] {
            let fewer = run_on(start, &TARGET, &plan(1000, 4), |_| ());
            assert_eq!((fewer.executions, fewer.tally), (1000, all.tally));
            assert_eq!((fewer.threads.ran, fewer.threads.watched), (ran, watched));
            let missing = fewer.threads.missing().expect("threads are missing");
            assert_eq!(missing.contains("no watchdog"), !watched, "{missing}");
        }
    }

    #[test]
    fn time_ends_a_campaign_of_any_number_of_executions() {
        static TARGET: Target = Target { name: "counts", about: "", run: counts, longest: 9 };
        let time = Duration::from_millis(30);
        let summary = run(&TARGET, &Plan { time, ..plan(u64::MAX, 2) }, |_| ());
        assert!(summary.executions > 0 && summary.time >= time, "{summary:?}");
        let none = run(&TARGET, &Plan { time: Duration::ZERO, ..plan(1000, 2) }, |_| ());
        assert_eq!(none.executions, 0);
    }

    fn fails(input: &[u8]) -> Tally {
        assert!(input.len() < 8, "an input of {} bytes", input.len());
        Tally::default()
    }

    #[test]
    fn a_panic_is_a_finding_whose_input_panics_again() {
        static TARGET: Target = Target { name: "fails", about: "", run: fails, longest: 9 };
        let summary = run(&TARGET, &plan(1000, 2), |_| ());
        let finding = summary.finding.expect("one in five inputs is that long");
        assert!(finding.input.len() >= 8);
        let Ending::Panic(message) = &finding.ending else { panic!("{:?}", finding.ending) };
        let what = format!("an input of {} bytes", finding.input.len());
        assert!(message.contains(&what) && message.contains("campaign.rs"), "{message}");
        let again = finding::run(&TARGET, &finding.input).expect_err("it panics again");
        assert_eq!(again, *message);
        assert!(summary.executions < 1000, "the campaign went on");
    }

    fn hangs(input: &[u8]) -> Tally {
        if input.len() == 9 {
            // The other end lives as long as the wait.
            let (end, never) = mpsc::channel::<()>();
            let _ = never.recv();
            drop(end);
        }
        Tally::default()
    }

    #[test]
    fn a_hang_is_a_finding_and_ends_the_campaign() {
        static TARGET: Target = Target { name: "hangs", about: "", run: hangs, longest: 9 };
        let limit = Duration::from_millis(300);
        let summary = run(&TARGET, &Plan { limit, ..plan(1000, 1) }, |_| ());
        let finding = summary.finding.expect("an input of nine bytes");
        assert_eq!((finding.input.len(), finding.ending), (9, Ending::Hang(limit)));
    }
}
