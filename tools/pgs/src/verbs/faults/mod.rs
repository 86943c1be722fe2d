//! The verb `faults`: injects every fault of the emulated board, in every channel and in every
//! phase of a step. Checks that the driver names the fault, keeps the caller's data and goes on
//! working.

mod cells;
mod expected;
mod hardware;
mod table;
mod trial;

use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

use bitstream_model::interface::profile::PROFILES;
use clap::Args;
use indicatif::ProgressBar;
use pgs_support::Crew;
use serde_json::{Value, json};
use zynq_pgs::emulation::Build;

use self::cells::{Cell, Impossible};
use self::table::Tally;
use self::trial::{Bench, CellResult, Start};
use pgs_command::common::{AcceleratorOptions, CommonArgs};
use pgs_command::environment;
use pgs_command::failure::{Result, Verdict};
use pgs_command::options::build::BuiltArgs;
use pgs_command::output::SCHEMA;
use pgs_command::output::facts::whole;
use pgs_command::output::progress::progress_bar;

const EXAMPLES: &str = "\
Examples:
  pgs faults                           every profile
  pgs faults --board emulated:float
  pgs faults --list                    the fault of each cell, without trying it
  pgs faults --json > faults.json
  pgs run --grid 3x3x3 --steps 2 --fault 'stall@dma1.mm2s,phase=contact2,beat=5'

Examples with the Verilog in simulation (docs/to-a-board.md):
  pgs faults --accelerator rtl:rtl-sim/pgs-rtl     stream faults, on the generated hardware too

Profiles that can start warm are tried cold and, as NAME+warm, with impulses that come in and go \
out.
A cell is one fault at one place. It passes if the fault happened, and

  a fatal fault    was named correctly, with its channel, before the deadline, and changed no body
  a survivable one changed no bit of the result, and had an effect: a longer step or more interrupts
  the next step    gives the bits of a step without faults, or every call reports a lost board";

/// Try every fault at every place of a step.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FaultsArgs {
    /// Print the fault of each cell, and try none.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    pub(crate) built: BuiltArgs,
    #[command(flatten)]
    pub(crate) accelerator: AcceleratorOptions,
}

/// The results of a build's cells.
struct ProfileResults {
    /// The build, and whether its steps start warm.
    name: String,
    cells: Vec<(Cell, CellResult)>,
    impossible: Vec<Impossible>,
}

/// Tries all cells.
pub(crate) fn run(args: &FaultsArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    if environment::variable(environment::LOG).is_none() {
        // The driver would warn of each of thousands of faults.
        log::set_max_level(log::LevelFilter::Off);
    }
    if common.accelerator.simulator.is_some() {
        return hardware::run(args, common, out);
    }
    let of_profile = |&profile| Build { profile: Some(profile), ..Build::default() };
    let every = || PROFILES.iter().map(of_profile).collect();
    let builds: Vec<Build> = args.built.board.map_or_else(every, |build| vec![build]);
    let (mut all, mut listed) = (Vec::new(), Vec::new());
    let starts = |build| [Start::Cold, Start::Warm].map(|start| (build, start));
    for (build, start) in builds.into_iter().flat_map(starts) {
        let bench = Bench::new(&build, start)?;
        let (cells, impossible) = cells::of(&bench);
        let name = match start {
            Start::Cold => build.to_string(),
            Start::Warm => format!("{build}+warm"),
        };
        if args.list {
            listed.push((name, cells));
            continue;
        }
        let cells = try_all(&bench, cells);
        all.push(ProfileResults { name, cells, impossible });
    }
    if args.list {
        return list(&listed, common, out);
    }
    let failed = all.iter().flat_map(|tried| &tried.cells).any(|(_, found)| !found.passed());
    if common.json {
        writeln!(out, "{:#}", to_json(&all))?;
    } else {
        table::print(&all, out)?;
    }
    Ok(if failed { Verdict::Differs } else { Verdict::Done })
}

/// Prints the fault of each cell of each profile.
fn list(
    profiles: &[(String, Vec<Cell>)],
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict> {
    if common.json {
        let of_profile = |(name, cells): &(String, Vec<Cell>)| {
            let cells: Vec<_> = cells.iter().map(Cell::to_json).collect();
            json!({ "profile": name, "cells": cells })
        };
        let profiles: Vec<_> = profiles.iter().map(of_profile).collect();
        let document = json!({ "schema": SCHEMA, "verb": "faults", "profiles": profiles });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }
    for (name, cells) in profiles {
        for cell in cells {
            whole(out, "", 0, &format!("{name} {}", cell.plan))?;
        }
    }
    Ok(Verdict::Done)
}

/// Tries the cells on all processors, or with fewer threads if the system gives no more; the
/// results are in the order of the cells.
fn try_all(bench: &Bench, cells: Vec<Cell>) -> Vec<(Cell, CellResult)> {
    let bar: ProgressBar = progress_bar(u32::try_from(cells.len()).unwrap_or(u32::MAX));
    bar.set_message(bench.config.profile.name);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut crew = Crew::new("faults", threads - 1);
    // A cell without a result has passed nothing.
    let mut all = vec![CellResult::default(); cells.len()];
    crew.each(cells.iter().zip(&mut all), |(cell, to)| {
        // A panic fails the cell and does not end the table.
        let tried = catch_unwind(AssertUnwindSafe(|| trial::run(bench, cell)));
        *to = tried.unwrap_or_default();
        bar.inc(1);
    });
    bar.finish_and_clear();
    cells.into_iter().zip(all).collect()
}

fn to_json(all: &[ProfileResults]) -> Value {
    let profiles: Vec<_> = all
        .iter()
        .map(|tried| {
            let ProfileResults { name, cells, impossible } = tried;
            let tally = Tally::of(cells.iter());
            json!({
                "profile": name,
                "tally": tally.to_json(),
                "impossible": impossible.iter().map(|what| json!({
                    "what": what.what,
                    "cells": what.cells,
                })).collect::<Vec<_>>(),
                "cells": cells.iter().map(|(cell, found)| {
                    let mut document = cell.to_json();
                    document["passed"] = found.passed().into();
                    document["cause"] = found.cause.into();
                    document["elapsed_ms"] = (found.elapsed.as_secs_f64() * 1e3).into();
                    document["wrong"] = json!(found.failed_checks());
                    document
                }).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({ "schema": SCHEMA, "verb": "faults", "profiles": profiles })
}
