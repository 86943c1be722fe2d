//! This file lets Ctrl-C end a command between two steps, when no channel is running.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Has `act` done, in a thread of its own, when Ctrl-C is pressed or the system asks to end.
pub(crate) fn take_over(act: impl FnMut() + Send + 'static) {
    if let Err(error) = ctrlc::set_handler(act) {
        log::warn!("Ctrl-C will end the program at once: {error}");
    }
}

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone)]
pub(crate) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Takes Ctrl-C over from the system, which would leave the channels running.
    pub(crate) fn install() -> Self {
        let flag = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&flag);
        take_over(move || seen.store(true, Ordering::Relaxed));
        Self(flag)
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
