//! The start-up self-test: whether a board is built and described as the driver needs it.
//!
//! ```text
//! bring-up: identification, interface version, capabilities, register regions, reset,
//!           dma mode, length register                            stops at the first failure
//! streams:  echo, sums, coherency, interrupt, issue queue, fence  each by itself
//! ```
//!
//! An echo is a step without collisions and without integration: every bitstream returns poses and
//! velocities bit for bit. `pattern.rs` makes the pattern to send, and `judge.rs` compares the
//! results with it.

mod bring_up;
mod fence;
mod judge;
mod pattern;
mod queue;
mod report;
mod streams;

pub use report::{CheckLine, CheckReport, Outcome};

use pgs_support::float_env::standard;

use crate::board::{Found, OpenOptions};
use crate::error::Error;
use crate::step::find;
use report::Lines;

/// Tests a board from its identification to its interrupt. Every wait is bounded: the test takes
/// well under a second on a good board, and a few seconds on a bad one.
///
/// The board is reset. No other process may use it during the test, and it must be opened anew
/// afterwards.
///
/// ```
/// use zynq_pgs::check::Outcome;
/// use zynq_pgs::{OpenOptions, check};
///
/// # fn main() -> Result<(), zynq_pgs::Error> {
/// let report = check(OpenOptions::default())?;
/// for line in &report.lines {
///     if let Outcome::Failed { found, expected, next } = &line.outcome {
///         eprintln!("{}: expected {expected}, found {found}: {next}", line.name);
///     }
/// }
/// assert!(report.passed());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Open`] if there is no board to test, or it cannot be reached.
pub fn check(options: OpenOptions) -> Result<CheckReport, Error> {
    standard(|| check_found(find(&options)?, options.length_width))
}

/// Tests a board that was found.
pub(crate) fn check_found(found: Found, length_width: Option<u32>) -> Result<CheckReport, Error> {
    let board = found.description.clone();
    let mut lines = Lines::default();
    if let Some(accelerator) = bring_up::bring_up(found, length_width, &mut lines)? {
        streams::streams(accelerator, &mut lines);
    }
    Ok(CheckReport { board, lines: lines.finish() })
}
