//! Lets another thread end the step that a caller waits for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends a step from another thread or from a signal handler.
///
/// An accelerator checks the cancellation that it was [given](crate::Accelerator::set_cancellation)
/// before each step, and every ten milliseconds while it waits. A cancelled step fails with
/// [`Fault::Cancelled`](crate::Fault::Cancelled), the board is reset, and the bodies are unchanged.
/// Every step fails so until the cancellation is [cleared](Self::clear). Clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Cancellation(Arc<AtomicBool>);

impl Cancellation {
    /// A cancellation that is not set.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends the step that a caller waits for, and every later one.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Allows steps again.
    pub fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether it is set.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
