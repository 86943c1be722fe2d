//! Runs fuzz targets on inputs made from a seed. `--help` says how.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "a program says what it does")]

use std::io::{self, Write};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use clap::builder::PossibleValuesParser;
use fuzz::campaign::{self, Plan, Summary};
use fuzz::targets;

/// Runs fuzz targets on inputs made from a seed: the same inputs on every machine and with every
/// number of threads.
///
/// A target that panics or hangs is a finding: the command that repeats it is printed, and the exit
/// code is 1.
///
/// Example: fuzz registers --executions 2000
#[derive(Debug, Parser)]
#[command(name = "fuzz", version)]
struct Args {
    /// The target; `list` shows what each tests
    #[arg(default_value = ALL, value_parser = names())]
    target: String,
    /// Executions of each target, at most
    #[arg(long, value_name = "N")]
    executions: Option<u64>,
    /// Number of the first execution
    #[arg(long, value_name = "N", default_value_t = 0)]
    first: u64,
    /// Time of all targets together; each gets the same share [default: 60, without --executions]
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<u64>,
    /// Seed of the inputs
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "T")]
    threads: Option<u64>,
}

const ALL: &str = "all";
const LIST: &str = "list";
/// Default time of all targets together, s.
const SECONDS: u64 = 60;

fn names() -> PossibleValuesParser {
    targets::ALL.iter().map(|target| target.name).chain([ALL, LIST]).collect::<Vec<_>>().into()
}

fn main() -> io::Result<ExitCode> {
    let args = Args::parse();
    let mut out = io::stdout().lock();
    if args.target == LIST {
        for target in targets::ALL {
            writeln!(out, "{:<12} {}", target.name, target.about)?;
        }
    }
    let asked = |name| args.target == ALL || args.target == name;
    let chosen: Vec<_> = targets::ALL.iter().filter(|target| asked(target.name)).collect();
    // Equal shares of time: a target that finds much a second and one that takes long are heard
    // alike.
    let seconds = args.seconds.or(args.executions.is_none().then_some(SECONDS));
    let share = |seconds| Duration::from_secs(seconds).div_f64(chosen.len() as f64);
    let processors = || thread::available_parallelism().map_or(1, |count| count.get() as u64);
    let mut code = ExitCode::SUCCESS;
    for target in &chosen {
        let plan = Plan {
            first: args.first,
            executions: args.executions.unwrap_or(u64::MAX),
            time: seconds.map_or(Duration::MAX, share),
            seed: args.seed,
            threads: args.threads.unwrap_or_else(processors),
        };
        let start = Instant::now();
        let Summary { executions, tally, panicked } = campaign::run(target, &plan);
        let (name, seconds) = (target.name, start.elapsed().as_secs_f64());
        let rate = executions as f64 / seconds.max(1e-9);
        writeln!(
            out,
            "{name:<12} {executions:>10} executions in {seconds:>7.1} s, {rate:>8.0} a second"
        )?;
        writeln!(out, "{:<12} {tally:?}", "")?;
        if let Some(number) = panicked {
            code = ExitCode::FAILURE;
            eprintln!("FOUND\n  again: {}", campaign::again(target, plan.seed, number));
        }
    }
    Ok(code)
}
