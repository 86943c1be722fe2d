//! Measures host time by laps.

use std::time::{Duration, Instant};

/// Times the phases of a step on the host, one lap each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    /// Begins the first lap.
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the last lap.
    pub(super) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
