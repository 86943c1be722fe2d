//! Counts instructions of the yardstick with valgrind, free of the noise of times;
//! and runs a single item for tools that count.

use std::error::Error;
use std::process::Command;

use bench::step::{Emulated, Step};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::Profile;
use clap::ValueEnum;
use yardstick::Yardstick;
use zynq_pgs::StepParameters;

use crate::{Options, Outcome};

/// The counted functions, and the passes that they solve.
const COUNTED: [(&str, Passes); 4] = [
    ("yardstick::Yardstick::solve", |parameters| {
        parameters.contact_iterations + parameters.friction_iterations
    }),
    ("yardstick::Yardstick::make_rows", |_| 1),
    ("yardstick::passes::contact", |parameters| parameters.contact_iterations),
    ("yardstick::passes::friction", |parameters| parameters.friction_iterations),
];

/// Selects a number of passes from a step's parameters.
type Passes = fn(&StepParameters) -> u32;

/// The scene without a folder: so large that its borders hardly count.
const GRID: &str = "10x10x10";

/// An item to run alone, for a tool that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Only {
    /// Solve the step with the yardstick
    Yardstick,
    /// Take the step on the emulated board of a profile
    Emulated,
}

/// Runs the item, and reports the number of collisions and passes.
pub(crate) fn run(only: Only, profile: Option<&str>, step: &Step) -> Result<(), Box<dyn Error>> {
    match (only, profile) {
        (Only::Yardstick, None) => {
            let in_order = step.in_order(BoardConfig::default())?;
            let Step { shapes, bodies, parameters, .. } = step;
            Yardstick::new(shapes, bodies, &in_order, parameters).solve();
        }
        (Only::Emulated, Some(profile)) => {
            let profile = Profile::by_name(profile).ok_or("--profile: no profile has this name")?;
            let config = BoardConfig { profile, threads: 1, ..BoardConfig::default() };
            Emulated::new(step, config)?.take()?;
        }
        _ => return Err("--only emulated needs a --profile, and nothing else takes one".into()),
    }
    let StepParameters { contact_iterations, friction_iterations, .. } = step.parameters;
    println!(
        "done: {} collisions, {contact_iterations} contact and {friction_iterations} friction \
         iterations",
        step.collisions.len()
    );
    Ok(())
}

pub(crate) fn measure(options: &Options) -> Outcome {
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("skipped: instructions (valgrind is not installed)");
        return Ok(());
    }
    let mut counts = Vec::new();
    for (function, passes) in COUNTED {
        let (instructions, parameters, collisions) = count(options, function)?;
        let passes = f64::from(passes(&parameters));
        counts.push(instructions / (collisions * passes));
    }
    let [all, rows, contact, friction] = counts[..] else { return Err("a count for each".into()) };
    println!("Instructions of the yardstick, counted by callgrind");
    println!(
        "  {contact:.0} a pair and contact pass, {friction:.0} a pair and friction pass, \
         {rows:.0} a pair for its rows: {all:.0} a pair and pass in all\n"
    );
    Ok(())
}

/// Instructions of a function, with the iterations of the step and its collisions.
fn count(options: &Options, function: &str) -> Result<(f64, StepParameters, f64), Box<dyn Error>> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    command.arg(format!("--toggle-collect={function}"));
    command.arg(std::env::current_exe()?).args(["--only", "yardstick"]);
    match &options.input {
        Some(folder) => command.arg("--input").arg(folder),
        None => command.args(["--grid", GRID, "--steps", "2"]),
    };
    let output = command.output()?;
    let (text, log) = (String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?);
    if !output.status.success() {
        return Err(format!("valgrind: {log}").into());
    }
    let numbers: Vec<u32> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [collisions, contact, friction] = numbers[..] else {
        return Err(format!("three numbers are expected, found {text:?}").into());
    };
    let mut parameters = StepParameters::thesis();
    (parameters.contact_iterations, parameters.friction_iterations) = (contact, friction);
    let collected = log.lines().find_map(|line| line.split_once("Collected :"));
    let (_, collected) = collected.ok_or("callgrind does not report its counts")?;
    let instructions: f64 = collected.trim().parse()?;
    if instructions == 0.0 {
        return Err(format!("callgrind has not seen {function}").into());
    }
    Ok((instructions, parameters, collisions.into()))
}
