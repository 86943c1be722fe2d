//! Command line of the hardware generator. `--help` lists the verbs.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "a program says what it does")]

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

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
  rtlgen operators --vectors 1000000   the operators against an independent reference

Exit codes: 0 done; 1 a check failed; 2 wrong usage; 77 a tool that the verb needs is not installed.";

#[derive(Debug, Subcommand)]
enum Verb { None }

fn main() -> ExitCode {
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    let done = match cli.verb { Verb::None => Ok::<_, io::Error>(ExitCode::SUCCESS) };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
