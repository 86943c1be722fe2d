//! Measures the sizes of a step's numbers, and their errors in 16-bit formats.

mod figures;
mod numbers;
mod tally;

use std::path::PathBuf;

use clap::Args;
use pgs_command::board;
use pgs_command::failure::Result;
use pgs_command::numbers::grouped;
use pgs_command::options::scenes::SceneArgs;
use pgs_command::options::solver::DeadlineArgs;
use serde_json::json;
use zynq_pgs::StepParameters;

use self::numbers::{AS_STREAMED, Numbers, SUMS};
pub(crate) use self::numbers::{EACH_ONCE, numbers};
pub(crate) use self::tally::{Loss, Sizes};
use crate::experiment::{Boards, Experiment, Part, given, shown};
use crate::narrow::NarrowFormat;
use crate::session::Session;
use crate::study::given::GivenStep;
use crate::table::{Cell, Table, text};

const EXAMPLES: &str = "\
Examples:
  pgs thesis formats --input tests/golden/pile5_step60
  pgs thesis formats --grid 10x10x10 --step 70 --json

The numbers are the ones that a step streams to the board, without unused contact points, indices
and counts. The sum \"as streamed\" has the positions of both bodies with every collision, the sum
\"each once\" has the position of each body once. Relative numbers have the position of body A
subtracted; a static body counts as being at the other body's
position. Neither sum includes the relative numbers.

Relative errors are |read back - number| / |number|. A zero has no relative error, and does not
count as below 3e-5. The driver refuses a number that a format cannot carry.";

/// The experiment.
pub(crate) static FORMATS: Experiment = Experiment {
    id: "formats",
    thesis: "§4.6.2, Figures 4.5 to 4.8",
    about: "The sizes of a step's numbers, and their errors in 16-bit formats",
    boards: Boards::Any,
    arguments: FormatsArgs::augment_args,
    run: |args, session| measure(&given(args)?, session),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FormatsArgs {
    /// Take the step from this folder of .npy arrays instead of a scene.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "step"])]
    input: Option<PathBuf>,
    /// Step of the scene whose numbers are measured; the steps before it are taken first.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 70,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    step: u32,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
}

/// Measures the numbers.
fn measure(args: &FormatsArgs, session: &Session) -> Result<Part> {
    let step = match &args.input {
        Some(path) => Some(GivenStep::folder(path)?),
        None => stepped(args, session)?,
    };
    let Some(GivenStep { bodies, shapes, collisions, .. }) = step else {
        return Ok(Part::interrupted());
    };
    let kinds = numbers(&bodies, &shapes, &collisions);
    let mut part = Part::of(vec![of_kinds(&kinds), by_size(&kinds)]);
    match &args.input {
        Some(path) => part.fact("input", path.display().to_string()),
        None => part.fact("scene", format!("{}, step {}", args.scene.text(), args.step)),
    }
    let named = match &args.input {
        Some(path) => format!("the step in {}", shown(path)),
        None => format!("step {} of our pile of {}", args.step, args.scene.text()),
    };
    figures::add(&mut part, &kinds, &named);
    let counts = [bodies.len(), collisions.len()].map(|count| grouped(count as u64));
    part.fact("step", format!("{} bodies, {} collisions", counts[0], counts[1]));
    let config = match &args.input {
        Some(path) => json!({ "input": path.display().to_string() }),
        None => {
            let mut config = args.scene.to_json();
            config["step"] = args.step.into();
            config
        }
    };
    part.data = json!({
        "config": config,
        "bodies": bodies.len(),
        "collisions": collisions.len(),
    });
    Ok(part)
}

/// The scene before its measured step; none if Ctrl-C ended the run before it.
fn stepped(args: &FormatsArgs, session: &Session) -> Result<Option<GivenStep>> {
    let build = session.common.build();
    let mut opened = board::open(&session.common, args.scene.config(&build))?.stated();
    args.scene.check_size(opened.accelerator.capabilities())?;
    let scene = args.scene.build(&build)?;
    let parameters = args.deadline.apply(StepParameters::thesis());
    let before = args.step.saturating_sub(1);
    let step = GivenStep::after(before, scene, &mut opened, parameters, session);
    session.end();
    step
}

/// The numbers of each kind and of each sum.
fn of_kinds(kinds: &[Numbers]) -> Table {
    let mut table = Table::with_columns(
        "numbers",
        "The numbers of a step, and their errors in 16 bits",
        &[
            ("kind", ""),
            ("numbers", "numbers"),
            ("zeros", "zeros"),
            ("smallest", "smallest\nnot 0"),
            ("largest", "largest"),
            ("small_percent", "< 3e-5\n%"),
            ("binary16_mean_percent", "binary16\nmean %"),
            ("binary16_under_1_percent", "binary16\n% < 1 %"),
            ("binary16_most", "binary16\nmost"),
            ("binary16_refused", "binary16\nrefused"),
            ("thesis16_mean_percent", "thesis16\nmean %"),
            ("thesis16_under_1_percent", "thesis16\n% < 1 %"),
            ("thesis16_most", "thesis16\nmost"),
            ("thesis16_refused", "thesis16\nrefused"),
            ("literal_mean_percent", "literal\nmean %"),
            ("literal_under_1_percent", "literal\n% < 1 %"),
            ("literal_most", "literal\nmost"),
            ("literal_refused", "literal\nrefused"),
        ],
    );
    for kind in kinds {
        table.row(cells(kind.name, kind.values.iter()));
    }
    for sum in SUMS {
        table.row(cells(sum.name, sum.of(kinds)));
    }
    table
}

fn cells<'a>(name: &str, values: impl Iterator<Item = &'a f32> + Clone) -> Vec<Cell> {
    let sizes = Sizes::of(values.clone());
    let size = |size: Option<f32>| Cell::known(size, |size| Cell::Digits(size.into()));
    let mut cells = vec![
        text(name),
        Cell::Whole(sizes.numbers),
        Cell::Whole(sizes.zeros),
        size(sizes.smallest),
        size(sizes.largest),
        Cell::Digits(sizes.small_share() * 100.0),
    ];
    for format in NarrowFormat::ALL {
        let loss = Loss::of(format, values.clone());
        cells.push(Cell::Digits(loss.mean() * 100.0));
        cells.push(Cell::Digits(loss.under_share() * 100.0));
        cells.push(Cell::Digits(loss.largest_absolute));
        cells.push(Cell::Whole(loss.refused));
    }
    cells
}

/// The numbers as streamed, by powers of ten.
fn by_size(kinds: &[Numbers]) -> Table {
    let columns = [("from", "from"), ("numbers", "numbers"), ("percent", "%")];
    let mut table = Table::with_columns("sizes", format!("{} by size", AS_STREAMED.name), &columns);
    let sizes = Sizes::of(AS_STREAMED.of(kinds));
    let percent = |part: u64| 100.0 * part as f64 / sizes.numbers.max(1) as f64;
    let zeros = std::iter::once(("0".to_owned(), sizes.zeros));
    let each = sizes.decades.iter().map(|(exponent, count)| (format!("1e{exponent}"), *count));
    for (from, count) in zeros.chain(each) {
        table.row([text(from), Cell::Whole(count), Cell::Number(percent(count), 4)]);
    }
    table
}
