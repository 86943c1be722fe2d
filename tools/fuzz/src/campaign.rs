//! Runs a target many times, on several threads, under a watchdog.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use crate::random;
use crate::tally::Tally;
use crate::targets::Target;

/// The executions of a campaign, and their settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Number of the first execution.
    pub first: u64,
    /// Executions, at most.
    pub executions: u64,
    /// Time after which no execution begins.
    pub time: Duration,
    /// Seed of the inputs.
    pub seed: u64,
    /// Threads, at least one.
    pub threads: u64,
}

/// The result of a campaign.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// Executions that ended.
    pub executions: u64,
    /// Counts over all executions.
    pub tally: Tally,
    /// The first execution that panicked; none starts after it.
    pub panicked: Option<u64>,
}

/// Time after which an execution counts as hanging.
const LIMIT: Duration = Duration::from_secs(60);
/// Longest time between two looks at the running executions.
const WATCH_INTERVAL: Duration = Duration::from_millis(200);
/// Messages that wait for the watchdog.
const QUEUE: usize = 1024;

/// Runs a target. An execution beyond its time limit cannot be stopped: it ends the program, with
/// the command that repeats it on stderr.
pub fn run(target: &Target, plan: &Plan) -> Summary {
    let start = Instant::now();
    let next = AtomicU64::new(plan.first);
    let last = plan.first.saturating_add(plan.executions).min(u64::MAX / 2);
    // A thread, its execution, and nothing at the beginning; at the end the counts, if it ended.
    let (sender, messages) = mpsc::sync_channel::<(u64, u64, Option<Option<Tally>>)>(QUEUE);
    let mut summary = Summary::default();
    thread::scope(|scope| {
        for number in 0..plan.threads.max(1) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                let mut input = Vec::new();
                while start.elapsed() < plan.time {
                    let execution = next.fetch_add(1, Ordering::Relaxed);
                    // The receiver lives until the last sender is gone.
                    if execution >= last || sender.send((number, execution, None)).is_err() {
                        break;
                    }
                    random::fill(&mut input, plan.seed, target.name, execution, target.longest);
                    let tally = catch_unwind(AssertUnwindSafe(|| (target.run)(&input))).ok();
                    if tally.is_none() {
                        next.store(last, Ordering::Relaxed);
                    }
                    let _ = sender.send((number, execution, Some(tally)));
                }
            });
        }
        drop(sender);
        let mut running = BTreeMap::new();
        loop {
            match messages.recv_timeout(WATCH_INTERVAL) {
                Ok((thread, execution, None)) => {
                    running.insert(thread, (execution, Instant::now()));
                }
                Ok((thread, execution, Some(ended))) => {
                    running.remove(&thread);
                    summary.executions += 1;
                    match ended {
                        Some(tally) => summary.tally += tally,
                        None => {
                            let first = summary.panicked.unwrap_or(execution);
                            summary.panicked = Some(first.min(execution));
                        }
                    }
                }
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {
                    if let Some((held, _)) = running.values().find(|of| of.1.elapsed() > LIMIT) {
                        hung(target, plan, *held);
                    }
                }
            }
        }
    });
    summary
}

/// The command that repeats an execution.
#[must_use]
pub fn again(target: &Target, seed: u64, number: u64) -> String {
    format!("fuzz {} --seed {seed} --first {number} --executions 1", target.name)
}

#[allow(clippy::print_stderr, reason = "the program ends here")]
fn hung(target: &Target, plan: &Plan, number: u64) -> ! {
    eprintln!("FOUND: not finished after {LIMIT:?}");
    eprintln!("  again: {}", again(target, plan.seed, number));
    process::exit(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(executions: u64, threads: u64) -> Plan {
        Plan { first: 0, executions, time: Duration::MAX, seed: 3, threads }
    }

    fn counts(input: &[u8]) -> Tally {
        Tally { beats: input.iter().map(|byte| u64::from(*byte)).sum(), ..Tally::default() }
    }

    const COUNTS: Target = Target { name: "counts", about: "", run: counts, longest: 9 };

    #[test]
    fn every_execution_is_run_once_whatever_the_number_of_threads() {
        let one = run(&COUNTS, &plan(1000, 1));
        assert_eq!((one.executions, one.panicked), (1000, None));
        assert!(one.tally.beats > 0);
        assert_eq!(run(&COUNTS, &plan(1000, 4)), one);
        let [mut first, second] = [0, 400].map(|first| {
            run(&COUNTS, &Plan { first, ..plan(if first == 0 { 400 } else { 600 }, 3) })
        });
        first.tally += second.tally;
        assert_eq!(first.tally, one.tally);
    }

    #[test]
    fn time_ends_a_campaign_of_any_number_of_executions() {
        let time = Duration::from_millis(30);
        assert!(run(&COUNTS, &Plan { time, ..plan(u64::MAX, 2) }).executions > 0);
        assert_eq!(run(&COUNTS, &Plan { time: Duration::ZERO, ..plan(1000, 2) }).executions, 0);
    }

    fn fails(input: &[u8]) -> Tally {
        assert!(input.len() < 8, "an input of {} bytes", input.len());
        Tally::default()
    }

    #[test]
    fn a_panic_ends_the_campaign_and_is_repeated_by_its_number() {
        let target = Target { name: "fails", about: "", run: fails, longest: 9 };
        let found = run(&target, &plan(1000, 2));
        assert!(found.executions < 1000, "the campaign went on");
        let number = found.panicked.expect("one in five inputs is that long");
        let one = Plan { first: number, ..plan(1, 1) };
        assert_eq!(run(&target, &one).panicked, Some(number));
        assert_eq!(again(&target, 3, 7), "fuzz fails --seed 3 --first 7 --executions 1");
    }
}
