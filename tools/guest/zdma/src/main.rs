//! Drives a foreign DMA engine through the driver's own platform code: UIO nodes found by name,
//! registers and reserved memory mapped, interrupts waited for.
//!
//! Made for the guest of `tools/scripts/kernel-test.sh`; prints a line `ok ...` or `FAIL ...` for
//! each check.
#![allow(clippy::print_stdout, reason = "its output is the report")]

mod checks;
mod engine;
mod transfer;
mod unbound;

use std::error::Error;
use std::process::ExitCode;

/// The outcome of a check: a detail to print, or the reason of its failure.
pub(crate) type Outcome = Result<String, Box<dyn Error>>;

/// A check and its name.
type Check = (&'static str, fn() -> Outcome);

fn main() -> ExitCode {
    let checks: [Check; 8] = [
        ("nodes are found by name", checks::nodes_by_name),
        ("reserved memory keeps beats", checks::memory),
        ("1,000 transfers, with interrupt", transfer::thousand),
        ("interrupt suppressed in the engine", transfer::suppressed_in_engine),
        ("interrupt masked in the kernel", transfer::masked_in_kernel),
        ("interrupt not acknowledged", transfer::not_acknowledged),
        ("a node with an interrupt, unbound while open", unbound::with_interrupt),
        ("a node without an interrupt, unbound while open", unbound::without_interrupt),
    ];
    let mut failed = 0;
    for (name, check) in checks {
        match check() {
            Ok(found) => println!("ok zdma: {name}: {found}"),
            Err(error) => {
                failed += 1;
                println!("FAIL zdma: {name}: {error}");
                let mut source = error.source();
                while let Some(error) = source {
                    println!("  because: {error}");
                    source = error.source();
                }
            }
        }
    }
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
