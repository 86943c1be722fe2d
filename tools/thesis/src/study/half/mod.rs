//! Thesis §4.6: the scene in sixteen bits beside float, after one step and after many.

mod figures;
mod show;
mod splits;
mod words;

use std::fmt;
use std::str::FromStr;

use clap::Args;
use serde::Serialize;
use serde_json::Value;
use zynq_pgs::emulation::{Build, BuildError};

use self::splits::Split;
use super::recorded::{HALF_AGAINST_FLOAT, RecordedDeviation};
use super::run::Run;
use super::start::{Start, StartArgs};
use crate::deviation::{StateDeviation, components, moving, unmoved_share};
use crate::experiment::{Boards, Experiment, given};
use crate::histogram::Histogram;
use crate::narrow::{NarrowFormat, carried};
use crate::session::Session;
use pgs_command::board::OpenBoard;
use pgs_command::common::CommonArgs;
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

The splits are of the sixteen bits of a number into exponent and mantissa (thesis §4.6.4), on the
numbers that the step after the last one of float gives the board, or on the folder's. The highest
exponent is that of the largest number; bits are cut off as in the thesis' format, and numbers below
the range become the smallest one. No board is built with them.";

/// The experiment.
pub(crate) static HALF: Experiment = Experiment {
    id: "half",
    thesis: "§4.6, Figure 4.10",
    about: "Sixteen bits beside float",
    boards: Boards::Own,
    arguments: Options::augment_args,
    run: |args, session| Ok(measure(&given(args)?, session)?.part()),
};

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

/// Numbers to step beside float: those of a board, or half's with the words of the thesis.
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

/// The outcome.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome {
    pub(crate) config: Value,
    /// Whether no Ctrl-C ended the runs.
    pub(crate) complete: bool,
    /// The kinetic energy of float at the start and after each step, J.
    pub(crate) float_kinetic_energy_j: Vec<f64>,
    /// The share of position components that each step of float left as they were.
    pub(crate) float_unmoved_share: Vec<f64>,
    pub(crate) builds: Vec<OfBuild>,
    pub(crate) splits: Vec<Split>,
    pub(crate) recorded: [RecordedDeviation; 1],
    #[serde(skip)]
    start_text: String,
    #[serde(skip)]
    subject: String,
}

/// A build beside float.
#[derive(Debug, Serialize)]
pub(crate) struct OfBuild {
    pub(crate) build: String,
    pub(crate) curve: Vec<Point>,
    /// The positions after its last step, against float's positions.
    pub(crate) position_histogram: Option<Histogram>,
    /// The step that failed on the board, and why.
    pub(crate) failed: Option<Failed>,
}

/// A build and float after a step.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Point {
    pub(crate) step: u32,
    /// Against float.
    #[serde(flatten)]
    pub(crate) state: StateDeviation,
    pub(crate) kinetic_energy_j: f64,
    /// The energy by that of float; none where float rests.
    pub(crate) energy_ratio: Option<f64>,
    pub(crate) unmoved_share: f64,
}

/// A step that failed.
#[derive(Debug, Serialize)]
pub(crate) struct Failed {
    pub(crate) step: u32,
    pub(crate) error: String,
}

/// A board and its run; without a board the reference solver takes the steps.
struct Side<'a> {
    opened: Option<OpenBoard>,
    run: Run<'a>,
    /// The format of poses, if it has sixteen bits.
    poses: Option<NarrowFormat>,
}

impl<'a> Side<'a> {
    fn new(opened: OpenBoard, start: &'a Start<'_>) -> Result<Self> {
        let poses = NarrowFormat::of(opened.accelerator.capabilities().variant.numbers.poses);
        Ok(Self { opened: Some(opened), run: start.run(None)?, poses })
    }

    fn of(
        numbers: &SixteenBits,
        common: &CommonArgs,
        start: &'a Start<'_>,
        session: &Session,
    ) -> Result<Self> {
        match numbers {
            SixteenBits::Board(build) => Self::new(start.open(build, common, session)?, start),
            SixteenBits::Words(format) => {
                Ok(Self { opened: None, run: start.run(None)?, poses: Some(*format) })
            }
        }
    }

    /// Takes a step; the share of position components that it left as they were, none at Ctrl-C.
    fn step(
        &mut self,
        start: &Start<'_>,
        moving: &[bool],
        session: &Session,
    ) -> Result<Option<f64>> {
        let before = self.run.bodies().to_vec();
        let taken = match (&mut self.opened, self.poses) {
            (Some(opened), _) => self.run.step(opened, &start.parameters, session)?,
            (None, Some(format)) => self.run.step_by(session, |bodies, collisions| {
                words::step(format, bodies, start.shapes(), collisions, &start.parameters)
            })?,
            (None, None) => false,
        };
        Ok(taken.then(|| {
            unmoved_share(&before, self.run.bodies(), moving, |value| carried(self.poses, value))
        }))
    }
}

/// Steps all boards and compares them with float.
pub(crate) fn measure(options: &Options, session: &Session) -> Result<Outcome> {
    let common = session.emulated();
    let mut start = Start::load(&options.start)?;
    let original: Build = ORIGINAL.parse().map_err(Failure::input)?;
    let mut opened = start.open(&original, &common, session)?;
    session.expect(u64::from(start.steps) * (options.builds.len() as u64 + 1));
    let mut complete = start.step_to(&mut opened, session)?;

    let start = &start;
    let moving = moving(start.bodies(), start.shapes());
    let mut float = Side::new(opened, start)?;
    let (mut sides, mut builds) = (Vec::new(), Vec::new());
    for build in &options.builds {
        let about = |failure: Failure| failure.about(format!("board {build}"));
        sides.push(Some(Side::of(build, &common, start, session).map_err(about)?));
        let build = build.to_string();
        builds.push(OfBuild { build, curve: Vec::new(), position_histogram: None, failed: None });
    }
    let mut energies = vec![float.run.kinetic_energy()];
    let mut unmoved = Vec::new();
    'steps: for step in 1..=start.steps {
        let Some(share) = float.step(start, &moving, session)? else {
            complete = false;
            break;
        };
        let energy = float.run.kinetic_energy();
        energies.push(energy);
        unmoved.push(share);
        for (place, of_build) in sides.iter_mut().zip(&mut builds) {
            let Some(side) = place else { continue };
            match side.step(start, &moving, session) {
                Ok(Some(share)) => {
                    let kinetic_energy_j = side.run.kinetic_energy();
                    of_build.curve.push(Point {
                        step,
                        state: StateDeviation::of(float.run.bodies(), side.run.bodies(), &moving),
                        kinetic_energy_j,
                        energy_ratio: (energy > 0.0).then(|| kinetic_energy_j / energy),
                        unmoved_share: share,
                    });
                }
                Ok(None) => {
                    complete = false;
                    break 'steps;
                }
                Err(failure) => {
                    of_build.failed = Some(Failed { step, error: failure.chain() });
                    *place = None;
                }
            }
        }
    }
    session.end();
    for (side, of_build) in sides.iter().zip(&mut builds) {
        of_build.position_histogram = side.as_ref().filter(|_| complete).map(|side| {
            let field = |body: &zynq_pgs::Body| body.pose.position;
            Histogram::of(components(float.run.bodies(), side.run.bodies(), &moving, field))
        });
    }
    let mut of_splits = match options.start.input {
        // The folder's collisions belong to the state before the step.
        Some(_) => start.run(None)?,
        None => float.run,
    };
    Ok(Outcome {
        config: start.to_json(),
        complete,
        float_kinetic_energy_j: energies,
        float_unmoved_share: unmoved,
        builds,
        splits: splits::of(&start.numbers(&mut of_splits)),
        recorded: [HALF_AGAINST_FLOAT],
        start_text: start.text(),
        subject: start.subject(),
    })
}
