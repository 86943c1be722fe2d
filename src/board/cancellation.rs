//! Lets another thread end the step that a caller waits for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends a step from elsewhere: another thread, the handler of a signal.
///
/// An accelerator that was [given](crate::Accelerator::set_cancellation) one looks at it before each
/// step and, while it waits, every ten milliseconds: the step then fails with
/// [`Fault::Cancelled`](crate::Fault::Cancelled), the board is reset, and the bodies are as they
/// were. It holds for every step until it is [cleared](Self::clear). Clones are the same one.
#[derive(Debug, Clone, Default)]
pub struct Cancellation(Arc<AtomicBool>);

impl Cancellation {
    /// One that nobody has asked for yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends the step that is waited for, and those after it.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Lets steps be made again.
    pub fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether it was asked for.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
