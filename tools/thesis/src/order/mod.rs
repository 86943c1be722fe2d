//! Measures each order of a step's collisions, for every depth of the pipeline, and draws Figure
//! 4.13: the bodies alive in each slot.

mod cost;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use scene::{Grid, SplitMix64};
use zynq_pgs::StepParameters;
use zynq_pgs::order::{
    InputBuffers, IssueWindow, Order, OrderError, OrderInput, Orderer, Schedule,
};

use self::cost::Cost;
use crate::estimate::thesis::BODIES;
use crate::experiment::{Boards, Experiment, Measure, Part, shown};
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::permutation::body_by_body::{self, Ties};
use crate::permutation::{self, shuffled};
use crate::session::Session;
use crate::study::given::GivenStep;
use crate::study::recorded::{MOST_ALIVE, MOST_ALIVE_PERCENT};
use crate::table::{Cell, Table, text};
use pgs_command::failure::{Failure, Result};
use pgs_command::numbers::grouped;
use pgs_command::pile;

const EXAMPLES: &str = "\
Examples:
  pgs thesis order --input tests/golden/pile5_step60
  pgs thesis order --grid 10x10x10 --drop 0.5 --steps 60 --json

Depth is the hazard window in issue slots: the cycles from the read of a velocity to its
write-back, by the initiation interval. A collision is hazardous if it shares a moving body with
one of the depth - 1 slots before it. A body is alive from its first collision to its last; spans
are counted in issue slots, empty ones included.

The folder is one for `pgs solve`. If it also holds gpu_order.npy (M) <u4, the order of Bullet's
GPU, this order is measured, too.";

/// The experiment.
pub(crate) static ORDER: Experiment = Experiment::of::<OrderArgs>(
    "order",
    "§4.7, Algorithm 3",
    Boards::Any,
    "The cost of each order of the collisions: hazards, empty slots, live bodies, host time",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct OrderArgs {
    /// Collisions of a folder of .npy arrays.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "steps", "drop"])]
    input: Option<PathBuf>,
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
}

/// Seed of the random order; any number does.
const SEED: u64 = 20_260_101;
/// Runs for the median host time, behind one to warm up.
const RUNS: usize = 3;
/// Ranges of slots; a curve shows the maximum of each.
const RANGES: usize = 400;

/// Makes an order for a window.
type Making<'a> = Box<dyn FnMut(IssueWindow) -> Result<Schedule, OrderError> + 'a>;

/// How often an order is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Made {
    /// Never: it is given, and no host time counts.
    Given,
    /// Once for all depths.
    Once,
    /// At each depth, on which it depends.
    AtEachDepth,
}

/// An order of the table, and of the figure.
struct Kind<'a> {
    name: &'static str,
    /// Its name in the figure.
    drawn: Option<&'static str>,
    make: Making<'a>,
    made: Made,
}

fn kinds<'a>(input: &'a OrderInput<'a>, gpu: Option<&[u32]>) -> Vec<Kind<'a>> {
    let listed = |order: Vec<u32>| -> Schedule { order.into_iter().map(Some).collect() };
    let driver = |name, drawn, order| {
        let mut orderer = Orderer::new();
        let make = move |window| orderer.order(input, order, window).cloned();
        let made = if order.is_hazard_free() { Made::AtEachDepth } else { Made::Once };
        Kind { name, drawn, make: Box::new(make), made }
    };
    let fixed = |name, order| {
        let schedule = listed(order);
        Kind { name, drawn: None, make: Box::new(move |_| Ok(schedule.clone())), made: Made::Given }
    };
    let thesis = |name, drawn, ties| {
        let make = move |_| Ok(listed(body_by_body::order(input, ties)));
        Kind { name, drawn: Some(drawn), make: Box::new(make), made: Made::Once }
    };
    let random = shuffled(&mut SplitMix64::new(SEED), input.pairs.len());
    let [lowest, oldest, newest] = [
        "Algorithm 3, ties by the lowest index",
        "Algorithm 3, ties by the oldest",
        "Algorithm 3, ties by the newest",
    ];
    let mut kinds = vec![driver("as given", Some("as given"), Order::AsGiven)];
    kinds.extend(gpu.map(|order| fixed("Bullet's GPU batches", order.to_vec())));
    kinds.extend([
        fixed("random", random),
        thesis("thesis, lowest index", lowest, Ties::LowestIndex),
        thesis("thesis, oldest", oldest, Ties::Oldest),
        thesis("thesis, newest", newest, Ties::Newest),
        driver("interleaved", None, Order::Interleaved),
        driver("hazard-free", Some("hazard-free (ours)"), Order::HazardFree),
    ]);
    kinds
}

impl Measure for OrderArgs {
    /// Orders the collisions in every way and measures them.
    fn measure(&self, session: &Session) -> Result<Part> {
        let windows = self.depth.iter().map(|depth| IssueWindow::new(*depth, self.per_issue));
        let windows = windows.collect::<Result<Vec<_>, _>>().map_err(Failure::input)?;
        let (name, step, gpu) = match &self.input {
            Some(path) => {
                let step = GivenStep::folder(path)?;
                let gpu = permutation::recorded(path, step.collisions.len())?;
                (format!("the step in {}", shown(path)), Some(step), gpu)
            }
            None => {
                let OrderArgs { grid, drop, steps, .. } = *self;
                let (scene, mut opened) =
                    pile::open(grid, drop, &session.common, session.common.build().config())?;
                let parameters = StepParameters::thesis();
                let step = GivenStep::after(steps, scene, &mut opened, parameters, session)?;
                (format!("{grid} cubes dropped from {drop} m, step {}", steps + 1), step, None)
            }
        };
        session.end();
        let Some(step) = step else { return Ok(Part::interrupted()) };
        let mut buffers = InputBuffers::new();
        let input = buffers.gather(&step.bodies, &step.collisions[..], &step.shapes);
        let moving = input.moving.iter().filter(|moving| **moving).count();
        let mut part = orders(&input, gpu.as_deref(), &windows, &name).map_err(|error| {
            Failure::input(error).next("`pgs solve` tells more about refused input")
        })?;
        let uses = input.pairs.iter().flatten().filter(|body| is_moving(&input, **body)).count();
        let scene = format!(
            "{name}: {} collisions of {} moving bodies, {:.2} a body",
            grouped(input.pairs.len() as u64),
            grouped(moving as u64),
            uses as f64 / (moving as f64).max(1.0),
        );
        part.fact("scene", scene);
        Ok(part)
    }
}

/// Whether a body moves; a collision without contact points has no bodies.
fn is_moving(input: &OrderInput<'_>, body: u32) -> bool {
    input.moving.get(body as usize) == Some(&true)
}

/// The table of every order at every depth, and the figure of the first depth.
fn orders(
    input: &OrderInput<'_>,
    gpu: Option<&[u32]>,
    windows: &[IssueWindow],
    step: &str,
) -> Result<Part, OrderError> {
    // The driver's check of the input, which the orders made here need.
    for window in windows.iter().take(1) {
        Orderer::new().order(input, Order::AsGiven, *window)?;
    }
    let mut table = Table::new("orders", "The cost of each order");
    let (mut series, mut most) = (Vec::new(), Vec::new());
    for mut kind in kinds(input, gpu) {
        let mut made = None;
        for (place, window) in windows.iter().copied().enumerate() {
            let (schedule, ns) = match made.take().filter(|_| kind.made != Made::AtEachDepth) {
                Some(made) => made,
                None => timed(&mut kind, input, window)?,
            };
            let cost = Cost::measure(&schedule, input, window);
            row(&mut table, kind.name, window.depth(), &cost, ns);
            if let Some(name) = kind.drawn.filter(|_| place == 0) {
                let largest = grouped(cost.most_alive().into());
                most.push(format!("{largest} ({})", name.replace("Algorithm 3, ", "")));
                series.push(Series::new(name, Drawn::Line, thinned(&cost.alive)));
            }
            made = Some((schedule, ns));
        }
    }
    let ends = series.iter().flat_map(|series: &Series| series.points.last()).map(|at| at.0);
    let (end, recorded) = (ends.fold(1.0, f64::max), f64::from(MOST_ALIVE));
    let name = format!("{}, the thesis' largest", grouped(MOST_ALIVE.into()));
    series.push(Series::new(name, Drawn::Dashes, vec![(0.0, recorded), (end, recorded)]));
    let figure = Figure::new(
        ("figure-4-13", "§4.7, Figure 4.13"),
        "Bodies to keep on chip along the sorted collisions",
        lines(Axis::linear("issue slot"), Axis::log("bodies alive"), &series),
        format!(
            "A body is alive from its first collision to its last. The step is {step}; the thesis' \
             own is not published, and its Algorithm 3 does not say how ties are broken.",
        ),
    );
    let moving = input.moving.iter().filter(|moving| **moving).count();
    let subject = format!("most bodies alive of {}", grouped(moving as u64));
    let mut row = figure.row(subject, recorded_share(), most[1..].join("; "));
    row.thesis += ", Algorithm 3";
    let mut part = Part::of(vec![table]);
    part.figure(figure, [row]);
    Ok(part)
}

/// The order, and the median time of making it, ns a collision; no time if it is given.
fn timed(
    kind: &mut Kind<'_>,
    input: &OrderInput<'_>,
    window: IssueWindow,
) -> Result<(Schedule, Option<f64>), OrderError> {
    let mut schedule = (kind.make)(window)?;
    let mut times = Vec::new();
    for _ in 0..if kind.made == Made::Given { 0 } else { RUNS } {
        let begin = Instant::now();
        schedule = (kind.make)(window)?;
        times.push(begin.elapsed().as_secs_f64() * 1e9 / (input.pairs.len() as f64).max(1.0));
    }
    times.sort_unstable_by(f64::total_cmp);
    Ok((schedule, times.get(times.len() / 2).copied()))
}

fn row(table: &mut Table, order: &str, depth: u32, cost: &Cost, host_ns: Option<f64>) {
    let count = |number: usize| Cell::Whole(number as u64);
    table.row([
        ("order", "order", text(order)),
        ("depth", "depth\nslots", Cell::Whole(depth.into())),
        ("hazards", "hazards", count(cost.hazards)),
        ("hazard_percent", "hazards\n%", Cell::Number(cost.hazard_share() * 100.0, 2)),
        ("lost_updates", "lost\nupdates", count(cost.lost_updates)),
        ("empty", "empty\nslots", count(cost.empty)),
        ("empty_percent", "empty\n%", Cell::Number(cost.empty_share() * 100.0, 3)),
        ("slots", "slots", count(cost.alive.len())),
        ("most_alive", "alive\nmost", Cell::Whole(cost.most_alive().into())),
        ("longest_span", "span\nlongest", count(cost.longest_span)),
        ("mean_span", "span\nmean", Cell::Number(cost.mean_span, 0)),
        ("host_ns_per_collision", "host\nns/coll.", Cell::known(host_ns, |ns| Cell::Number(ns, 1))),
    ]);
}

/// The largest number of each range of slots.
fn thinned(alive: &[u32]) -> Vec<(f64, f64)> {
    let each = alive.len().div_ceil(RANGES).max(1);
    let most = |range: &[u32]| f64::from(range.iter().copied().max().unwrap_or(0));
    alive.chunks(each).enumerate().map(|(k, range)| ((k * each) as f64, most(range))).collect()
}

/// The thesis' number and share, and the share that its numbers give.
fn recorded_share() -> String {
    let [most, bodies] = [MOST_ALIVE.into(), BODIES].map(grouped);
    let share = 100.0 * f64::from(MOST_ALIVE) / BODIES as f64;
    format!("{most} of {bodies} ({MOST_ALIVE_PERCENT} %; {most} / {bodies} is {share:.2} %)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recorded_share_is_printed_beside_the_one_that_its_numbers_give() {
        assert_eq!(recorded_share(), "1,528 of 38,880 (3.85 %; 1,528 / 38,880 is 3.93 %)");
    }

    #[test]
    fn a_thinned_curve_keeps_the_largest_of_each_range() {
        let alive: Vec<u32> = (0..1000).map(|k| if k == 501 { 77 } else { 1 }).collect();
        let points = thinned(&alive);
        assert_eq!(points.len(), 334);
        assert_eq!(points.iter().filter(|point| point.1 > 1.0).count(), 1);
    }
}
