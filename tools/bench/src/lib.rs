//! Shared by the benchmarks: medians of interleaved runs.
//!
//! Times of one machine mean little on another, and on a busy machine little from one minute to the
//! next. So the compared items run in turn, one run of each, and the result is the ratio of their
//! medians.
//!
//! ```sh
//! cargo bench --bench speed      # the emulated board beside a solver on the CPU
//! cargo bench --bench pack       # packing beside memcpy; with --threads 2 beside one thread, too
//! ```

#![forbid(unsafe_code)]

pub mod options;
pub mod step;

use std::error::Error;
use std::io::{self, Write as _};
use std::process::ExitCode;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// A timed run; the caller keeps its result from being optimised away.
pub type Run<'a> = Box<dyn FnMut() + 'a>;

/// Ends a benchmark: code 0, or code 2 after the error on stderr.
#[must_use]
pub fn exit_code(outcome: Result<(), Box<dyn Error>>) -> ExitCode {
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    let _ = writeln!(io::stderr(), "error: {error}");
    ExitCode::from(2)
}

/// The clock of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Wall time.
    Wall,
    /// Time of the running thread. On a busy machine the wall time is far longer.
    Thread,
}

impl Clock {
    fn now(self) -> Duration {
        let id = match self {
            Self::Wall => ClockId::CLOCK_MONOTONIC,
            Self::Thread => ClockId::CLOCK_THREAD_CPUTIME_ID,
        };
        // Every Linux has both; a zero in its place would look like a time.
        Duration::from(clock_gettime(id).expect("a clock that every Linux has"))
    }
}

/// Unmeasured runs of a stretch: they load the caches. The last-level cache replaces old lines
/// slowly, so that it takes some runs until one is as fast as the next.
const WARMING: usize = 10;
/// Measured runs of a stretch.
const MEASURED: usize = 3;
/// Runs of a stretch.
pub const STRETCH: usize = WARMING + MEASURED;

/// Runs all in turn, in `stretches` stretches each; returns the median time of each.
///
/// In a stretch, one run has the machine and its caches to itself. The first runs of a stretch fill
/// the caches and do not count.
pub fn warm_medians(stretches: usize, clock: Clock, contestants: &mut [Run<'_>]) -> Vec<Duration> {
    let mut times = vec![Vec::with_capacity(stretches * MEASURED); contestants.len()];
    for _ in 0..stretches {
        for (run, times) in contestants.iter_mut().zip(&mut times) {
            (0..WARMING).for_each(|_| run());
            for _ in 0..MEASURED {
                let begin = clock.now();
                run();
                times.push(clock.now().saturating_sub(begin));
            }
        }
    }
    times.into_iter().map(median).collect()
}

/// The median, the later of two middle values; zero without values.
#[must_use]
pub fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// In milliseconds.
#[must_use]
pub fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// The ratio of the first time to the second.
#[must_use]
pub fn ratio(time: Duration, of: Duration) -> f64 {
    time.as_secs_f64() / of.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn each_has_a_stretch_to_itself() {
        let order = RefCell::new(String::new());
        let mut contestants: Vec<Run<'_>> = vec![
            Box::new(|| order.borrow_mut().push('a')),
            Box::new(|| order.borrow_mut().push('b')),
        ];
        assert_eq!(warm_medians(2, Clock::Thread, &mut contestants).len(), 2);
        drop(contestants);
        let stretch = |it: &str| it.repeat(STRETCH);
        assert_eq!(order.into_inner(), (stretch("a") + &stretch("b")).repeat(2));
    }

    #[test]
    fn both_clocks_run() {
        for clock in [Clock::Wall, Clock::Thread] {
            let begin = clock.now();
            // Bounded: a clock that stands still fails the test instead of hanging it.
            let _ = (0..100_000_000).find(|_| clock.now() != begin);
            assert!(clock.now() > begin);
        }
    }

    #[test]
    fn a_median_is_the_middle() {
        let times =
            |list: &[u64]| median(list.iter().copied().map(Duration::from_millis).collect());
        assert_eq!(times(&[9, 1, 5]), Duration::from_millis(5));
        assert_eq!(times(&[]), Duration::ZERO);
    }
}
