//! `rtlgen schedule`: depths, units and delays of the pipelines.

use std::io::Write;
use std::process::ExitCode;

use clap::Args;
use rtlgen::design::{Design, Pipeline};
use rtlgen::schedule::Usage;
use serde_json::{Value, json};

use super::Error;
use super::build::BuildArgs;

/// Prints the schedule of each pipeline: depth, hazard window, and the units of every kind.
///
/// Fails if a kind has more units than its operations need.
#[derive(Debug, Args)]
pub(crate) struct Schedule {
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    build: BuildArgs,
}

/// The units that a number of operations needs at least.
fn least(usage: &Usage, interval: i32) -> usize {
    usage.operations.div_ceil(usize::try_from(interval).unwrap_or(1))
}

/// Prints the schedules.
pub(crate) fn run(args: &Schedule, out: &mut dyn Write) -> Result<ExitCode, Error> {
    let design = args.build.design()?;
    if args.json {
        let pipelines: Vec<Value> =
            design.pipelines().map(|pipeline| document(&design, pipeline)).into();
        writeln!(out, "{:#}", json!({ "pipelines": pipelines }))?;
    } else {
        for pipeline in design.pipelines() {
            print(&design, pipeline, out)?;
        }
    }
    let tight = design.pipelines().iter().all(|pipeline| {
        let schedule = &pipeline.schedule;
        schedule.usage().values().all(|usage| usage.units == least(usage, schedule.interval))
    });
    Ok(if tight { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print(design: &Design, pipeline: &Pipeline, out: &mut dyn Write) -> Result<(), Error> {
    let schedule = &pipeline.schedule;
    write!(out, "{}: a record every {} cycles", pipeline.name, schedule.interval)?;
    writeln!(out, ", {} cycles from record to results", schedule.depth)?;
    if let Some(depth) = design.pass_depth(pipeline) {
        writeln!(
            out,
            "  velocities at cycle {}, impulses at {}; fill {}, hazard window {}",
            schedule.velocities_at, schedule.impulses_at, depth.fill, depth.window
        )?;
    }
    writeln!(out, "  {:<10} {:>10} {:>7} {:>9}", "operator", "operations", "units", "at least")?;
    for (operation, usage) in schedule.usage() {
        writeln!(
            out,
            "  {:<10} {:>10} {:>7} {:>9}",
            operation.operator(pipeline.graph.precision()).module,
            usage.operations,
            usage.units,
            least(&usage, schedule.interval)
        )?;
    }
    Ok(())
}

fn document(design: &Design, pipeline: &Pipeline) -> Value {
    let schedule = &pipeline.schedule;
    let units = schedule.usage().into_iter().map(|(operation, usage)| {
        json!({
            "operator": operation.operator(pipeline.graph.precision()).module,
            "operations": usage.operations,
            "units": usage.units,
        })
    });
    let depth = design.pass_depth(pipeline);
    json!({
        "pipeline": pipeline.name,
        "interval": schedule.interval,
        "depth": schedule.depth,
        "velocities_at": schedule.velocities_at,
        "impulses_at": schedule.impulses_at,
        "fill": depth.map(|depth| depth.fill),
        "window": depth.map(|depth| depth.window),
        "units": units.collect::<Vec<_>>(),
    })
}
