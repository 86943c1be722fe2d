//! Runs a program in a guest, and forwards its accesses to the board's registers to the host.
#![allow(clippy::print_stderr, reason = "a command line tool")]

use std::process::ExitCode;

#[cfg(all(target_arch = "aarch64", target_os = "linux"))]
fn main() -> ExitCode {
    use std::error::Error as _;
    use std::ffi::OsString;

    use guest_board::trap::{TraceError, become_traced, run};

    env_logger::init();
    let program: Vec<OsString> = std::env::args_os().skip(1).collect();
    let fail = |error: TraceError| {
        eprintln!("pgs-trap: {error}");
        let mut cause = error.source();
        while let Some(error) = cause {
            eprintln!("  because {error}");
            cause = error.source();
        }
        // The shell's code for a command that cannot be run.
        ExitCode::from(126)
    };
    match program.split_first() {
        None => {
            eprintln!("usage: pgs-trap PROGRAM [ARGUMENT]...");
            ExitCode::from(2)
        }
        Some((first, rest)) if first == "--traced" => fail(become_traced(rest)),
        Some(_) => match run(&program) {
            Ok((code, counts)) => {
                eprintln!(
                    "pgs-trap: {} regions, {} reads, {} writes",
                    counts.regions, counts.reads, counts.writes
                );
                ExitCode::from(code)
            }
            Err(error) => fail(error),
        },
    }
}

#[cfg(not(all(target_arch = "aarch64", target_os = "linux")))]
fn main() -> ExitCode {
    eprintln!("pgs-trap: runs in an aarch64 guest only");
    ExitCode::from(2)
}
