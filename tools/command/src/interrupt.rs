//! Ends a command at Ctrl-C: between two steps, or inside one, which the driver then stops and
//! undoes. A hang-up of the terminal and a request to terminate count as Ctrl-C.
//!
//! A signal that the parent process has set to ignored stays ignored: SIGHUP under `nohup`, SIGINT
//! in a script's background job.

use std::fs;
use std::io;
use std::sync::mpsc;
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use zynq_pgs::Cancellation;

/// The signals that ask a command to end.
const ASKING: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];
/// Where the kernel lists the signals that a process ignores.
const STATUS: &str = "/proc/self/status";

/// Calls `act`, in a thread of its own, at Ctrl-C or when the system asks the process to end.
pub fn take_over(act: impl FnMut() + Send + 'static) {
    // Without /proc nothing is known to be ignored, and the channels must not be left running.
    let ignored = fs::read_to_string(STATUS).ok().and_then(|status| ignored_of(&status));
    let taken = wanted(ignored.unwrap_or(0));
    if let Err(error) = handle(taken, act) {
        log::warn!("Ctrl-C will end the program at once: {error}");
    }
}

/// The asking signals that are not in the mask of ignored ones.
fn wanted(ignored: u64) -> Vec<i32> {
    ASKING.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect()
}

/// The mask of ignored signals in a process's status; bit 0 is signal 1.
fn ignored_of(status: &str) -> Option<u64> {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// Starts a thread that calls `act` at each of the signals. The thread itself installs the
/// handlers: if it does not start, the signals end the program as before.
fn handle(signals: Vec<i32>, mut act: impl FnMut() + Send + 'static) -> io::Result<()> {
    let (tell, told) = mpsc::sync_channel(1);
    thread::Builder::new().name("interrupt".to_owned()).spawn(move || {
        let mut seen = match Signals::new(signals) {
            Ok(seen) => seen,
            Err(error) => return drop(tell.send(Err(error))),
        };
        // The caller waits for it.
        let _ = tell.send(Ok(()));
        for _ in seen.forever() {
            act();
        }
    })?;
    told.recv().unwrap_or_else(|_| Err(io::Error::other("its thread has ended")))
}

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone)]
pub struct Interrupt(Cancellation);

impl Interrupt {
    /// Replaces the system's handling of Ctrl-C, which would leave the channels running.
    pub fn install() -> Self {
        let cancellation = Cancellation::new();
        let seen = cancellation.clone();
        take_over(move || seen.cancel());
        Self(cancellation)
    }

    /// Whether Ctrl-C has come.
    pub fn is_set(&self) -> bool {
        self.0.is_cancelled()
    }

    /// Cancels a running step.
    pub fn cancellation(&self) -> Cancellation {
        self.0.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_status_and_left_out() {
        let status = "Name:\tpgs\nSigBlk:\t0000000000000002\nSigIgn:\t0000000000001001\n";
        assert_eq!(ignored_of(status), Some(0x1001));
        assert_eq!(wanted(0x1001), [SIGINT, SIGTERM]);
        assert_eq!(wanted(1 << (SIGINT - 1) | 1 << (SIGTERM - 1)), [SIGHUP]);
        assert_eq!(wanted(0), ASKING);
        for none in ["", "Name:\tpgs\n", "SigIgn:\tmany\n"] {
            assert_eq!(ignored_of(none), None);
        }
    }
}
