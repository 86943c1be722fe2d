//! Runs fuzz targets on inputs made from a seed. `--help` says how.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "a program says what it does")]

use std::io::{self, IsTerminal as _, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use fuzz::campaign::{self, Plan, Summary};
use fuzz::finding;
use fuzz::targets::{self, Target};
use serde_json::json;

/// Runs fuzz targets on inputs made from a seed: the same inputs on every machine and with every
/// number of threads.
///
/// A target that panics or hangs is a finding: its input is written into a file, and the exit code
/// is 1.
#[derive(Debug, Parser)]
#[command(name = "fuzz", version)]
struct Args {
    /// The target, or `all`; `list` shows the targets
    #[arg(default_value = "all")]
    target: String,
    /// Executions of each target, at most
    #[arg(long, value_name = "N")]
    executions: Option<u64>,
    /// Time of all targets together, of which each gets the same share [default: 60, without
    /// --executions]
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<u64>,
    /// Seed of the inputs
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "T")]
    threads: Option<usize>,
    /// Time after which an execution counts as hanging, s
    #[arg(long, value_name = "SECONDS", default_value_t = 20)]
    limit: u64,
    /// Folder for the inputs of findings
    #[arg(long, value_name = "FOLDER", default_value = "target/fuzz-findings")]
    findings: PathBuf,
    /// Run the input in this file once instead; a panic is not caught
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

/// Default time of all targets together, s.
const SECONDS: u64 = 60;
/// Wrong usage, or a file or stdout that cannot be read or written.
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
    if let Some(path) = &args.replay {
        return match finding::load(path) {
            Ok((target, input)) => {
                writeln!(out, "{}: {} bytes", target.name, input.len())?;
                writeln!(out, "{:?}", (target.run)(&input))?;
                Ok(ExitCode::SUCCESS)
            }
            Err(error) => Ok(refuse(&error)),
        };
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

fn refuse(error: &dyn std::error::Error) -> ExitCode {
    eprintln!("error: {error}");
    if let Some(source) = error.source() {
        eprintln!("  because: {source}");
    }
    ExitCode::from(USAGE)
}

fn run(args: &Args, chosen: &[&'static Target], out: &mut dyn Write) -> io::Result<ExitCode> {
    let threads = args
        .threads
        .unwrap_or_else(|| thread::available_parallelism().map_or(1, std::num::NonZero::get));
    // Equal shares of time: a target that finds much a second and one that takes long are heard alike.
    let share = |seconds| Duration::from_secs(seconds).div_f64(chosen.len() as f64);
    let time = match (args.seconds, args.executions) {
        (Some(seconds), _) => share(seconds),
        (None, Some(_)) => Duration::MAX,
        (None, None) => share(SECONDS),
    };
    let start = Instant::now();
    let mut summaries = Vec::new();
    if !args.json {
        writeln!(out, "seed {}, {threads} threads", args.seed)?;
    }
    for target in chosen {
        let plan = Plan {
            executions: args.executions.unwrap_or(u64::MAX),
            time,
            seed: args.seed,
            threads,
            limit: Duration::from_secs(args.limit),
        };
        let show = std::io::stderr().is_terminal();
        let summary = campaign::run(target, &plan, |done| {
            if show {
                eprint!("\r{}: {done} ", target.name);
            }
        });
        if show {
            eprint!("\r{:60}\r", "");
        }
        if !args.json {
            print_summary(&summary, out)?;
        }
        let hung = matches!(
            summary.finding,
            Some(finding::Finding { ending: finding::Ending::Hang(_), .. })
        );
        summaries.push(summary);
        if hung {
            // Its thread still uses processor time.
            break;
        }
    }
    finish(args, &summaries, threads, start.elapsed(), out)
}

fn print_summary(summary: &Summary, out: &mut dyn Write) -> io::Result<()> {
    let Summary { target, executions, time, threads, tally, .. } = summary;
    let rate = *executions as f64 / time.as_secs_f64().max(1e-9);
    writeln!(
        out,
        "{target:<12} {executions:>10} executions in {:>7.1} s, {rate:>8.0} a second",
        time.as_secs_f64()
    )?;
    if let Some(missing) = threads.missing() {
        writeln!(out, "{:<12} {missing}", "")?;
    }
    let counts: Vec<String> = tally
        .entries()
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    writeln!(out, "{:<12} {}", "", counts.join(", "))
}

/// Writes the inputs of findings, and the document or the last lines.
fn finish(
    args: &Args,
    summaries: &[Summary],
    threads: usize,
    time: Duration,
    out: &mut dyn Write,
) -> io::Result<ExitCode> {
    let mut code = ExitCode::SUCCESS;
    let mut documents = Vec::new();
    for summary in summaries {
        let mut document = json!({
            "target": summary.target,
            "executions": summary.executions,
            "seconds": summary.time.as_secs_f64(),
            "threads": summary.threads.ran,
            "watched": summary.threads.watched,
        });
        for (name, count) in summary.tally.entries() {
            document[name] = count.into();
        }
        if let Some(finding) = &summary.finding {
            code = ExitCode::FAILURE;
            let path = match finding.save(&args.findings) {
                Ok(path) => path,
                Err(error) => {
                    eprintln!("error: cannot write into {}: {error}", args.findings.display());
                    code = ExitCode::from(USAGE);
                    PathBuf::new()
                }
            };
            if !args.json {
                writeln!(
                    out,
                    "FOUND in {}, execution {}: {}",
                    finding.target, finding.number, finding.ending
                )?;
                writeln!(out, "  again: fuzz --replay {}", path.display())?;
            }
            document["finding"] = json!({
                "execution": finding.number,
                "ending": finding.ending.to_string(),
                "file": path,
            });
        }
        documents.push(document);
    }
    let executions: u64 = summaries.iter().map(|summary| summary.executions).sum();
    if args.json {
        let document = json!({
            "seed": args.seed,
            "threads": threads,
            "executions": executions,
            "seconds": time.as_secs_f64(),
            "targets": documents,
        });
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(out, "{executions} executions in {:.1} s", time.as_secs_f64())?;
    }
    Ok(code)
}
