//! Thesis §4.6: the scene in sixteen bits beside float, after one step and after many.

mod figures;
mod splits;

use std::fmt;
use std::str::FromStr;

use clap::Args;
use zynq_pgs::emulation::{Build, BuildError};
use zynq_pgs::order::Order;

use self::figures::Shown;
use super::course::{Side, Solver, Steps, take};
use super::recorded::HALF_AGAINST_FLOAT;
use super::start::{Start, StartArgs};
use crate::deviation::Deviations;
use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::formats::{EACH_ONCE, numbers};
use crate::narrow::NarrowFormat;
use crate::session::Session;
use pgs_command::failure::{Failure, Result};

const EXAMPLES: &str = "\
Examples:
  pgs thesis half --input tests/golden/pile5_step60
  pgs thesis half --drop 5 --steps 240
  pgs thesis half --grid 10x10x10 --build half --build half,f32 --json

The boards start from one state. float is the original; every other build takes the same steps by
itself, with the collisions as given, and is compared with float as eq. 4.1 of the thesis does.
Builds are written as for `pgs thesis compare`: half has binary16 throughout. half,thesis16 has the
thesis' own sixteen bits in its words, and half,thesis16-literal its encoder taken literally: no
board has these, the reference solver computes them. Unmoved is the share of position components
whose bits, as sent to the board, a step did not change. Energies are kinetic.

The last table has the errors of each form on the numbers that the step after the last one of float
gives the board, or on the folder's.";

/// The experiment.
pub(crate) static HALF: Experiment = Experiment::of::<Options>(
    "half",
    "§4.6, Figure 4.10",
    Boards::Own,
    "Sixteen bits beside float",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    #[command(flatten)]
    pub(crate) start: StartArgs,
    /// A build to step beside float; can be given several times
    #[arg(long = "build", value_name = "BUILD", default_values = DEFAULTS)]
    pub(crate) builds: Vec<SixteenBits>,
}

/// Numbers to step beside float: of a board, or of half with the words of the thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SixteenBits {
    /// A board of this build.
    Board(Build),
    /// The reference solver in binary16, behind words of this format.
    Words(NarrowFormat),
}

impl FromStr for SixteenBits {
    type Err = BuildError;

    fn from_str(text: &str) -> Result<Self, BuildError> {
        let words = NarrowFormat::ALL.into_iter().find(|format| text == of_words(*format));
        words.map_or_else(|| text.parse().map(Self::Board), |format| Ok(Self::Words(format)))
    }
}

impl fmt::Display for SixteenBits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board(build) => build.fmt(f),
            Self::Words(format) => f.write_str(&of_words(*format)),
        }
    }
}

/// The name of half with words of this format.
fn of_words(format: NarrowFormat) -> String {
    format!("half,{}", format.name())
}

/// The builds beside float, unless others are given.
const DEFAULTS: [&str; 3] = ["half", "half,thesis16", "half,thesis16-literal"];

/// The build that the others are compared with.
const ORIGINAL: &str = "float";

/// Measures of a step that are shown.
const MEASURES: [&str; 7] = [
    "kinetic_kj",
    "energy_ratio",
    "unmoved_percent",
    "position_mean_percent",
    "position_under_1_percent",
    "position_mean_mm",
    "linear_within_1_percent",
];

impl Measure for Options {
    /// Steps all boards and compares them with float.
    fn measure(&self, session: &Session) -> Result<Part> {
        let common = session.emulated();
        let mut start = Start::load(&self.start)?;
        let open = |start: &Start<'_>, build: &Build| {
            start.open(self.start.scene.config(build), &common, session)
        };
        let original: Build = ORIGINAL.parse().map_err(Failure::input)?;
        let mut boards = vec![open(&start, &original)?];
        let begun = start.step_to(&mut boards[0], session)?;
        let parameters = start.parameters.with_order(Some(Order::AsGiven));
        let side = |name: String, solver| Side::new(name, &start, solver, None, parameters);
        let mut sides = vec![side(ORIGINAL.to_owned(), Solver::Board(0))];
        for build in &self.builds {
            let about = |failure: Failure| failure.about(format!("board {build}"));
            let solver = match build {
                SixteenBits::Board(build) => {
                    boards.push(open(&start, build).map_err(about)?);
                    Solver::Board(boards.len() - 1)
                }
                SixteenBits::Words(format) => Solver::Words(*format),
            };
            sides.push(side(build.to_string(), solver));
        }
        let complete = begun && take(&mut sides, 0, &mut boards, &start, session)?;
        session.end();

        let mut steps = Steps::new("Sixteen bits beside float, step by step", &MEASURES);
        steps.rows(&start, &sides);
        // A folder's collisions belong to the state before the step.
        let world = if self.start.input.is_some() { &start.world } else { &sides[0].world };
        let kinds = numbers(world.bodies(), world.shapes(), world.collisions());
        let splits = splits::of(&EACH_ONCE.of(&kinds).copied().collect::<Vec<_>>());
        let mut part = Part::of(vec![steps.table]);
        part.complete = complete;
        part.fact("start", start.text());
        for side in &sides {
            if let Some((step, failure)) = &side.failed {
                part.fact("failed", format!("{} in step {step}: {}", side.name, failure.chain()));
            }
        }
        part.fact("recorded", HALF_AGAINST_FLOAT.text());
        let positions = |side: &Side| side.deviations(&sides[0], |body| body.pose.position);
        let whole = sides[1..].iter().filter(|side| complete && side.failed.is_none());
        let positions: Vec<(&str, Deviations)> =
            whole.map(|side| (side.name.as_str(), positions(side))).collect();
        let rows: Vec<_> = positions.iter().map(|(name, of)| (*name, of)).collect();
        part.tables.extend([Deviations::table(&rows), splits::table(&splits)]);
        let shown = Shown { subject: start.subject(), sides: &sides };
        match start.steps {
            1 => shown.add_positions(&mut part, &positions, &splits),
            _ => shown.add_energies(&mut part),
        }
        Ok(part)
    }
}
