//! The state in which the runs of a study start: a folder's, or a scene's after some steps.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::emulation::Build;
use zynq_pgs::order::Order;
use zynq_pgs::{Body, Shape, StepParameters};

use super::run::{Run, World};
use crate::experiment::shown;
use crate::formats::{EACH_ONCE, numbers};
use crate::permutation::{self, Permutation};
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
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "steps", "from"])]
    pub(crate) input: Option<PathBuf>,
    /// Steps of each run [default: 120, one from a folder]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: Option<u32>,
    /// Steps in float that the scene takes before the runs start from one state.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) from: u32,
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) solver: SolverArgs,
    #[command(flatten)]
    pub(crate) deadline: DeadlineArgs,
}

/// Steps of a run from a scene.
const STEPS: u32 = 120;

/// The state in which all runs start.
#[derive(Debug)]
pub(super) struct Start<'a> {
    args: &'a StartArgs,
    /// The folder; none for a scene.
    folder: Option<Folder>,
    /// The order of Bullet's GPU, if the folder has it.
    recorded_order: Option<Vec<u32>>,
    /// The scene; none for a folder.
    scene: Option<Scene>,
    bodies: Vec<Body>,
    shapes: Vec<Shape>,
    pub(super) parameters: StepParameters,
    pub(super) steps: u32,
}

impl<'a> Start<'a> {
    /// Loads the folder or builds the scene; the scene stands at its beginning.
    pub(super) fn load(args: &'a StartArgs) -> Result<Self> {
        let folder = args.input.as_deref().map(step_input::load).transpose()?;
        let own = folder.as_ref().map_or_else(StepParameters::default, |folder| folder.parameters);
        let parameters = args.deadline.apply(args.solver.apply(own));
        let parameters = parameters.with_order(Some(Order::AsGiven));
        let (scene, bodies, shapes) = match &folder {
            Some(folder) => (None, folder.bodies.clone(), folder.shapes.clone()),
            None => {
                let scene = args.scene.build(&Build::default())?;
                let (bodies, shapes) = (scene.bodies().to_vec(), scene.shapes().to_vec());
                (Some(scene), bodies, shapes)
            }
        };
        let recorded_order = match &folder {
            Some(folder) => permutation::recorded(&folder.path, folder.collisions.len())?,
            None => None,
        };
        let steps = if folder.is_some() { 1 } else { args.steps.unwrap_or(STEPS) };
        Ok(Self { args, folder, recorded_order, scene, bodies, shapes, parameters, steps })
    }

    pub(super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    pub(super) fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The numbers that the next step of a run gives the board, each once.
    pub(super) fn numbers(&self, run: &mut Run<'_>) -> Vec<f32> {
        let collisions = run.world.collisions();
        let kinds = numbers(run.bodies(), &self.shapes, &collisions);
        EACH_ONCE.of(&kinds).copied().collect()
    }

    /// Whether the order of Bullet's GPU is recorded.
    pub(super) fn has_recorded_order(&self) -> bool {
        self.recorded_order.is_some()
    }

    /// Opens a board of this build with the shapes of the start.
    pub(super) fn open(
        &self,
        build: &Build,
        common: &CommonArgs,
        session: &Session,
    ) -> Result<OpenBoard> {
        let config = self.args.scene.config(build);
        let mut opened = board::open_as(common, build, config)?.stated();
        match &self.folder {
            Some(folder) => {
                let most = opened.accelerator.capabilities().shapes_max();
                folder.check_shapes(most).map_err(Failure::input)?;
            }
            None => self.args.scene.check_size(opened.accelerator.capabilities())?,
        }
        step_input::set_shapes(&mut opened.accelerator, &self.shapes)
            .map_err(|error| self.failure(&opened, error))?;
        session.watch(&mut opened);
        Ok(opened)
    }

    /// A run from here, in an order; as given if none.
    pub(super) fn run(&self, permutation: Option<Permutation>) -> Result<Run<'_>> {
        let world = match (&self.folder, &self.scene) {
            (Some(folder), _) => World::Folder { folder, bodies: self.bodies.clone() },
            (None, Some(scene)) => World::Scene(Box::new(scene.clone())),
            (None, None) => World::Scene(Box::new(self.args.scene.build(&Build::default())?)),
        };
        Ok(Run::new(world, permutation, self.recorded_order.clone()))
    }

    /// Takes the steps before the start on the board; false if Ctrl-C ended them.
    pub(super) fn step_to(&mut self, opened: &mut OpenBoard, session: &Session) -> Result<bool> {
        let Some(scene) = self.scene.as_mut().filter(|_| self.args.from > 0) else {
            return Ok(true);
        };
        session.expect(self.args.from.into());
        let taken = pile::step_to(scene, opened, &self.parameters, self.args.from, || {
            session.advance();
            !session.is_interrupted()
        })?;
        if taken {
            self.bodies = scene.bodies().to_vec();
        }
        Ok(taken)
    }

    /// Makes a failure of the driver's error; for a folder, with the array at fault.
    pub(super) fn failure(&self, opened: &OpenBoard, error: zynq_pgs::Error) -> Failure {
        step_input::failure(self.folder.as_ref(), opened, error)
    }

    /// The start for people.
    pub(super) fn text(&self) -> String {
        match &self.args.input {
            Some(path) => format!("{}, one step", path.display()),
            None if self.args.from > 0 => {
                format!(
                    "{}, {} steps after step {}",
                    self.args.scene.text(),
                    self.steps,
                    self.args.from
                )
            }
            None => format!("{}, {} steps", self.args.scene.text(), self.steps),
        }
    }

    /// The steps of the runs, for the caption of a figure.
    pub(super) fn subject(&self) -> String {
        match (&self.args.input, self.args.from, self.steps) {
            (Some(path), ..) => format!("the step in {}", shown(path)),
            (None, from, 1) => {
                format!("step {} of our pile of {}", from + 1, self.args.scene.text())
            }
            _ => format!("{} steps of our pile of {}", self.steps, self.args.scene.text()),
        }
    }

    /// The start for programs.
    pub(super) fn to_json(&self) -> Value {
        let mut config = match &self.args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => self.args.scene.to_json(),
        };
        config["steps"] = self.steps.into();
        config["from"] = self.args.from.into();
        config["contact_iterations"] = self.parameters.contact_iterations.into();
        config["friction_iterations"] = self.parameters.friction_iterations.into();
        config["time_step_s"] = self.parameters.time_step.into();
        config["spin_damping"] = self.parameters.spin_damping.into();
        config
    }
}
