//! The verb `formats`: measures the sizes of a step's numbers, and their errors in 16-bit formats.

mod numbers;
mod tally;

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use self::numbers::{AS_STREAMED, Numbers, SUMS};
pub(crate) use self::numbers::{EACH_ONCE, numbers};
pub(crate) use self::tally::{Loss, Sizes};
use crate::board;
use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::interrupt::Interrupt;
use crate::narrow::NarrowFormat;
use crate::numbers::{grouped, number};
use crate::options::build::BuildArgs;
use crate::options::scenes::SceneArgs;
use crate::options::solver::DeadlineArgs;
use crate::output::SCHEMA;
use crate::output::progress::progress_bar;
use crate::output::table::{Column, heading, line};
use crate::pile;
use crate::step_input;
use step_folder::folder::Folder;

const EXAMPLES: &str = "\
Examples:
  pgs formats --input tests/golden/pile5_step60
  pgs formats --grid 10x10x10 --step 70 --json

The numbers are the ones that a step streams to the board, without unused contact points, indices
and counts. The sum \"as streamed\" has the positions of both bodies with every collision, the sum
\"each once\" has the position of each body once. Relative numbers have the position of body A
subtracted; a static body counts as being at the other body's
position. Neither sum includes the relative numbers.

Relative errors are |read back - number| / |number|. A zero has no relative error, and does not
count as below 3e-5. The driver refuses a number that a format cannot carry.";

/// Show the sizes of a step's numbers, and their errors in 16-bit formats.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FormatsArgs {
    /// Take the step from this folder of .npy arrays instead of a scene.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "BuildArgs", "step"])]
    input: Option<PathBuf>,
    /// Step of the scene whose numbers are measured; the steps before it are taken first.
    #[arg(long, value_name = "N", default_value_t = 70, value_parser = clap::value_parser!(u32).range(1..))]
    step: u32,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    build: BuildArgs,
}

impl FormatsArgs {
    /// Whether it takes steps before the one that it measures.
    pub(crate) const fn takes_steps(&self) -> bool {
        self.input.is_none()
    }
}

/// The input of a step.
struct Step {
    bodies: Vec<Body>,
    shapes: Vec<Shape>,
    collisions: Vec<Collision>,
}

/// Shows the numbers.
pub(crate) fn run(
    args: &FormatsArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let Step { bodies, shapes, collisions } = match &args.input {
        Some(path) => {
            let Folder { bodies, shapes, collisions, .. } = step_input::load(path)?;
            Step { bodies, shapes, collisions }
        }
        None => match stepped(args, common)? {
            Some(found) => found,
            None => return Ok(Verdict::Interrupted),
        },
    };
    let kinds = numbers(&bodies, &shapes, &collisions);
    if common.json {
        let config = match &args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => {
                let mut config = args.scene.to_json();
                config["step"] = args.step.into();
                config
            }
        };
        let document = json!({
            "schema": SCHEMA,
            "verb": "formats",
            "config": config,
            "bodies": bodies.len(),
            "collisions": collisions.len(),
            "as_streamed": described(AS_STREAMED.of(&kinds)),
            "each_once": described(EACH_ONCE.of(&kinds)),
            "kinds": kinds
                .iter()
                .map(|kind| {
                    let mut value = described(kind.values.iter());
                    value["name"] = kind.name.into();
                    value["in_sums"] = SUMS
                        .iter()
                        .filter(|sum| (sum.has)(kind.part))
                        .map(|sum| sum.name)
                        .collect();
                    value
                })
                .collect::<Vec<_>>(),
        });
        writeln!(out, "{document:#}")?;
    } else {
        match &args.input {
            Some(path) => writeln!(out, "input      {}", path.display())?,
            None => writeln!(out, "scene      {}, step {}", args.scene.text(), args.step)?,
        }
        print(&kinds, bodies.len(), collisions.len(), out)?;
    }
    Ok(Verdict::Done)
}

/// The scene before its measured step; none if Ctrl-C ended the run before it.
fn stepped(args: &FormatsArgs, common: &CommonArgs) -> Result<Option<Step>, Failure> {
    let build = args.build.build();
    let mut opened = board::open_as(common, &build, args.scene.config(&build))?.stated();
    args.scene.check_size(opened.accelerator.capabilities())?;
    let mut scene = args.scene.build(&build)?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    let parameters = args.deadline.apply(StepParameters::default());
    let interrupt = Interrupt::install();
    opened.accelerator.set_cancellation(interrupt.cancellation());
    let progress = progress_bar(args.step);
    let before = args.step.saturating_sub(1);
    let taken = pile::step_to(&mut scene, &mut opened, &parameters, before, || {
        progress.inc(1);
        !interrupt.is_set()
    });
    progress.finish_and_clear();
    Ok(taken?.then(|| Step {
        bodies: scene.bodies().to_vec(),
        shapes: scene.shapes().to_vec(),
        collisions: scene.collisions().to_vec(),
    }))
}

fn described<'a>(values: impl Iterator<Item = &'a f32> + Clone) -> Value {
    let mut value = Sizes::of(values.clone()).to_json();
    for format in NarrowFormat::ALL {
        value["formats"][format.name()] = Loss::of(format, values.clone()).to_json();
    }
    value
}

const COLUMNS: [Column; 14] = [
    Column { name: "", unit: "", width: 20 },
    Column { name: "numbers", unit: "", width: 10 },
    Column { name: "smallest", unit: "not 0", width: 9 },
    Column { name: "largest", unit: "", width: 9 },
    Column { name: "< 3e-5", unit: "%", width: 8 },
    Column { name: "binary16", unit: "mean %", width: 9 },
    Column { name: "binary16", unit: "% < 1 %", width: 8 },
    Column { name: "binary16", unit: "most", width: 9 },
    Column { name: "thesis16", unit: "mean %", width: 9 },
    Column { name: "thesis16", unit: "% < 1 %", width: 8 },
    Column { name: "thesis16", unit: "most", width: 9 },
    Column { name: "literal", unit: "mean %", width: 9 },
    Column { name: "literal", unit: "% < 1 %", width: 8 },
    Column { name: "literal", unit: "most", width: 9 },
];

fn print(
    kinds: &[Numbers],
    bodies: usize,
    collisions: usize,
    out: &mut dyn Write,
) -> io::Result<()> {
    let (bodies, collisions) = (grouped(bodies as u64), grouped(collisions as u64));
    writeln!(out, "step       {bodies} bodies, {collisions} collisions")?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    for kind in kinds {
        line(out, &COLUMNS, cells(kind.name, kind.values.iter()))?;
    }
    for sum in SUMS {
        line(out, &COLUMNS, cells(sum.name, sum.of(kinds)))?;
    }

    let streamed = || AS_STREAMED.of(kinds);
    let sizes = Sizes::of(streamed());
    writeln!(out)?;
    writeln!(out, "{} by size", AS_STREAMED.name)?;
    let percent = |part: u64| 100.0 * part as f64 / sizes.numbers.max(1) as f64;
    writeln!(out, "  {:<14} {:>11} {:>9.4} %", "0", grouped(sizes.zeros), percent(sizes.zeros))?;
    for (exponent, &count) in &sizes.decades {
        let range = format!("1e{exponent} .. 1e{}", exponent + 1);
        writeln!(out, "  {range:<14} {:>11} {:>9.4} %", grouped(count), percent(count))?;
    }
    for format in NarrowFormat::ALL {
        let refused = Loss::of(format, streamed()).refused;
        if refused > 0 {
            let name = format.name();
            writeln!(out, "{} of them are out of range for {name}", grouped(refused))?;
        }
    }
    Ok(())
}

fn cells<'a>(name: &str, values: impl Iterator<Item = &'a f32> + Clone) -> Vec<String> {
    let sizes = Sizes::of(values.clone());
    let size = |size: Option<f32>| size.map_or_else(|| "-".to_owned(), |size| number(size.into()));
    let mut cells = vec![
        format!("{name:<20}"),
        grouped(sizes.numbers),
        size(sizes.smallest),
        size(sizes.largest),
        number(sizes.small_share() * 100.0),
    ];
    for format in NarrowFormat::ALL {
        let loss = Loss::of(format, values.clone());
        cells.push(number(loss.mean() * 100.0));
        cells.push(number(loss.under_share() * 100.0));
        cells.push(number(loss.largest_absolute));
    }
    cells
}
