//! The verb `run`: steps a scene and shows what every step cost.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use scene::{Scene, kinetic_energy};
use serde_json::{Value, json};
use zynq_pgs::{Limit, StepParameters, StepReport};

use super::SCHEMA;
use super::table::{Bound, Column, grouped, heading, line};
use crate::args::CommonArgs;
use crate::board::{self, Opened};
use crate::diagnosis::FaultArgs;
use crate::failure::{Failure, Verdict};
use crate::footprint::Footprint;
use crate::interrupt::Interrupt;
use crate::options::{BuildArgs, DeadlineArgs};
use crate::ordering::{self, OrderingArgs};
use crate::planned::{self, PlannedArgs};
use crate::scenes::SceneArgs;
use step_folder::digest;

const EXAMPLES: &str = "\
Examples:
  pgs run                                        the thesis' scene
  pgs run --grid 10x10x10 --steps 60 --report-every 10
  pgs run --hazards unchecked --window 64        hardware that does not wait on hazards
  pgs run --hazards unchecked --order as-given   the same, the way the thesis orders: piles gain energy
  pgs run --order hazard-free --verify
  pgs run --profile half --format thesis16       the thesis' design in sixteen bits
  pgs run --scene shapes --inertia world --grid 8x8x8
  pgs run --bandwidth unlimited --json > run.json
  pgs run --fault 'dma-dec-err@dma2.mm2s,phase=contact2,beat=17,step=5'
  pgs run --retries 2 --report fault.json        faults of the board: try again, then keep all about them";

/// Rows of the table, if not said otherwise.
const ROWS: u32 = 15;

/// Step a pile dropped on the ground.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RunArgs {
    /// Steps of 1/60 s.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: u32,
    #[command(flatten)]
    scene: SceneArgs,
    /// Show every N-th step [default: a fifteenth of the steps]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    report_every: Option<u32>,
    #[command(flatten)]
    ordering: OrderingArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    faults: FaultArgs,
    #[command(flatten)]
    build: BuildArgs,
    #[command(flatten)]
    planned: PlannedArgs,
}

/// What one step did.
struct Row {
    step: u32,
    ground_pairs: usize,
    kinetic_energy: f64,
    detect: Duration,
    report: StepReport,
}

const COLUMNS: [Column; 18] = [
    Column { name: "step", unit: "", width: 5 },
    Column { name: "pairs", unit: "", width: 8 },
    Column { name: "ground", unit: "pairs", width: 6 },
    Column { name: "empty", unit: "entries", width: 7 },
    Column { name: "impulses", unit: "N s", width: 10 },
    Column { name: "energy", unit: "kJ", width: 9 },
    Column { name: "formula", unit: "cycles", width: 10 },
    Column { name: "stalls", unit: "cycles", width: 12 },
    Column { name: "waits", unit: "cycles", width: 9 },
    Column { name: "modelled", unit: "ms", width: 9 },
    Column { name: "moved", unit: "MB", width: 7 },
    Column { name: "limit", unit: "", width: 8 },
    Column { name: "hazards", unit: "", width: 9 },
    Column { name: "detect", unit: "host ms", width: 7 },
    Column { name: "order", unit: "host ms", width: 7 },
    Column { name: "pack", unit: "host ms", width: 7 },
    Column { name: "device", unit: "host ms", width: 7 },
    Column { name: "unpack", unit: "host ms", width: 7 },
];

impl Row {
    fn bytes(&self) -> u64 {
        self.report.bytes_to_device + self.report.bytes_from_device
    }

    fn cells(&self) -> [String; 18] {
        let StepReport { cycles, host, saturated, .. } = &self.report;
        let impulses = match self.report.impulse_sum {
            Some(sum) => format!("{sum:.1}"),
            None if saturated.impulse_sum => Bound::AtLeast.short(StepReport::IMPULSE_SUM_MAX),
            None => "-".to_owned(),
        };
        [
            self.step.to_string(),
            grouped(self.report.collisions),
            grouped(self.ground_pairs as u64),
            grouped(self.report.empty),
            impulses,
            format!("{:.3}", self.kinetic_energy / 1e3),
            Bound::AtLeast.cell(saturated.work, cycles.work),
            Bound::AtMost.cell(saturated.stalls(), cycles.stalls),
            Bound::AtLeast.cell(saturated.waits, cycles.waits),
            format!("{:.3}", milliseconds(self.report.modelled_time())),
            format!("{:.1}", self.bytes() as f64 / 1e6),
            limit_text(self.report.limit()).to_owned(),
            Bound::AtLeast.cell(saturated.hazards, self.report.hazards),
            format!("{:.1}", milliseconds(self.detect)),
            format!("{:.1}", milliseconds(host.order)),
            format!("{:.1}", milliseconds(host.validate + host.pack)),
            format!("{:.1}", milliseconds(host.start + host.wait)),
            format!("{:.1}", milliseconds(host.unpack + host.commit)),
        ]
    }

    fn to_json(&self) -> Value {
        let mut value = super::report_json(&self.report);
        value["step"] = self.step.into();
        value["ground_pairs"] = self.ground_pairs.into();
        value["kinetic_energy_j"] = self.kinetic_energy.into();
        value["host_ms"]["detect"] = milliseconds(self.detect).into();
        value
    }
}

pub(super) fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

pub(super) fn limit_text(limit: Limit) -> &'static str {
    match limit {
        Limit::Pipeline => "pipeline",
        Limit::Hazards => "hazards",
        Limit::Streams => "streams",
        Limit::Unknown => "unknown",
        _ => "other",
    }
}

/// Steps the scene.
pub(crate) fn run(
    args: &RunArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let mut opened = board::open(common, &args.build)?;
    args.scene.check_size(&opened)?;
    let mut scene = args.scene.build(&args.build)?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;

    let interrupt = Interrupt::install();
    opened.accelerator.set_cancellation(interrupt.cancellation());
    let every = args.report_every.unwrap_or(args.steps.div_ceil(ROWS));
    let progress = progress_bar(args.steps);
    let parameters = args.ordering.apply(args.deadline.apply(StepParameters::default()));
    let parameters = args.faults.apply(parameters);
    args.planned.inject(&mut opened, &parameters)?;
    let variant = opened.accelerator.capabilities().variant;
    let mut footprint = Footprint::default();
    let mut orders = ordering::OrdersSent::default();
    let mut documents = Vec::new();
    let mut done = 0;
    let mut retries = 0;
    while done < args.steps && !interrupt.is_set() {
        let row = step(done + 1, &parameters, &mut opened, &mut scene)
            .map_err(|error| args.faults.failure(&opened, &parameters, error))?;
        let Some(row) = row else { break };
        done += 1;
        retries += u64::from(row.report.retries);
        footprint.see(&variant, &row.report);
        orders.see(row.report.order);
        if done == 1 && !common.json {
            // Only now: a scene that is refused prints nothing but the refusal.
            progress.suspend(|| print_heading(args, &opened, &row.report, out))?;
        }
        progress.inc(1);
        if common.json {
            documents.push(row.to_json());
        } else if done == 1 || done % every == 0 || done == args.steps {
            progress.suspend(|| line(out, &COLUMNS, row.cells()))?;
            out.flush()?;
        }
    }
    progress.finish_and_clear();

    let digest = format!("{:016x}", digest::of_bodies(scene.bodies()));
    let complete = done == args.steps;
    if common.json {
        let mut config = args.scene.to_json();
        config["steps"] = args.steps.into();
        let document = json!({
            "schema": SCHEMA,
            "verb": "run",
            "config": config,
            "board": opened.to_json(),
            "complete": complete,
            "steps": documents,
            "faults": planned::to_json(&opened),
            "memory": footprint.to_json(),
            "digest": { "algorithm": digest::ALGORITHM, "value": digest },
        });
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(out)?;
        if let Some(faults) = planned::text(&opened) {
            writeln!(out, "{faults}")?;
        }
        if retries > 0 {
            writeln!(out, "retries    {} of {done} steps", grouped(retries))?;
        }
        if !complete {
            writeln!(out, "interrupted after {done} of {} steps", args.steps)?;
        }
        if let Some(orders) = orders.text() {
            writeln!(out, "orders     {orders}")?;
        }
        if let Some(memory) = footprint.text() {
            writeln!(out, "memory     {memory}")?;
        }
        writeln!(out, "digest     {} {digest}", digest::ALGORITHM)?;
    }
    Ok(if complete { Verdict::Done } else { Verdict::Interrupted })
}

/// Which board, which scene, the first step's order, and the names of the columns.
fn print_heading(
    args: &RunArgs,
    opened: &Opened,
    first: &StepReport,
    out: &mut dyn Write,
) -> io::Result<()> {
    opened.print(out)?;
    writeln!(out, "scene      {}, {} steps", args.scene.text(), args.steps)?;
    writeln!(out, "order      {}", ordering::name(first.order))?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    out.flush()
}

/// Detects collisions and takes one step; nothing if Ctrl-C ended it.
fn step(
    number: u32,
    parameters: &StepParameters,
    opened: &mut Opened,
    scene: &mut Scene,
) -> Result<Option<Row>, zynq_pgs::Error> {
    let begin = Instant::now();
    scene.detect();
    let detect = begin.elapsed();
    let ground_pairs = scene.ground_pairs();
    let (bodies, collisions) = scene.parts_mut();
    let report = match opened.accelerator.step(bodies, collisions, parameters) {
        Ok(report) => report,
        Err(error) if board::is_cancelled(&error) => return Ok(None),
        Err(error) => return Err(error),
    };
    let kinetic_energy = kinetic_energy(scene.bodies(), scene.shapes());
    Ok(Some(Row { step: number, ground_pairs, kinetic_energy, detect, report }))
}

/// On stderr, and only if that is a terminal.
pub(super) fn progress_bar(steps: u32) -> ProgressBar {
    let bar = ProgressBar::new(steps.into());
    let style = "{bar:30} {pos}/{len} steps, {per_sec}, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(style) {
        bar.set_style(style);
    }
    bar
}
