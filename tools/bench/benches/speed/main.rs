//! The emulated board beside a solver on the CPU.
//!
//! ```sh
//! cargo bench --bench speed
//! cargo bench --bench speed -- --section solver --input FOLDER
//! ```
//!
//! The measured step is of the thesis' cubes, standing on the ground and stepped on the emulated
//! board, or is in a folder of arrays (`--input`). The board takes it in the order without hazards,
//! and so does the yardstick: a sequential scalar solver, see `tools/yardstick`. Both must give
//! the same bits, or the benchmark prints no figures.

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

mod callgrind;
mod solver;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use bench::options::{Common, Pile};
use bench::step::Step;
use bitstream_model::BoardConfig;
use clap::{Parser, ValueEnum};

/// Compares the emulated board with a solver on the CPU.
#[derive(Debug, Parser)]
#[command(name = "cargo bench --bench speed --")]
struct Options {
    /// Section to measure [default: all]
    #[arg(long, value_enum)]
    section: Option<Section>,
    /// Take the step from this folder of arrays instead of a pile
    #[arg(long, value_name = "DIR")]
    input: Option<PathBuf>,
    #[command(flatten)]
    pile: Pile,
    /// Run this item only, for a tool that counts.
    #[arg(long, value_enum, hide = true)]
    only: Option<callgrind::Only>,
    /// Use the emulated board of this profile
    #[arg(long, requires = "only", hide = true)]
    profile: Option<String>,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Section {
    /// Time of a step beside the yardstick
    Solver,
    /// Instructions of the yardstick, counted by valgrind
    Instructions,
}

impl Options {
    fn step(&self) -> Result<Step, Box<dyn Error>> {
        match &self.input {
            Some(folder) => Step::load(folder),
            None => Step::of_pile(&self.pile, BoardConfig::default()),
        }
    }
}

/// A section prints its figures.
type Outcome = Result<(), Box<dyn Error>>;

/// Measures a section.
type Measure = fn(&Options) -> Outcome;

fn main() -> ExitCode {
    bench::exit_code(run(&Options::parse()))
}

fn run(options: &Options) -> Outcome {
    if let Some(only) = options.only {
        return callgrind::run(only, options.profile.as_deref(), &options.step()?);
    }
    let sections: [(Section, Measure); 2] =
        [(Section::Solver, solver::measure), (Section::Instructions, callgrind::measure)];
    for (section, measure) in sections {
        if options.section.is_none_or(|wanted| wanted == section) {
            measure(options)?;
        }
    }
    Ok(())
}
