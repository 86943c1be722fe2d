//! Bounds every wait by a deadline on the platform's clock.

use std::time::Duration;

use super::Platform;

/// The moment at which a wait has failed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deadline {
    started: Duration,
    limit: Duration,
}

impl Deadline {
    /// `limit` from now.
    pub(crate) fn after(platform: &dyn Platform, limit: Duration) -> Self {
        Self { started: platform.now(), limit }
    }

    /// How long the wait was allowed to take.
    pub(crate) fn limit(&self) -> Duration {
        self.limit
    }

    /// Time left; zero once the deadline has passed.
    pub(crate) fn remaining(&self, platform: &dyn Platform) -> Duration {
        self.limit.saturating_sub(platform.now().saturating_sub(self.started))
    }

    /// Whether the deadline has passed.
    pub(crate) fn expired(&self, platform: &dyn Platform) -> bool {
        self.remaining(platform).is_zero()
    }
}

/// First pause between two polls; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_micros(1);
/// Longest pause between two polls.
const LONGEST_PAUSE: Duration = Duration::from_millis(1);

/// Polls `look` until it succeeds; `None` if it still fails at the deadline. It is called at least
/// once, and once after the deadline.
pub(crate) fn poll_until<T>(
    platform: &dyn Platform,
    deadline: &Deadline,
    mut look: impl FnMut() -> Option<T>,
) -> Option<T> {
    let mut pause = FIRST_PAUSE;
    loop {
        // Read before `look`: a process that was not scheduled for long still polls once more.
        let last = deadline.expired(platform);
        if let Some(seen) = look() {
            return Some(seen);
        }
        if last {
            return None;
        }
        platform.pause(pause.min(deadline.remaining(platform)).max(FIRST_PAUSE));
        pause = (pause * 2).min(LONGEST_PAUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::registers::window::fake::FakePlatform;

    #[test]
    fn a_wait_that_never_succeeds_ends_at_its_deadline() {
        let platform = FakePlatform::default();
        let deadline = Deadline::after(&platform, Duration::from_millis(10));
        let mut looks = 0;
        let seen: Option<()> = poll_until(&platform, &deadline, || {
            looks += 1;
            None
        });
        assert!(seen.is_none());
        assert!(deadline.expired(&platform));
        assert!((10..40).contains(&looks), "{looks} looks");
        assert!(platform.now() < Duration::from_millis(12));
    }

    #[test]
    fn a_wait_looks_once_even_without_any_time() {
        let platform = FakePlatform::default();
        let deadline = Deadline::after(&platform, Duration::ZERO);
        assert_eq!(poll_until(&platform, &deadline, || Some(1)), Some(1));
    }
}
