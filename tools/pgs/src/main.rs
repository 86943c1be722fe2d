//! Command line tool of the zynq-pgs driver: steps scenes and folders of arrays on a board, real
//! or emulated.
//!
//! Results go to stdout, everything else to stderr; with `--json` a fault of the board goes to
//! both. [`pgs_command::failure`] defines the exit codes.

#![forbid(unsafe_code)]

mod a53;
mod bug_report;
mod cli;
mod difference;
#[cfg(feature = "pages")]
mod pages;
mod power;
mod traced;
mod verbs;

use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;

use signal_hook::consts::SIGXFSZ;
use signal_hook::flag;

use pgs_command::{environment, failure};

/// Sends the log to stderr: warnings, unless the environment sets another filter.
fn log_to_stderr() {
    let filter = environment::variable(environment::LOG);
    let filter = filter.map_or("warn".into(), |text| text.to_string_lossy().into_owned());
    env_logger::Builder::new().parse_filters(&filter).init();
}

/// Makes a write past the limit on the size of files (`ulimit -f`) fail with an error; by default
/// the system would end the program.
fn survive_file_limit() {
    // The flag is not read: the failed write reports the limit.
    if let Err(error) = flag::register(SIGXFSZ, Arc::default()) {
        log::warn!("a file that grows past the limit will end the program: {error}");
    }
}

/// Bytes of the stack of the command, whatever the limit of the system is (`ulimit -s`).
const STACK: usize = 8 << 20;

fn main() -> ExitCode {
    // Named as the system's first thread, whose name stands in the message of a panic.
    let command = thread::Builder::new().name("main".to_owned()).stack_size(STACK).spawn(run);
    match command {
        // The message of a panic is out already.
        Ok(command) => command.join().unwrap_or(ExitCode::from(101)),
        // The system gives no thread: its own stack may do.
        Err(_) => run(),
    }
}

/// Runs the command of the command line.
fn run() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    cli::color(&arguments).write_global();
    log_to_stderr();
    survive_file_limit();
    #[cfg(feature = "pages")]
    if let Some(code) = pages::generate_if_asked() {
        return code;
    }
    let command = match cli::parse(&arguments, |name| std::env::var_os(name)) {
        Ok(command) => command,
        Err(message) => return failure::report_usage(&message),
    };
    let mut out = anstream::stdout().lock();
    let done = command
        .verb
        .run(&command.common, &mut out)
        .and_then(|verdict| out.flush().map(|()| verdict).map_err(failure::Failure::from));
    match done {
        Ok(verdict) => verdict.code(),
        Err(failure) => {
            if command.common.json {
                failure.write_document(&mut out);
            }
            failure.report(&mut anstream::stderr().lock())
        }
    }
}
