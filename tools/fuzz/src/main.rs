//! Runs fuzz targets on inputs made from a seed. `--help` says how.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "a program says what it does")]

use std::io::{self, Write};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use fuzz::campaign::{self, Plan, Summary};
use fuzz::targets::{self, Target};
use serde_json::{Value, json};

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
    /// The target, or `all`; `list` shows the targets
    #[arg(default_value = "all")]
    target: String,
    /// Executions of each target, at most
    #[arg(long, value_name = "N")]
    executions: Option<u64>,
    /// Number of the first execution
    #[arg(long, value_name = "N", default_value_t = 0)]
    first: u64,
    /// Time of all targets together, of which each gets the same share [default: 60, without
    /// --executions]
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<u64>,
    /// Seed of the inputs
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "T")]
    threads: Option<u64>,
    /// Time after which an execution counts as hanging, s
    #[arg(long, value_name = "SECONDS", default_value_t = 20)]
    limit: u64,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

/// Default time of all targets together, s.
const SECONDS: u64 = 60;
/// Wrong usage, or a stdout that cannot be written.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let mut out = io::stdout().lock();
    let done = match Args::try_parse() {
        Ok(args) => act(&args, &mut out),
        Err(message) if message.use_stderr() => message.exit(),
        // Help or the version.
        Err(message) => write!(out, "{message}").map(|()| ExitCode::SUCCESS),
    };
    match done.and_then(|code| out.flush().map(|()| code)) {
        Ok(code) => code,
        // The reader of a pipe has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: standard output cannot be written\n  because: {error}");
            ExitCode::from(USAGE)
        }
    }
}

/// Does what the command line says; an error is one of stdout.
fn act(args: &Args, out: &mut dyn Write) -> io::Result<ExitCode> {
    if args.target == "list" {
        for target in targets::ALL {
            writeln!(out, "{:<12} {}", target.name, target.about)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let chosen: Vec<&'static Target> = match targets::by_name(&args.target) {
        Some(target) => vec![target],
        None if args.target == "all" => targets::ALL.iter().collect(),
        None => {
            let names: Vec<_> = targets::ALL.iter().map(|target| target.name).collect();
            eprintln!(
                "error: no target {:?}, expected all, list or one of {}",
                args.target,
                names.join(", ")
            );
            return Ok(ExitCode::from(USAGE));
        }
    };
    run(args, &chosen, out)
}

fn run(args: &Args, chosen: &[&'static Target], out: &mut dyn Write) -> io::Result<ExitCode> {
    let processors = || thread::available_parallelism().map_or(1, |count| count.get() as u64);
    // Equal shares of time: a target that finds much a second and one that takes long are heard
    // alike.
    let share = |seconds| Duration::from_secs(seconds).div_f64(chosen.len() as f64);
    let plan = Plan {
        first: args.first,
        executions: args.executions.unwrap_or(u64::MAX),
        time: match (args.seconds, args.executions) {
            (Some(seconds), _) => share(seconds),
            (None, Some(_)) => Duration::MAX,
            (None, None) => share(SECONDS),
        },
        seed: args.seed,
        threads: args.threads.unwrap_or_else(processors),
        limit: Duration::from_secs(args.limit),
    };
    let mut code = ExitCode::SUCCESS;
    let mut documents = Vec::new();
    if !args.json {
        writeln!(out, "seed {}, {} threads", plan.seed, plan.threads)?;
    }
    for target in chosen {
        let start = Instant::now();
        let summary = campaign::run(target, &plan);
        let seconds = start.elapsed().as_secs_f64();
        documents.push(document(target, &summary, seconds));
        if !args.json {
            print_summary(target, &summary, seconds, out)?;
        }
        if let Some(number) = summary.panicked {
            code = ExitCode::FAILURE;
            eprintln!("FOUND\n  again: {}", campaign::again(target, plan.seed, number));
        }
    }
    if args.json {
        let document = json!({ "seed": plan.seed, "threads": plan.threads, "targets": documents });
        writeln!(out, "{document:#}")?;
    }
    Ok(code)
}

fn document(target: &Target, summary: &Summary, seconds: f64) -> Value {
    let mut document = json!({
        "target": target.name,
        "executions": summary.executions,
        "seconds": seconds,
        "finding": summary.panicked,
    });
    for (name, count) in summary.tally.entries() {
        document[name] = count.into();
    }
    document
}

fn print_summary(
    target: &Target,
    summary: &Summary,
    seconds: f64,
    out: &mut dyn Write,
) -> io::Result<()> {
    let executions = summary.executions;
    let rate = executions as f64 / seconds.max(1e-9);
    writeln!(
        out,
        "{:<12} {executions:>10} executions in {seconds:>7.1} s, {rate:>8.0} a second",
        target.name
    )?;
    let counts: Vec<String> = summary
        .tally
        .entries()
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    writeln!(out, "{:<12} {}", "", counts.join(", "))
}
