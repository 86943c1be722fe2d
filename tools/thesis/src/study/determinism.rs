//! Thesis §4.5: how far two solutions of the same steps differ by the order of their collisions
//! alone.

use clap::Args;
use zynq_pgs::order::Order;

use super::course::{POSITION_MEAN, Point, Side, Solver, Steps, take};
use super::recorded::{FLOAT_AGAINST_GPU, TWO_GPU_RUNS, percent};
use super::spread::Spread;
use super::start::{Start, StartArgs};
use crate::deviation::Deviations;
use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::permutation::Permutation;
use crate::session::Session;
use pgs_command::board::OpenBoard;
use pgs_command::failure::{Failure, Result};
use pgs_command::options::ordering::is_sequential;

const EXAMPLES: &str = "\
Examples:
  pgs thesis determinism --input tests/golden/pile5_step60
  pgs thesis determinism --grid 10x10x10 --steps 200
  pgs thesis determinism --drop 5 --pairs 2 --steps 150 --every 1 --json > orders.json
  pgs thesis determinism --grid 8x8x8 --from 70 --steps 1

The board solves the collisions one after the other in the order sent; only the order differs \
between
the runs. Two comparisons: the order as given (the thesis' design) against the order of Bullet's \
GPU,
which is the original; and pairs of random orders (two runs on a GPU), seeds N and N+1, N+2 and N+3,
with the mean over the pairs and, behind +-, their standard deviation.
The order of the GPU comes from the folder's gpu_order.npy (M) <u4; without this file collisions are
put into Bullet's cells of 6 m and batches of 64, which is named \"cells\".

Deviation is |new - original| / |original| of each component of a position, in world coordinates
(thesis eq. 4.1), over all moving bodies; components whose original is 0 are left out. Positions are
not taken relative to their change in the step: deviations would be a hundred times larger. A
velocity is within 1 % if it differs by at most 1 % of the original's component. The energies are
kinetic.";

/// The experiment.
pub(crate) static ORDERS: Experiment = Experiment::of::<Options>(
    "determinism",
    "§4.5, §4.6.3, Figures 4.2 and 4.9",
    Boards::Any,
    "The same steps with collisions in different orders",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    #[command(flatten)]
    start: StartArgs,
    /// Pairs of random orders [default: 20 from a folder, 3 from a scene]
    #[arg(long, value_name = "N")]
    pairs: Option<u32>,
    /// Seed of the first random order; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    order_seed: u64,
}

/// Pairs of random orders from a folder, and from a scene.
const PAIRS: [u32; 2] = [20, 3];

/// Measures of a step that are shown.
const MEASURES: [&str; 7] = [
    "energy_difference_percent",
    "position_mean_percent",
    "position_under_1_percent",
    "position_mean_mm",
    "linear_within_1_percent",
    "linear_most_m_s",
    "angular_within_1_percent",
];

/// A new order against an original one.
#[derive(Debug)]
struct Compared {
    /// The start, and the state after each step.
    points: Vec<Point>,
    /// The deviations of the positions after the last step.
    positions: Deviations,
}

/// Steps both orders; none if Ctrl-C ended them.
fn compared(
    orders: [Option<Permutation>; 2],
    start: &Start<'_>,
    opened: &mut OpenBoard,
    session: &Session,
) -> Result<Option<Compared>> {
    let parameters = start.parameters.with_order(Some(Order::AsGiven));
    // The new order, which may be as given, meets refused input first and names its place.
    let mut sides =
        orders.map(|order| Side::new(String::new(), start, Solver::Board(0), order, parameters));
    if !take(&mut sides, 1, std::slice::from_mut(opened), start, session)? {
        return Ok(None);
    }
    let [new, original] = sides;
    let positions = new.deviations(&original, |body| body.pose.position);
    Ok(Some(Compared { points: new.points, positions }))
}

/// A measure over all pairs after a step.
fn over(pairs: &[Compared], step: u32, of: fn(&Point) -> Option<f64>) -> Option<Spread> {
    let values: Vec<f64> =
        pairs.iter().filter_map(|pair| of(pair.points.get(step as usize)?)).collect();
    Spread::of(&values)
}

impl Measure for Options {
    /// Steps all runs and compares them.
    fn measure(&self, session: &Session) -> Result<Part> {
        let mut start = Start::load(&self.start)?;
        let config = self.start.scene.config(&session.common.build());
        let mut opened = start.open(config, &session.common, session)?;
        if !is_sequential(opened.accelerator.capabilities()) {
            let error = "this board does not solve the collisions one after the other in any order: it \
                     reads stale velocities at hazards, or keeps few bodies on chip";
            return Err(Failure::input(error)
                .next("take a board that waits on hazards, such as --board emulated"));
        }
        let count = self.pairs.unwrap_or(PAIRS[usize::from(self.start.input.is_none())]);
        let mut gpu = None;
        if start.step_to(&mut opened, session)? {
            gpu = compared([None, Some(Permutation::Gpu)], &start, &mut opened, session)?;
        }
        let mut pairs = Vec::new();
        for pair in 0..if gpu.is_some() { u64::from(count) } else { 0 } {
            let seed = self.order_seed.wrapping_add(2 * pair);
            let orders = [seed.wrapping_add(1), seed].map(Permutation::Random).map(Some);
            match compared(orders, &start, &mut opened, session)? {
                Some(compared) => pairs.push(compared),
                None => break,
            }
        }
        session.end();
        let source = if start.recorded_order.is_some() { "gpu_order.npy" } else { "cells" };
        let mut part = Part::of(Vec::new());
        part.complete = gpu.is_some() && pairs.len() as u64 == u64::from(count);
        part.fact("start", start.text());
        let orders =
            format!("as-given against gpu ({source}); random orders in pairs: {}", pairs.len());
        part.fact("orders", orders);
        for recorded in [TWO_GPU_RUNS, FLOAT_AGAINST_GPU] {
            part.fact("recorded", recorded.text());
        }
        let Some(gpu) = gpu else { return Ok(part) };
        let mut steps = Steps::new("Deviation of one order from another, step by step", &MEASURES);
        for step in start.shown().filter(|step| *step > 0) {
            let Some(point) = gpu.points.get(step as usize) else { continue };
            steps.row(step, "as-given against gpu", |of| of(point));
            if !pairs.is_empty() {
                steps.row(step, "random pairs", |of| Some(over(&pairs, step, of)?.mean));
                steps.row(step, "+-", |of| Some(over(&pairs, step, of)?.standard_deviation));
            }
        }
        part.tables.push(steps.table);
        let random = Deviations::merged(pairs.iter().map(|pair| &pair.positions));
        part.tables.push(Deviations::table(&[
            ("as-given against gpu", &gpu.positions),
            ("random pairs", &random),
        ]));
        let shown = Shown { start: &start, source, gpu, pairs, random };
        shown.over_steps(&mut part);
        shown.positions(&mut part);
        Ok(part)
    }
}

/// The comparisons for the figures.
struct Shown<'a> {
    start: &'a Start<'a>,
    /// The source of the GPU's order.
    source: &'static str,
    gpu: Compared,
    pairs: Vec<Compared>,
    /// The positions of all pairs.
    random: Deviations,
}

impl Shown<'_> {
    /// The source of the order that stands for the GPU's.
    fn source(&self) -> String {
        match self.source {
            "cells" => "reconstructed by Bullet's cells and batches (cells)".to_owned(),
            file => format!("as Bullet recorded it ({file})"),
        }
    }

    /// The steps after which the orders are compared.
    fn after(&self) -> String {
        match self.start.steps {
            1 => "after one step".to_owned(),
            steps => format!("after {steps} steps"),
        }
    }

    /// Figure 4.2, of one step or of many.
    fn over_steps(&self, part: &mut Part) {
        let (_, _, mean) = POSITION_MEAN;
        let last = self.start.steps;
        let curve = |of: &dyn Fn(u32) -> Option<f64>| {
            (1..=last).filter_map(|step| Some((f64::from(step), of(step)?))).collect::<Vec<_>>()
        };
        let random = curve(&|step| Some(over(&self.pairs, step, mean)?.mean));
        let gpu = curve(&|step| mean(self.gpu.points.get(step as usize)?));
        let band = |percent: f64| vec![(1.0, percent), (f64::from(last), percent)];
        let [low, high] = TWO_GPU_RUNS.mean_percent;
        let series = [
            Series::new("two random orders", Drawn::Marked, random),
            Series::new("as given against the GPU's", Drawn::Marked, gpu),
            Series::new(format!("{low} %, recorded"), Drawn::Dashes, band(low)),
            Series::new(format!("{high} %, recorded"), Drawn::Dashes, band(high)),
        ];
        let figure = Figure::new(
            (if last == 1 { "figure-4-2-once" } else { "figure-4-2" }, TWO_GPU_RUNS.thesis),
            "Deviation of positions between two executions, step by step",
            lines(Axis::linear("step"), Axis::log("mean deviation (eq. 4.1), %"), &series),
            format!(
                "{}: the runs differ by the order of their collisions alone, and the GPU's order \
                 is {}. The thesis does not say after how many steps its snapshots were taken.",
                self.start.subject(),
                self.source()
            ),
        );
        let row = over(&self.pairs, last, mean).map(|of| {
            let subject = "mean deviation of positions between two random orders; the thesis \
                           compares two executions on the GPU";
            let ours = match self.pairs.len() {
                1 => format!("{:.4} %", of.mean),
                pairs => format!("{:.4} ± {:.4} % ({pairs} pairs)", of.mean, of.standard_deviation),
            };
            let recorded = format!("{low} % to {high} %");
            figure.row(format!("{subject}, {}", self.after()), recorded, ours)
        });
        part.figure(figure, row);
    }

    /// Figure 4.9, of one step or of many.
    fn positions(&self, part: &mut Part) {
        let last = self.start.steps;
        let of =
            [("as given against the GPU's", &self.gpu.positions), ("random orders", &self.random)];
        let of = of.into_iter().filter(|(_, deviations)| !deviations.is_empty());
        let series = of.map(|(name, of)| Series::new(name, Drawn::Line, of.below()));
        let share = FLOAT_AGAINST_GPU.under_1_percent_share.unwrap_or_default();
        let mut curve =
            self.gpu.points.iter().map(|point| point.away.map(|away| away.state.position));
        let falls = curve.clone().position(|at| at.is_some_and(|at| at.under_share() <= share));
        let falls = match falls {
            Some(step) => format!("in step {step} the share below 1 % first falls to the thesis'"),
            None => "the share below 1 % stays above the thesis'".to_owned(),
        };
        let figure = Figure::new(
            (if last == 1 { "figure-4-9-once" } else { "figure-4-9" }, FLOAT_AGAINST_GPU.thesis),
            format!(
                "Deviation of positions between the order as given and the GPU's, {}",
                self.after()
            ),
            FLOAT_AGAINST_GPU.spread(series.collect()),
            format!(
                "Both orders are solved on the emulated board: no GPU takes part. {}, the GPU's \
                 order {}; {falls}. A step moves a body by centimetres, its position is metres: \
                 one step leads to less than the thesis' figures.",
                self.start.subject(),
                self.source()
            ),
        );
        let orders = format!(
            "the order as given against the GPU's order ({}), both on the emulated board, {}",
            self.source,
            self.after()
        );
        let rows = curve.next_back().flatten().map(|position| {
            [
                figure.row(
                    format!("positions that deviate by less than 1 %: {orders}"),
                    format!("{:.2} %", share * 100.0),
                    percent(position.under_share()),
                ),
                figure.row(
                    format!("mean deviation of positions: {orders}"),
                    format!("{} %", FLOAT_AGAINST_GPU.mean_percent[0]),
                    format!("{:.4} %", position.mean * 100.0),
                ),
            ]
        });
        part.figure(figure, rows.into_iter().flatten());
    }
}
