//! This file lets Ctrl-C end a command: between two steps, or in the middle of one, which the
//! driver then stops and undoes.

use zynq_pgs::Cancellation;

/// Has `act` done, in a thread of its own, when Ctrl-C is pressed or the system asks to end.
pub(crate) fn take_over(act: impl FnMut() + Send + 'static) {
    if let Err(error) = ctrlc::set_handler(act) {
        log::warn!("Ctrl-C will end the program at once: {error}");
    }
}

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone)]
pub(crate) struct Interrupt(Cancellation);

impl Interrupt {
    /// Takes Ctrl-C over from the system, which would leave the channels running.
    pub(crate) fn install() -> Self {
        let cancellation = Cancellation::new();
        let seen = cancellation.clone();
        take_over(move || seen.cancel());
        Self(cancellation)
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.is_cancelled()
    }

    /// What stops a step in the middle.
    pub(crate) fn cancellation(&self) -> Cancellation {
        self.0.clone()
    }
}
