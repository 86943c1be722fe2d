//! Measures each order of a step's collisions, for every depth of the pipeline.

mod cost;
mod live;
mod report;
mod rows;
mod source;

use std::path::PathBuf;

use clap::Args;
use pgs_command::failure::{Failure, Result};
use pgs_command::numbers::grouped;
use scene::Grid;
use serde_json::json;
use zynq_pgs::order::{IssueWindow, OrderError};

use self::rows::Measured;
use self::source::Source;
use crate::experiment::{Boards, Experiment, Part, given, shown};
use crate::session::Session;
use crate::table::{Cell, Table, text};

const EXAMPLES: &str = "\
Examples:
  pgs thesis order --input tests/golden/pile5_step60
  pgs thesis order --spheres 20000
  pgs thesis order --grid 10x10x10 --drop 0.5 --steps 60 --json

Depth is the hazard window in issue slots: the cycles from the read of a velocity to its
write-back, by the initiation interval. A collision is hazardous if it shares a moving body with
one of the depth - 1 slots before it. A body is alive from its first collision to its last; spans
are counted in issue slots, empty ones included.

The folder is one for `pgs solve`. If it also holds gpu_order.npy (M) <u4, the order of Bullet's
GPU, this order is measured, too.";

/// The experiment.
pub(crate) static ORDER: Experiment = Experiment {
    id: "order",
    thesis: "§4.7, Algorithm 3",
    about: "The cost of each order of the collisions: hazards, empty slots, live bodies, host time",
    boards: Boards::Any,
    arguments: OrderArgs::augment_args,
    run: |args, session| measure(&given(args)?, session),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct OrderArgs {
    /// Collisions of a folder of .npy arrays.
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with_all = ["grid", "steps", "drop", "spheres", "seed"]
    )]
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
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(IssueWindow::PER_ISSUE_MAX))
    )]
    per_issue: u32,
    /// Runs for the median host time.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 9,
        value_parser = clap::value_parser!(u32).range(1..=1000)
    )]
    runs: u32,
}

/// Orders the collisions in every way and measures them.
fn measure(args: &OrderArgs, session: &Session) -> Result<Part> {
    let source = Source::load(args, &session.common)?;
    let windows = args
        .depth
        .iter()
        .map(|depth| IssueWindow::new(*depth, args.per_issue))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Failure::input)?;
    let measured = rows::measure(&source, &windows, args.runs).map_err(refused)?;
    let input = source.input();
    let mut part = Part::of(vec![table(&measured)]);
    let step = match &args.input {
        Some(path) => format!("the step in {}", shown(path)),
        None => source.name.clone(),
    };
    for window in windows.iter().take(1) {
        live::add(&mut part, &input, *window, &step).map_err(refused)?;
    }
    let scene = format!(
        "{}: {} collisions of {} moving bodies, {:.2} a body",
        source.name,
        grouped(input.pairs.len() as u64),
        grouped(source.moving() as u64),
        source.touches(),
    );
    part.fact("scene", scene);
    part.fact("verify", format!("{:.1} ns a collision", measured.verify_ns));
    part.data = json!({
        "config": { "depths": args.depth, "per_issue": args.per_issue, "runs": args.runs },
        "scene": {
            "name": source.name,
            "bodies": input.moving.len(),
            "moving": source.moving(),
            "collisions": input.pairs.len(),
            "collisions_per_body": source.touches(),
        },
        "verify_ns_per_collision": measured.verify_ns,
    });
    Ok(part)
}

/// The input of a folder is checked by the driver.
fn refused(error: OrderError) -> Failure {
    Failure::input(error).next("`pgs solve` tells more about refused input")
}

fn table(measured: &Measured) -> Table {
    let mut table = Table::new("orders", "The cost of each order");
    let count = |number: usize| Cell::Whole(number as u64);
    for row in &measured.rows {
        let report = &row.report;
        table.row([
            ("order", "order", text(&row.order)),
            ("depth", "depth\nslots", Cell::Whole(row.depth.into())),
            ("hazards", "hazards", count(report.hazards)),
            ("hazard_percent", "hazards\n%", Cell::Number(report.hazard_share() * 100.0, 2)),
            ("lost_updates", "lost\nupdates", count(report.lost_updates)),
            ("empty", "empty\nslots", count(report.empty)),
            ("empty_percent", "empty\n%", Cell::Number(report.empty_share() * 100.0, 3)),
            ("slots", "slots", count(report.slots)),
            ("most_alive", "alive\nmost", count(report.most_alive)),
            ("longest_span", "span\nlongest", count(report.longest_span)),
            ("mean_span", "span\nmean", Cell::Number(report.mean_span, 0)),
            (
                "host_ns_per_collision",
                "host\nns/coll.",
                Cell::known(row.host_ns, |ns| Cell::Number(ns, 1)),
            ),
        ]);
    }
    table
}
