//! The state in which the runs of an experiment start: a folder's, or a scene's after some steps.

use std::path::PathBuf;
use std::sync::Arc;

use bitstream_model::BoardConfig;
use clap::Args;
use zynq_pgs::emulation::Build;
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use crate::experiment::shown;
use crate::permutation;
use crate::session::Session;
use pgs_command::board::{self, OpenBoard};
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Failure, Result};
use pgs_command::options::scenes::SceneArgs;
use pgs_command::options::solver::{DeadlineArgs, SolverArgs};
use pgs_command::pile;
use pgs_command::step_input;
use scene::Scene;
use step_folder::folder::Folder;

/// The start of the runs, and the number of their steps.
#[derive(Debug, Clone, Args)]
pub(crate) struct StartArgs {
    /// Take one step from this folder of .npy arrays instead of a scene.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "steps", "every", "from"])]
    pub(crate) input: Option<PathBuf>,
    /// Steps of each run [default: 120, one from a folder]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: Option<u32>,
    /// Show every N-th step [default: a tenth of the steps]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Steps that the scene takes on the first board before all runs start from one state.
    #[arg(long, value_name = "N", default_value_t = 0)]
    from: u32,
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    solver: SolverArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
}

/// Steps of a run from a scene.
const STEPS: u32 = 120;
/// Shown steps, about.
const ROWS: u32 = 10;

/// The bodies and collisions of a run.
#[derive(Debug, Clone)]
pub(crate) enum World {
    /// A scene, whose collisions are detected.
    Scene(Box<Scene>),
    /// One step from a folder, without the shapes' geometry.
    Folder { folder: Arc<Folder>, bodies: Vec<Body> },
}

impl World {
    pub(crate) fn bodies(&self) -> &[Body] {
        match self {
            Self::Scene(scene) => scene.bodies(),
            Self::Folder { bodies, .. } => bodies,
        }
    }

    pub(crate) fn shapes(&self) -> &[Shape] {
        match self {
            Self::Scene(scene) => scene.shapes(),
            Self::Folder { folder, .. } => &folder.shapes,
        }
    }

    /// The collisions that were detected last; a folder's are the same at any time.
    pub(crate) fn collisions(&self) -> &[Collision] {
        match self {
            Self::Scene(scene) => scene.collisions(),
            Self::Folder { folder, .. } => &folder.collisions,
        }
    }

    /// Bodies to step, and the collisions that were detected last.
    pub(crate) fn parts_mut(&mut self) -> (&mut [Body], &[Collision]) {
        match self {
            Self::Scene(scene) => scene.parts_mut(),
            Self::Folder { folder, bodies } => (bodies, &folder.collisions),
        }
    }

    /// Makes a failure of the driver's error; for a folder, with the array at fault.
    pub(crate) fn failure(&self, opened: &OpenBoard, error: zynq_pgs::Error) -> Failure {
        let folder = match self {
            Self::Scene(_) => None,
            Self::Folder { folder, .. } => Some(&**folder),
        };
        step_input::failure(folder, opened, error)
    }
}

/// The state in which all runs start.
#[derive(Debug)]
pub(crate) struct Start<'a> {
    args: &'a StartArgs,
    pub(crate) world: World,
    /// The order of Bullet's GPU, if the folder has it.
    pub(crate) recorded_order: Option<Vec<u32>>,
    pub(crate) parameters: StepParameters,
    pub(crate) steps: u32,
}

impl<'a> Start<'a> {
    /// Loads the folder or builds the scene; the scene stands at its beginning.
    pub(crate) fn load(args: &'a StartArgs) -> Result<Self> {
        let (world, recorded_order, own, steps) = match &args.input {
            Some(path) => {
                let folder = step_input::load(path)?;
                let recorded = permutation::recorded(&folder.path, folder.collisions.len())?;
                let (own, bodies) = (folder.parameters, folder.bodies.clone());
                (World::Folder { folder: Arc::new(folder), bodies }, recorded, own, 1)
            }
            None => {
                let scene = Box::new(args.scene.build(&Build::default())?);
                let steps = args.steps.unwrap_or(STEPS);
                (World::Scene(scene), None, StepParameters::thesis(), steps)
            }
        };
        let parameters = args.deadline.apply(args.solver.apply(own));
        Ok(Self { args, world, recorded_order, parameters, steps })
    }

    /// Opens a board with the shapes of the start.
    pub(crate) fn open(
        &self,
        config: BoardConfig,
        common: &CommonArgs,
        session: &Session,
    ) -> Result<OpenBoard> {
        let mut opened = board::open(common, config)?.stated();
        match &self.world {
            World::Folder { folder, .. } => {
                let most = opened.accelerator.capabilities().shapes_max();
                folder.check_shapes(most).map_err(Failure::input)?;
            }
            World::Scene(_) => self.args.scene.check_size(opened.accelerator.capabilities())?,
        }
        step_input::set_shapes(&mut opened.accelerator, self.world.shapes())
            .map_err(|error| self.world.failure(&opened, error))?;
        session.watch(&mut opened);
        Ok(opened)
    }

    /// Takes the steps before the start on the board; false if Ctrl-C ended them.
    pub(crate) fn step_to(&mut self, opened: &mut OpenBoard, session: &Session) -> Result<bool> {
        let from = self.args.from;
        let World::Scene(scene) = &mut self.world else { return Ok(true) };
        session.expect(from.into());
        pile::step_to(scene, opened, &self.parameters, from, || {
            session.advance();
            !session.is_interrupted()
        })
    }

    /// The steps that a table shows: the start, the first, the last, and some between.
    pub(crate) fn shown(&self) -> impl Iterator<Item = u32> {
        let every = self.args.every.unwrap_or(self.steps.div_ceil(ROWS));
        let last = self.steps;
        (0..=last).filter(move |step| *step <= 1 || step % every == 0 || *step == last)
    }

    /// The start for people.
    pub(crate) fn text(&self) -> String {
        let (steps, from) = (self.steps, self.args.from);
        match &self.args.input {
            Some(path) => format!("{}, one step", path.display()),
            None if from > 0 => {
                format!("{}, {steps} steps after step {from}", self.args.scene.text())
            }
            None => format!("{}, {steps} steps", self.args.scene.text()),
        }
    }

    /// The steps of the runs, for the caption of a figure.
    pub(crate) fn subject(&self) -> String {
        let scene = || self.args.scene.text();
        match (&self.args.input, self.steps) {
            (Some(path), _) => format!("the step in {}", shown(path)),
            (None, 1) => format!("step {} of our pile of {}", self.args.from + 1, scene()),
            (None, steps) => format!("{steps} steps of our pile of {}", scene()),
        }
    }
}
