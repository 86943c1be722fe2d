//! Thesis §4.5: how far two solutions of the same steps differ by the order of their collisions
//! alone.

mod show;

use clap::Args;
use serde::Serialize;
use serde_json::Value;
use zynq_pgs::Body;

use super::recorded::{FLOAT_AGAINST_GPU, RecordedDeviation, TWO_GPU_RUNS};
use super::run::Run;
use super::spread::Spread;
use super::start::{Start, StartArgs};
use crate::deviation::{StateDeviation, components, moving};
use crate::experiment::{Boards, Experiment, given};
use crate::histogram::Histogram;
use crate::permutation::Permutation;
use crate::session::Session;
use pgs_command::board::OpenBoard;
use pgs_command::failure::{Failure, Result};
use pgs_command::options::build::BuildArgs;
use pgs_command::options::ordering::is_sequential;

const EXAMPLES: &str = "\
Examples:
  pgs thesis determinism --input tests/golden/pile5_step60
  pgs thesis determinism --grid 10x10x10 --steps 200
  pgs thesis determinism --drop 5 --pairs 2 --steps 150 --json > orders.json
  pgs thesis determinism --grid 8x8x8 --from 70 --steps 1

The board solves the collisions one after the other in the order sent; only the order differs \
between
the runs. Two comparisons: the order as given (the thesis' design) against the order of Bullet's \
GPU,
which is the original; and pairs of random orders (two runs on a GPU), seeds N and N+1, N+2 and N+3.
The order of the GPU comes from the folder's gpu_order.npy (M) <u4; without this file collisions are
put into Bullet's cells of 6 m and batches of 64, which is named \"cells\".

Deviation is |new - original| / |original| of each component of a position, in world coordinates
(thesis eq. 4.1), over all moving bodies; components whose original is 0 are left out. Positions are
not taken relative to their change in the step: deviations would be a hundred times larger. A
velocity is within 1 % if it differs by at most 1 % of the original's component. The energies are
kinetic.";

/// The experiment.
pub(crate) static ORDERS: Experiment = Experiment {
    id: "determinism",
    thesis: "§4.5, §4.6.3, Figures 4.2 and 4.9",
    about: "The same steps with collisions in different orders",
    boards: Boards::Any,
    arguments: Options::augment_args,
    run: |args, session| Ok(measure(&given(args)?, session)?.part()),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    #[command(flatten)]
    pub(crate) start: StartArgs,
    /// Pairs of random orders [default: 20 from a folder, 3 from a scene]
    #[arg(long, value_name = "N")]
    pub(crate) pairs: Option<u32>,
    /// Seed of the first random order; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) order_seed: u64,
    #[command(flatten)]
    pub(crate) build: BuildArgs,
}

/// Pairs of random orders from a folder, and from a scene.
const PAIRS: [u32; 2] = [20, 3];

/// The outcome.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome {
    pub(crate) config: Value,
    pub(crate) board: Value,
    /// Whether no Ctrl-C ended the runs.
    pub(crate) complete: bool,
    /// The source of the GPU's order: "`gpu_order.npy`" or "cells".
    pub(crate) gpu_order: &'static str,
    /// As given against the order of the GPU.
    pub(crate) gpu: Comparison,
    /// Pairs of random orders.
    pub(crate) pairs: Vec<Comparison>,
    /// The pairs, step by step.
    pub(crate) over_pairs: Vec<OverPairs>,
    /// The positions of all pairs after the last step.
    pub(crate) pairs_position_histogram: Option<Histogram>,
    pub(crate) recorded: [RecordedDeviation; 2],
    #[serde(skip)]
    start_text: String,
    #[serde(skip)]
    subject: String,
}

/// Two orders.
#[derive(Debug, Serialize)]
pub(crate) struct Comparison {
    pub(crate) original: String,
    pub(crate) new: String,
    pub(crate) curve: Vec<Point>,
    /// The positions after the last step.
    pub(crate) position_histogram: Option<Histogram>,
    /// The linear velocities after the last step.
    pub(crate) linear_velocity_histogram: Option<Histogram>,
}

/// Two orders after a step.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Point {
    pub(crate) step: u32,
    #[serde(flatten)]
    pub(crate) state: StateDeviation,
    /// Kinetic energy with the original order and with the new one, J.
    pub(crate) kinetic_energy_j: [f64; 2],
}

impl Point {
    /// The difference of the energies by the original one.
    pub(crate) fn energy_difference(&self) -> f64 {
        let [original, new] = self.kinetic_energy_j;
        if original == 0.0 { 0.0 } else { (new - original).abs() / original }
    }
}

/// All pairs after a step.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct OverPairs {
    pub(crate) step: u32,
    pub(crate) position_mean_percent: Spread,
    pub(crate) position_under_1_percent_share: Spread,
    pub(crate) position_mean_m: Spread,
    pub(crate) linear_within_1_percent_share: Spread,
    pub(crate) linear_mean_m_s: Spread,
    pub(crate) angular_within_1_percent_share: Spread,
    pub(crate) energy_difference_percent: Spread,
}

impl OverPairs {
    /// Sums up the points of one step; none without a pair.
    fn of(points: &[&Point]) -> Option<Self> {
        let over = |measure: &dyn Fn(&Point) -> f64| {
            let values: Vec<f64> = points.iter().map(|point| measure(point)).collect();
            Spread::of(&values)
        };
        Some(Self {
            step: points.first()?.step,
            position_mean_percent: over(&|point| point.state.position.mean * 100.0)?,
            position_under_1_percent_share: over(&|point| point.state.position.under_share())?,
            position_mean_m: over(&|point| point.state.position.mean_absolute)?,
            linear_within_1_percent_share: over(&|point| point.state.linear.within_share())?,
            linear_mean_m_s: over(&|point| point.state.linear.mean_absolute)?,
            angular_within_1_percent_share: over(&|point| point.state.angular.within_share())?,
            energy_difference_percent: over(&|point| point.energy_difference() * 100.0)?,
        })
    }
}

/// Steps all runs and compares them.
pub(crate) fn measure(options: &Options, session: &Session) -> Result<Outcome> {
    let mut start = Start::load(&options.start)?;
    let mut opened = start.open(&options.build.build(), &session.common, session)?;
    if !is_sequential(opened.accelerator.capabilities()) {
        let error = "this board does not solve the collisions one after the other in any order: it \
                     reads stale velocities at hazards, or keeps few bodies on chip";
        return Err(Failure::input(error)
            .next("take a board that waits on hazards, such as --profile float"));
    }
    let from_folder = options.start.input.is_some();
    let pairs = options.pairs.unwrap_or(if from_folder { PAIRS[0] } else { PAIRS[1] });
    session.expect(u64::from(start.steps) * 2 * (u64::from(pairs) + 1));
    let mut complete = start.step_to(&mut opened, session)?;

    let mut compared = |orders| compare(orders, &start, &mut opened, session);
    let (gpu, whole) = compared([Some(Permutation::Gpu), None])?;
    complete &= whole;
    let mut of_pairs = Vec::new();
    for pair in 0..u64::from(pairs) {
        if !complete {
            break;
        }
        let seed = options.order_seed.wrapping_add(2 * pair);
        let orders = [seed, seed.wrapping_add(1)].map(Permutation::Random).map(Some);
        let (comparison, whole) = compared(orders)?;
        complete &= whole;
        if whole {
            of_pairs.push(comparison);
        }
    }
    session.end();

    let mut config = start.to_json();
    config["pairs"] = pairs.into();
    config["order_seed"] = options.order_seed.into();
    Ok(Outcome {
        config,
        board: opened.to_json(),
        complete,
        gpu_order: if start.has_recorded_order() { "gpu_order.npy" } else { "cells" },
        gpu,
        over_pairs: over_pairs(&of_pairs),
        pairs_position_histogram: merged(&of_pairs),
        pairs: of_pairs,
        recorded: [TWO_GPU_RUNS, FLOAT_AGAINST_GPU],
        start_text: start.text(),
        subject: start.subject(),
    })
}

/// Steps two runs side by side; also whether both took all steps.
fn compare(
    orders: [Option<Permutation>; 2],
    start: &Start<'_>,
    opened: &mut OpenBoard,
    session: &Session,
) -> Result<(Comparison, bool)> {
    let [original, new] = orders.map(|order| match order {
        Some(order) => order.text(),
        None => "as-given".to_owned(),
    });
    let mut runs = (start.run(orders[0])?, start.run(orders[1])?);
    let moving = moving(start.bodies(), start.shapes());
    let mut curve = Vec::new();
    let mut complete = true;
    for step in 1..=start.steps {
        // The run as given, which is the second, meets refused input first and names its place.
        let mut taken = |run: &mut Run<'_>| run.step(opened, &start.parameters, session);
        if !(taken(&mut runs.1)? && taken(&mut runs.0)?) {
            complete = false;
            break;
        }
        curve.push(Point {
            step,
            state: StateDeviation::of(runs.0.bodies(), runs.1.bodies(), &moving),
            kinetic_energy_j: [runs.0.kinetic_energy(), runs.1.kinetic_energy()],
        });
    }
    let histogram = |field: fn(&Body) -> [f32; 3]| {
        let pairs = components(runs.0.bodies(), runs.1.bodies(), &moving, field);
        complete.then(|| Histogram::of(pairs))
    };
    let comparison = Comparison {
        original,
        new,
        curve,
        position_histogram: histogram(|body| body.pose.position),
        linear_velocity_histogram: histogram(|body| body.velocity.linear),
    };
    Ok((comparison, complete))
}

/// The pairs, step by step.
fn over_pairs(pairs: &[Comparison]) -> Vec<OverPairs> {
    let steps = pairs.iter().map(|pair| pair.curve.len()).min().unwrap_or(0);
    let at = |step: usize| -> Vec<&Point> {
        pairs.iter().filter_map(|pair| pair.curve.get(step)).collect()
    };
    (0..steps).filter_map(|step| OverPairs::of(&at(step))).collect()
}

/// The histograms of the pairs' positions in one.
fn merged(pairs: &[Comparison]) -> Option<Histogram> {
    let mut each = pairs.iter().filter_map(|pair| pair.position_histogram.as_ref());
    let mut all = each.next()?.clone();
    each.for_each(|one| all.include(one));
    Some(all)
}
