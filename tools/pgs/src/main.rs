//! Command line tool of the zynq-pgs driver: steps scenes and folders of arrays on a board, real
//! or emulated.
//!
//! Results go to stdout, everything else to stderr; with `--json` a fault of the board goes to both. The exit codes are those of [`failure`].

#![forbid(unsafe_code)]

mod args;
mod board;
mod build;
mod compare;
mod deviation;
mod diagnosis;
mod environment;
mod failure;
mod footprint;
mod interrupt;
mod loading;
mod memory;
mod options;
mod ordering;
mod origin;
mod planned;
mod scenes;
mod sixteen;
mod solver;
mod verbs;

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::Arc;

use signal_hook::consts::SIGXFSZ;
use signal_hook::flag;
use step_folder::{folder, npy};

/// Has the log written to stderr: warnings, or what the environment asks for.
fn log_to_stderr() {
    let text = |name: &str, default: &str| {
        let found = environment::variable(name).map(|text| text.to_string_lossy().into_owned());
        found.unwrap_or_else(|| default.to_owned())
    };
    env_logger::Builder::new()
        .parse_filters(&text(environment::LOG, "warn"))
        .parse_write_style(&text(environment::LOG_STYLE, "auto"))
        .init();
}

/// Has a write past the limit on the size of files (`ulimit -f`) fail with an error that is told,
/// where the system would end the program.
fn survive_file_limit() {
    // Nobody asks the flag: the write says it.
    if let Err(error) = flag::register(SIGXFSZ, Arc::default()) {
        log::warn!("a file that grows past the limit will end the program: {error}");
    }
}

fn main() -> ExitCode {
    log_to_stderr();
    survive_file_limit();
    let command = match args::parse(std::env::args_os(), |name| std::env::var_os(name)) {
        Ok(command) => command,
        Err(message) => return failure::report_usage(&message),
    };
    let mut out = io::stdout().lock();
    let done = verbs::run(&command, &mut out)
        .and_then(|verdict| out.flush().map(|()| verdict).map_err(failure::Failure::from));
    match done {
        Ok(verdict) => verdict.code(),
        Err(failure) => {
            if command.common.json {
                failure.write_document(&mut out);
            }
            failure.report(&mut io::stderr().lock())
        }
    }
}
