//! The verb `order`: measures each order of a step's collisions, for every depth of the pipeline.

mod cost;
mod curve;
mod rows;
mod source;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use scene::Grid;
use serde_json::{Value, json};
use zynq_pgs::order::{IssueWindow, OrderError};

use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::numbers::grouped;
use crate::output::SCHEMA;
use crate::output::files::{Files, Named};
use crate::output::table::{Column, heading, line};
use rows::{Measured, Row};
use source::Source;

const EXAMPLES: &str = "\
Examples:
  pgs order --input tests/golden/pile5_step60
  pgs order --input tests/golden/pile5_step60 --depth 64 --curve live.svg
  pgs order --spheres 20000
  pgs order --grid 10x10x10 --drop 0.5 --steps 60 --json

Depth is the hazard window in issue slots: the cycles from the read of a velocity to its
write-back, by the initiation interval. A collision is hazardous if it shares a moving body with
one of the depth - 1 slots before it. A body is alive from its first collision to its last; spans
are counted in issue slots, empty ones included.

The folder is one for `pgs solve`. If it also holds gpu_order.npy (M) <u4, the order of Bullet's
GPU, this order is measured, too.";

/// Show the cost of each order of the collisions: hazards, empty slots, live bodies, host time.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct OrderArgs {
    /// Collisions of a folder of .npy arrays.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "steps", "drop", "spheres", "seed"])]
    input: Option<PathBuf>,
    /// Collisions of an irregular pile with this many spheres of three sizes.
    #[arg(long, value_name = "N", conflicts_with_all = ["grid", "steps", "drop"])]
    spheres: Option<u32>,
    /// Seed of the pile of spheres.
    #[arg(long, value_name = "SEED", default_value_t = 1, requires = "spheres")]
    seed: u64,
    /// Collisions of a pile of cubes dropped on the ground; cubes along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value_t)]
    grid: Grid,
    /// Steps that the cubes take before their collisions are ordered.
    #[arg(long, value_name = "N", default_value_t = 0)]
    steps: u32,
    /// Height of the lowest cubes above the ground at the start, m.
    #[arg(long, value_name = "H", default_value_t = 0.0)]
    drop: f32,
    /// Depths of the pipeline, issue slots.
    #[arg(
        long,
        value_name = "D,...",
        value_delimiter = ',',
        default_values_t = [16, 32, 64, 96, 128, 192],
        value_parser = clap::value_parser!(u32).range(1..=i64::from(IssueWindow::DEPTH_MAX))
    )]
    depth: Vec<u32>,
    /// Collisions that enter the pipeline in one issue slot.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=i64::from(IssueWindow::PER_ISSUE_MAX)))]
    per_issue: u32,
    /// Runs for the median host time.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// Write the number of live bodies in each slot, for every order at the last depth: .csv or
    /// .svg.
    #[arg(long, value_name = "FILE", value_parser = curve::path)]
    curve: Option<PathBuf>,
}

const COLUMNS: [Column; 10] = [
    Column { name: "order", unit: "", width: 24 },
    Column { name: "depth", unit: "slots", width: 6 },
    Column { name: "hazards", unit: "%", width: 8 },
    Column { name: "lost", unit: "updates", width: 9 },
    Column { name: "empty", unit: "slots", width: 7 },
    Column { name: "empty", unit: "%", width: 6 },
    Column { name: "alive", unit: "most", width: 7 },
    Column { name: "span", unit: "longest", width: 8 },
    Column { name: "span", unit: "mean", width: 8 },
    Column { name: "host", unit: "ns/coll.", width: 8 },
];

/// Orders the collisions in every way and measures them.
pub(crate) fn run(
    args: &OrderArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let curve = args.curve.iter().map(|path| Named::option("curve", path));
    let mut files = Files::of(common).write(curve);
    if let Some(folder) = &args.input {
        files = files.read_folder(folder, |_| false);
    }
    files.check()?;
    let source = Source::load(args, common)?;
    let windows = args
        .depth
        .iter()
        .map(|depth| IssueWindow::new(*depth, args.per_issue))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Failure::input)?;
    let measured = rows::measure(&source, &windows, args.runs).map_err(refused)?;
    if let Some(path) = &args.curve {
        let last = windows.last().ok_or_else(|| Failure::input("expected at least one depth"))?;
        curve::write(path, &source, &measured, *last)?;
    }
    if common.json {
        writeln!(out, "{:#}", document(args, &source, &measured))?;
    } else {
        print(&source, &measured, out)?;
    }
    Ok(Verdict::Done)
}

/// The input of a folder is checked by the driver.
fn refused(error: OrderError) -> Failure {
    Failure::input(error).next("`pgs solve` tells more about refused input")
}

fn print(source: &Source, measured: &Measured, out: &mut dyn Write) -> std::io::Result<()> {
    let input = source.input();
    writeln!(
        out,
        "scene      {}: {} collisions of {} moving bodies, {:.2} a body",
        source.name,
        grouped(input.pairs.len() as u64),
        grouped(source.moving() as u64),
        source.touches(),
    )?;
    writeln!(out, "verify     {:.1} ns a collision", measured.verify_ns)?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    let mut before = None;
    for row in &measured.rows {
        if before.is_some_and(|before| before != &row.order) {
            writeln!(out)?;
        }
        before = Some(&row.order);
        line(out, &COLUMNS, cells(row))?;
    }
    Ok(())
}

fn cells(row: &Row) -> [String; 10] {
    let report = &row.report;
    [
        format!("{:<24}", row.order),
        row.depth.to_string(),
        format!("{:.2}", report.hazard_share() * 100.0),
        grouped(report.lost_updates as u64),
        grouped(report.empty as u64),
        format!("{:.3}", report.empty_share() * 100.0),
        grouped(report.most_alive as u64),
        grouped(report.longest_span as u64),
        format!("{:.0}", report.mean_span),
        row.host_ns.map_or_else(|| "-".to_owned(), |ns| format!("{ns:.1}")),
    ]
}

fn document(args: &OrderArgs, source: &Source, measured: &Measured) -> Value {
    let rows = measured.rows.iter().map(|row| {
        let report = &row.report;
        json!({
            "order": row.order,
            "depth": row.depth,
            "hazards": report.hazards,
            "hazard_share": report.hazard_share(),
            "lost_updates": report.lost_updates,
            "empty": report.empty,
            "empty_share": report.empty_share(),
            "slots": report.slots,
            "most_alive": report.most_alive,
            "longest_span": report.longest_span,
            "mean_span": report.mean_span,
            "host_ns_per_collision": row.host_ns,
        })
    });
    json!({
        "schema": SCHEMA,
        "verb": "order",
        "config": { "depths": args.depth, "per_issue": args.per_issue, "runs": args.runs },
        "scene": {
            "name": source.name,
            "bodies": source.input().moving.len(),
            "moving": source.moving(),
            "collisions": source.input().pairs.len(),
            "collisions_per_body": source.touches(),
        },
        "verify_ns_per_collision": measured.verify_ns,
        "rows": rows.collect::<Vec<_>>(),
    })
}
