//! Ends a command at Ctrl-C: between two steps, or inside one, which the driver then stops and
//! undoes.

use zynq_pgs::Cancellation;

/// Calls `act`, in a thread of its own, at Ctrl-C or when the system asks the process to end.
pub(crate) fn take_over(act: impl FnMut() + Send + 'static) {
    if let Err(error) = ctrlc::set_handler(act) {
        log::warn!("Ctrl-C will end the program at once: {error}");
    }
}

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone)]
pub(crate) struct Interrupt(Cancellation);

impl Interrupt {
    /// Replaces the system's handling of Ctrl-C, which would leave the channels running.
    pub(crate) fn install() -> Self {
        let cancellation = Cancellation::new();
        let seen = cancellation.clone();
        take_over(move || seen.cancel());
        Self(cancellation)
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.is_cancelled()
    }

    /// Cancels a running step.
    pub(crate) fn cancellation(&self) -> Cancellation {
        self.0.clone()
    }
}
