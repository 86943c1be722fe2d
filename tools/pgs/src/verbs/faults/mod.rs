//! The verb `faults`: every fault that the emulated board can have, at every channel and in every phase
//! of a step, and whether the driver names it, keeps the caller's data and works on.

mod cells;
mod expected;
mod table;
mod trial;

use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

use bitstream_model::interface::profile::{PROFILES, Profile};
use clap::Args;
use indicatif::ProgressBar;
use pgs_support::Crew;
use serde_json::{Value, json};

use self::cells::{Cell, Impossible};
use self::table::Tally;
use self::trial::{Bench, Verified};
use super::SCHEMA;
use super::progress::progress_bar;
use crate::args::CommonArgs;
use crate::environment;
use crate::failure::{Failure, Verdict};

const EXAMPLES: &str = "\
Examples:
  pgs faults                      every profile
  pgs faults --profile float
  pgs faults --list               what each cell injects, without trying it
  pgs faults --json > faults.json
  pgs run --grid 3x3x3 --steps 2 --fault 'stall@dma1.mm2s,phase=contact2,beat=5'

A cell is one fault at one place. It passes if the fault happened; a fatal one was named rightly, with
its channel, before the deadline of the step, and changed no body; a survivable one changed no bit of
the result, and was felt: the step took longer, or more interrupts came; and the next step gives the bits of an undisturbed one, or, where the board is lost, every
call says so.";

/// Try every fault at every place of a step.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FaultsArgs {
    /// One profile instead of all.
    #[arg(long, value_name = "PROFILE", value_parser = crate::options::profile())]
    profile: Option<&'static Profile>,
    /// Print what each cell injects, and try none.
    #[arg(long)]
    list: bool,
}

/// What became of the cells of a profile.
struct Tried {
    profile: &'static Profile,
    cells: Vec<(Cell, Verified)>,
    impossible: Vec<Impossible>,
}

/// Tries all cells.
pub(crate) fn run(
    args: &FaultsArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    if environment::variable(environment::LOG).is_none() {
        // Thousands of faults, and the driver warns of each.
        log::set_max_level(log::LevelFilter::Off);
    }
    let profiles: Vec<_> = match args.profile {
        Some(profile) => vec![profile],
        None => PROFILES.to_vec(),
    };
    let mut all = Vec::new();
    for profile in profiles {
        let bench = Bench::new(profile)?;
        let (cells, impossible) = cells::of(&bench);
        if args.list {
            for cell in &cells {
                writeln!(out, "{:10} {}", profile.name, cell.plan)?;
            }
            continue;
        }
        let cells = try_all(&bench, cells);
        all.push(Tried { profile, cells, impossible });
    }
    if args.list {
        return Ok(Verdict::Done);
    }
    let failed = all.iter().flat_map(|tried| &tried.cells).any(|(_, found)| !found.passed());
    if common.json {
        writeln!(out, "{:#}", to_json(&all))?;
    } else {
        table::print(&all, out)?;
    }
    Ok(if failed { Verdict::Differs } else { Verdict::Done })
}

/// Tries cells on all processors, or on as many as the system gives threads for; in their order,
/// whoever was first.
fn try_all(bench: &Bench, cells: Vec<Cell>) -> Vec<(Cell, Verified)> {
    let bar: ProgressBar = progress_bar(u32::try_from(cells.len()).unwrap_or(u32::MAX));
    bar.set_message(bench.config.profile.name);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut crew = Crew::new("faults", threads - 1);
    // What is missing has passed nothing.
    let mut all = vec![Verified::default(); cells.len()];
    crew.each(cells.iter().zip(&mut all), |(cell, to)| {
        // A panic is what fails everywhere, not what ends the table.
        let tried = catch_unwind(AssertUnwindSafe(|| trial::run(bench, cell)));
        *to = tried.unwrap_or_default();
        bar.inc(1);
    });
    bar.finish_and_clear();
    cells.into_iter().zip(all).collect()
}

fn to_json(all: &[Tried]) -> Value {
    let profiles: Vec<_> = all
        .iter()
        .map(|tried| {
            let Tried { profile, cells, impossible } = tried;
            let tally = Tally::of(cells.iter());
            json!({
                "profile": profile.name,
                "tally": tally.to_json(),
                "impossible": impossible.iter().map(|what| json!({
                    "what": what.what,
                    "cells": what.cells,
                })).collect::<Vec<_>>(),
                "cells": cells.iter().map(|(cell, found)| json!({
                    "fault": cell.plan.to_string(),
                    "kind": cell.kind.name(),
                    "phase": cell.phase_text(),
                    "passed": found.passed(),
                    "cause": found.cause,
                    "elapsed_ms": found.elapsed.as_secs_f64() * 1e3,
                    "wrong": found.wrong(),
                })).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({ "schema": SCHEMA, "verb": "faults", "profiles": profiles })
}
