//! Command line of the hardware generator. `--help` lists the verbs.
#![forbid(unsafe_code)]

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use rtlgen::ending::without_result;

mod verbs;

/// Generates and verifies the accelerator in Verilog.
#[derive(Debug, Parser)]
#[command(name = "rtlgen", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  rtlgen generate --out rtl            the accelerator, as a folder of Verilog for a tool
  rtlgen generate --inertia world --out rtl-world    the same for boxes, capsules and any masses
  rtlgen simulator --out rtl-sim       a simulator of it, for `pgs --accelerator \
  rtl:rtl-sim/pgs-rtl`
  rtlgen schedule                      depths, units and delays of the pipelines
  rtlgen operators --vectors 1000000   the operators against an independent reference
  rtlgen sincos --all                  sine and cosine in fixed point against libm
  rtlgen sincos --all --verilog        and the Verilog of them, in about a minute more

Exit codes: 0 done; 1 a check failed; 2 wrong usage or an error; 77 a tool that the verb needs is
not installed.";

#[derive(Debug, Subcommand)]
enum Verb {
    Generate(verbs::generate::Generate),
    Simulator(verbs::simulator::Simulator),
    Schedule(verbs::schedule::Schedule),
    Operators(verbs::operators::Operators),
    Sincos(verbs::sincos::Sincos),
}

fn main() -> ExitCode {
    let mut out = io::stdout().lock();
    let done = match Cli::try_parse() {
        Ok(cli) => act(&cli.verb, &mut out),
        Err(message) if message.use_stderr() => message.exit(),
        // Help or the version.
        Err(message) => write!(out, "{message}").map(|()| ExitCode::SUCCESS).map_err(Into::into),
    };
    match done.and_then(|code| out.flush().map(|()| code).map_err(Into::into)) {
        Ok(code) => code,
        // The reader of a pipe has seen enough.
        Err(verbs::Error::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
            ExitCode::SUCCESS
        }
        Err(verbs::Error::Verify(error)) => without_result(&error),
        Err(error) => without_result(&error),
    }
}

/// Runs a verb. Its result goes to `out`, its progress to stderr.
fn act(verb: &Verb, out: &mut dyn Write) -> Result<ExitCode, verbs::Error> {
    match verb {
        Verb::Generate(args) => verbs::generate::run(args, out),
        Verb::Simulator(args) => verbs::simulator::run(args, out),
        Verb::Schedule(args) => verbs::schedule::run(args, out),
        Verb::Operators(args) => verbs::operators::run(args, out),
        Verb::Sincos(args) => verbs::sincos::run(args, out),
    }
}
