//! The emulated board beside a solver on the CPU; growth, memory, and an older `pgs`.
//!
//! ```sh
//! cargo bench --bench speed
//! cargo bench --bench speed -- --section solver --input FOLDER --json
//! cargo bench --bench speed -- --section old --old /usr/local/bin/pgs
//! ```
//!
//! The measured step is of the thesis' cubes, standing on the ground and stepped on the emulated
//! board, or is in a folder of arrays (`--input`). The board takes it in the order without hazards,
//! and so does the yardstick: a sequential scalar solver, see `tools/yardstick`. Both must give
//! the same bits, or the benchmark prints no figures.

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

mod a53;
mod callgrind;
mod growth;
mod process;
mod profiles;
mod solver;
mod world;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use bench::options::{Common, Pile};
use bench::step::Step;
use bitstream_model::BoardConfig;
use clap::{Parser, ValueEnum};
use serde_json::{Map, Value, json};

/// Compares the emulated board with a solver on the CPU.
#[derive(Debug, Parser)]
#[command(name = "cargo bench --bench speed --")]
struct Options {
    /// Section to measure [default: all but `old`]
    #[arg(long, value_enum)]
    section: Vec<Section>,
    /// Take the step from this folder of arrays instead of a pile
    #[arg(long, value_name = "DIR")]
    input: Option<PathBuf>,
    #[command(flatten)]
    pile: Pile,
    /// An older `pgs`, which runs the thesis' scene beside this one
    #[arg(long, value_name = "BINARY")]
    old: Option<PathBuf>,
    /// Steps of each run of the thesis' scene
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    run_steps: u32,
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
    /// Time of a step beside the yardstick, and the driver's share of it
    Solver,
    /// Time of a step in each design, without short cuts and by default
    Profiles,
    /// Time of a step with world inertia, warm start and pair friction beside one without
    World,
    /// Instructions of the yardstick, counted by valgrind
    Instructions,
    /// Cost of packing on a Cortex-A53, on paper (docs/a53-cost.md)
    A53,
    /// Time per collision from small scenes to large ones
    Growth,
    /// Peak memory of `pgs run`
    Memory,
    /// Time of `pgs run` beside an older one (`--old`)
    Old,
}

impl Options {
    fn has(&self, section: Section) -> bool {
        match self.section.is_empty() {
            true => section != Section::Old || self.old.is_some(),
            false => self.section.contains(&section),
        }
    }

    fn step(&self) -> Result<Step, Box<dyn Error>> {
        match &self.input {
            Some(folder) => Step::load(folder),
            None => Step::of_pile(&self.pile, BoardConfig::default()),
        }
    }
}

/// The JSON of a section; its text is printed during the measurement.
type Outcome = Result<Value, Box<dyn Error>>;

/// Measures a section.
type Measure = fn(&Options) -> Outcome;

fn main() -> ExitCode {
    bench::exit_code(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    if let Some(only) = options.only {
        return callgrind::run(only, options.profile.as_deref(), &options.step()?);
    }
    let mut document = Map::new();
    document.insert("schema".to_owned(), 1.into());
    document.insert("bench".to_owned(), "speed".into());
    document.insert("runs".to_owned(), options.common.runs().into());
    let sections: [(Section, &str, Measure); 8] = [
        (Section::Solver, "solver", solver::measure),
        (Section::Profiles, "profiles", profiles::measure),
        (Section::World, "world", world::measure),
        (Section::Instructions, "instructions", callgrind::measure),
        (Section::A53, "a53", a53::measure),
        (Section::Growth, "growth", growth::measure),
        (Section::Memory, "memory", process::memory),
        (Section::Old, "old", process::old),
    ];
    for (section, name, measure) in sections {
        if options.has(section) {
            document.insert(name.to_owned(), measure(options)?);
        }
    }
    if options.common.json {
        println!("{:#}", json!(document));
    }
    Ok(())
}
