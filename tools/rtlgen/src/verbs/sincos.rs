//! `rtlgen sincos`: the fixed-point definition of sine and cosine against libm.

use std::io::Write;
use std::num::NonZero;
use std::process::ExitCode;
use std::thread;
use std::time::Instant;

use clap::Args;
use pgs_interface::number::Precision;
use rtlgen::verify::operators::{self, Tally};
use rtlgen::verify::simulation::Simulator;
use rtlgen::verify::sincos;
use rtlgen::verify::vectors::Vector;
use serde_json::json;

use super::operators::describe;
use super::{Error, progress_bar};

/// Compares the fixed-point definition of sine and cosine with libm, from 2^-12 to pi/8.
///
/// Below 2^-12 both are the argument and 1; above pi/8 no argument of a step lies.
#[derive(Debug, Args)]
pub(crate) struct Sincos {
    /// Compare every argument
    #[arg(long, conflicts_with = "step")]
    all: bool,
    /// Compare every N-th argument
    #[arg(long, value_name = "N", default_value = "100", value_parser = parse_step)]
    step: NonZero<u32>,
    /// Compare the Verilog, too, with Verilator
    #[arg(long)]
    verilog: bool,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
}

fn parse_step(text: &str) -> Result<NonZero<u32>, std::num::ParseIntError> {
    text.parse()
}

/// Fails if a sine or cosine differs.
pub(crate) fn run(args: &Sincos, out: &mut dyn Write) -> Result<ExitCode, Error> {
    let start = Instant::now();
    let step = if args.all { 1 } else { args.step.get() };
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let (first, last) = (sincos::POLYNOMIAL.start(), sincos::POLYNOMIAL.end());
    let bar = progress_bar(u64::from((last - first) / step + 1), "arguments");
    let found = sincos::compare(step, threads, |compared| bar.inc(compared));
    bar.finish_and_clear();
    let verilog = if args.verilog { Some(verilog(step, found.arguments)?) } else { None };
    let seconds = start.elapsed().as_secs_f64();
    if args.json {
        let document = json!({
            "arguments": found.arguments,
            "sine": found.sine,
            "cosine": found.cosine,
            "verilog": verilog.as_ref().map(|tally| tally.wrong),
            "threads": threads,
            "seconds": seconds,
        });
        writeln!(out, "{document:#}")?;
    } else {
        let sincos::Differences { arguments, sine, cosine } = found;
        writeln!(
            out,
            "{arguments} arguments from 2^-12 to pi/8: sin {sine} differ, cos {cosine} differ"
        )?;
        if let Some(Tally { wrong, first, .. }) = &verilog {
            writeln!(out, "the Verilog of them: {wrong} differ")?;
            if let Some(first) = first {
                writeln!(out, "  first: {}", describe(first))?;
            }
        }
        writeln!(out, "{threads} threads, {seconds:.1} s")?;
    }
    let passed =
        found.sine == 0 && found.cosine == 0 && verilog.is_none_or(|tally| tally.wrong == 0);
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Simulates `fsincos` on every `step`-th argument.
fn verilog(step: u32, arguments: u64) -> Result<Tally, Error> {
    let simulator = Simulator::build(Precision::F32)?;
    let vectors = sincos::POLYNOMIAL
        .step_by(step as usize)
        .map(|argument| Vector { argument, ..Vector::default() });
    let bar = progress_bar(arguments, "arguments in Verilog");
    let compared = operators::sincos();
    let tallies =
        operators::verify(&simulator, compared, vectors, arguments, |done| bar.set_position(done))?;
    bar.finish_and_clear();
    Ok(tallies.into_iter().next().expect("one operator is compared"))
}
