//! How the programs of the hardware end without a result.
#![allow(clippy::print_stderr, reason = "a program says why it ends")]

use std::error::Error;
use std::process::ExitCode;

use crate::verify;

/// Wrong usage, or an error that keeps a verb from its result.
const USAGE: u8 = 2;
/// A tool that the verb needs is not installed. Test runners take it as skipped.
const SKIPPED: u8 = 77;

/// Says on stderr why a verb has no result, with all causes, and gives the exit code.
#[must_use]
pub fn without_result(error: &(dyn Error + 'static)) -> ExitCode {
    if let Some(missing @ verify::Error::Missing { .. }) = error.downcast_ref() {
        eprintln!("skipped: {missing}");
        return ExitCode::from(SKIPPED);
    }
    eprintln!("error: {error}");
    let mut cause = error.source();
    while let Some(error) = cause {
        eprintln!("  because: {error}");
        cause = error.source();
    }
    ExitCode::from(USAGE)
}
