//! `rtlgen operators`: the operators against the reference.

use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, ValueEnum};
use pgs_interface::number::Precision;
use rtlgen::verify::half;
use rtlgen::verify::operators::{OPERATORS, Tally, Wrong, verify};
use rtlgen::verify::simulation::Simulator;
use rtlgen::verify::vectors::{Vector, Vectors};
use serde_json::{Value, json};

use super::{Error, progress_bar};

/// The format of the operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Numbers {
    /// IEEE 754 binary32, subnormal numbers flushed.
    Binary32,
    /// IEEE 754 binary16, subnormal numbers kept.
    Binary16,
}

/// Simulates the operators with Verilator and compares every result with a reference.
///
/// The reference is arithmetic in integers (`rustc_apfloat`) with the flush rules of the
/// specification; sine and cosine are libm's. Result bits and latencies must agree. In binary16
/// 65,536 vectors hold every operand of the operators with one, and every pair of signs and
/// exponents of the others has the same share.
#[derive(Debug, Args)]
pub(crate) struct Operators {
    /// Format of the operators
    #[arg(long, value_enum, default_value_t = Numbers::Binary32)]
    numbers: Numbers,
    /// Vectors for each operator
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    vectors: u64,
    /// Seed of the vectors
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

/// Fails if a result is wrong.
pub(crate) fn run(args: &Operators, out: &mut dyn Write) -> Result<ExitCode, Error> {
    let start = Instant::now();
    let bar = progress_bar(args.vectors, "vectors");
    let progress = |done| bar.set_position(done);
    let (build, tallies) = match args.numbers {
        Numbers::Binary32 => {
            let simulator = Simulator::build(Precision::F32)?;
            let vectors = Vectors::new(args.seed);
            let build = start.elapsed();
            (build, verify(&simulator, &OPERATORS, vectors, args.vectors, progress)?)
        }
        Numbers::Binary16 => {
            let simulator = Simulator::build(Precision::Binary16)?;
            let vectors = half::Vectors::new(args.seed);
            let build = start.elapsed();
            (build, verify(&simulator, &half::OPERATORS, vectors, args.vectors, progress)?)
        }
    };
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    if args.json {
        let document = json!({
            "vectors": args.vectors,
            "seed": args.seed,
            "seconds": seconds,
            "operators": tallies.iter().map(document).collect::<Vec<_>>(),
        });
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(out, "{:<25} {:>7} {:>12} {:>12}", "operator", "latency", "vectors", "wrong")?;
        for tally in &tallies {
            let Tally { operator, wrong, first } = tally;
            let (name, latency) = (operator.name, operator.latency);
            writeln!(out, "{name:<25} {latency:>7} {:>12} {wrong:>12}", args.vectors)?;
            if let Some(first) = first {
                writeln!(out, "  first: {}", describe(first))?;
            }
        }
        let build = build.as_secs_f64();
        writeln!(out, "seed {}, {seconds:.1} s, {build:.1} s of it to build", args.seed)?;
    }
    let passed = tallies.iter().all(|tally| tally.wrong == 0);
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

pub(super) fn describe(wrong: &Wrong) -> String {
    let Wrong { vector: Vector { a, b, radicand, argument }, expected, found } = wrong;
    format!(
        "a {a:08x}, b {b:08x}, radicand {radicand:08x}, argument {argument:08x}: \
         {found:08x}, expected {expected:08x}"
    )
}

fn document(tally: &Tally) -> Value {
    json!({
        "operator": tally.operator.name,
        "latency": tally.operator.latency,
        "wrong": tally.wrong,
        "first": tally.first.as_ref().map(describe),
    })
}
