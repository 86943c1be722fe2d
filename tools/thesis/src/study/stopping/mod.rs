//! The study `stopping`: what each rule by which the thesis ends an iterative solver (§2.2.3) costs
//! in passes, and what a fixed number of passes leaves.
//!
//! The board takes the same step with 0, 1, 2 ... passes; the impulses and velocities that it gives
//! out are judged on the host ([`residual`]). No other solver runs.

mod passes;
pub(crate) mod residual;
mod show;

use std::path::PathBuf;

use clap::Args;
use scene::Grid;
use serde::Serialize;
use zynq_pgs::StepParameters;
use zynq_pgs::emulation::Build;
use zynq_pgs::order::Order;

use self::passes::Course;
pub(crate) use self::passes::Pass;
use self::residual::Problem;
use crate::experiment::{Boards, Experiment, Part, given};
use crate::session::Session;
use crate::study::given::GivenStep;
use pgs_command::board;
use pgs_command::failure::Result;
use pgs_command::options::scenes;
use pgs_command::options::solver::SolverArgs;
use pgs_command::pile;
use pgs_command::step_input;

const EXAMPLES: &str = "\
Examples:
  pgs thesis stopping
  pgs thesis stopping --input tests/golden/pile5_step60 --passes 60
  pgs thesis stopping --grid 10x10x10 --steps 90 --spin-damping 0 --json

The residual is a speed in m/s: over all contacts min(L / m, e + b), with L the impulse, m the
effective mass and e + b the speed along the normal with its bias; over all tangents what one more
pass would change, by the effective mass. It is computed in 64 bits, the passes in the board's 32.

Rules (thesis 2.2.3): a fixed number of passes; the residual (root mean square) falls below a
tolerance; the largest change of an impulse in a pass falls below a tolerance; each change falls
below a share of the impulse before the pass. Tolerances of the first two are relative: to the
residual before the first pass, and to the change of the first pass. Friction passes follow the
step's own contact passes. The damping of spin is no part of the problem; with it the friction
passes leave a residual that they never remove: --spin-damping 0 takes it out.";

/// Tolerances.
const TOLERANCES: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// The experiment.
pub(crate) static STOPPING: Experiment = Experiment {
    id: "stopping",
    thesis: "§2.2.3",
    about: "One step with 0, 1, 2 ... passes, and what is left to solve",
    boards: Boards::Any,
    arguments: Options::augment_args,
    run: |args, session| {
        Ok(measure(&given(args)?, session)?
            .map_or_else(Part::interrupted, |outcome| outcome.part()))
    },
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Take the step in this folder of .npy arrays instead of a pile's.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "drop", "steps"])]
    pub(crate) input: Option<PathBuf>,
    /// Cubes of the pile along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value = "6x6x6")]
    pub(crate) grid: Grid,
    /// Height of the lowest cubes above the ground at the start, m.
    #[arg(long, value_name = "H", default_value_t = 0.5)]
    pub(crate) drop: f32,
    /// Steps that the pile takes before the measured step.
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub(crate) steps: u32,
    /// Most passes of each kind.
    #[arg(
        long,
        value_name = "K",
        default_value_t = 64,
        value_parser = clap::value_parser!(u32).range(2..=255)
    )]
    pub(crate) passes: u32,
    #[command(flatten)]
    pub(crate) solver: SolverArgs,
}

/// The residuals after each number of passes, and the passes of each rule.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome {
    pub(crate) complete: bool,
    pub(crate) step: String,
    pub(crate) bodies: usize,
    pub(crate) collisions: usize,
    /// The step's own passes, between which and the friction passes the contact passes end.
    pub(crate) contact_iterations: u32,
    pub(crate) friction_iterations: u32,
    pub(crate) spin_damping: f32,
    /// After 0, 1, 2 ... contact passes without friction passes.
    pub(crate) contact: Vec<Pass>,
    /// After the step's own contact passes and 0, 1, 2 ... friction passes.
    pub(crate) friction: Vec<Pass>,
    /// The state after the step's own passes.
    pub(crate) fixed: Option<Pass>,
    pub(crate) tolerances: Vec<Tolerance>,
}

/// Passes until a tolerance; none if the measured passes are too few.
#[derive(Debug, Serialize)]
pub(crate) struct Tolerance {
    pub(crate) tolerance: f64,
    pub(crate) contact: Rules,
    pub(crate) friction: Rules,
}

/// Passes by each rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Rules {
    pub(crate) residual: Option<u32>,
    pub(crate) largest_change: Option<u32>,
    pub(crate) each_change: Option<u32>,
}

/// Takes the step with each number of passes.
fn measure(options: &Options, session: &Session) -> Result<Option<Outcome>> {
    let mut opened = board::open(&session.common, &Build::default())?.stated();
    let (name, step) = match &options.input {
        Some(path) => (path.display().to_string(), Some(GivenStep::folder(path)?)),
        None => {
            let Options { grid, drop, steps, .. } = *options;
            scenes::check_size(grid, opened.accelerator.capabilities())?;
            let (scene, parameters) = (pile::build(grid, drop)?, StepParameters::default());
            let parameters = options.solver.apply(parameters);
            let step = GivenStep::after(steps, scene, &mut opened, parameters, session)?;
            (format!("step {} of {grid} cubes dropped from {drop} m", steps + 1), step)
        }
    };
    let Some(mut step) = step else { return Ok(None) };
    session.watch(&mut opened);
    step.parameters = options.solver.apply(step.parameters);
    step_input::set_shapes(&mut opened.accelerator, &step.shapes)
        .map_err(|error| step_input::failure(step.folder.as_ref(), &opened, error))?;
    let problem = Problem::new(&step.bodies, &step.shapes, &step.collisions, &step.parameters);
    let StepParameters { contact_iterations, friction_iterations, .. } = step.parameters;
    session.expect(2 * u64::from(options.passes) + 2);
    let mut course = Course { opened: &mut opened, session, step: &step, problem: &problem };
    let (contact, all_contact) = course.take(options.passes, |passes| [passes, 0])?;
    let (friction, all_friction) = match all_contact {
        true => course.take(options.passes, |passes| [contact_iterations, passes])?,
        false => (Vec::new(), false),
    };
    let fixed = match all_friction {
        true => course.once([contact_iterations, friction_iterations])?,
        false => None,
    };
    session.end();
    let tolerances = TOLERANCES.map(|tolerance| Tolerance {
        tolerance,
        contact: Rules::of(&contact, tolerance, |pass| pass.residuals.contact.rms),
        friction: Rules::of(&friction, tolerance, |pass| pass.residuals.friction.rms),
    });
    Ok(Some(Outcome {
        complete: fixed.is_some(),
        step: name,
        bodies: step.bodies.len(),
        collisions: step.collisions.len(),
        contact_iterations,
        friction_iterations,
        spin_damping: step.parameters.spin_damping,
        contact,
        friction,
        fixed,
        tolerances: tolerances.into(),
    }))
}

impl Rules {
    /// The passes after which each rule holds for the first time.
    fn of(passes: &[Pass], tolerance: f64, residual: impl Fn(&Pass) -> f64) -> Self {
        let first = |holds: &dyn Fn(&Pass) -> bool| {
            passes.iter().find(|pass| holds(pass)).map(|pass| pass.passes)
        };
        let start = passes.first().map_or(0.0, &residual);
        let change = passes.iter().find_map(|pass| pass.largest_change_n_s).unwrap_or(0.0);
        let below = |value: Option<f64>, limit: f64| value.is_some_and(|value| value <= limit);
        Self {
            residual: first(&|pass| residual(pass) <= tolerance * start),
            largest_change: first(&|pass| below(pass.largest_change_n_s, tolerance * change)),
            each_change: first(&|pass| below(pass.largest_share, tolerance)),
        }
    }
}

/// The order in which every number of passes solves the collisions: one, so that each pass goes on
/// from the one before.
const ORDER: Order = Order::AsGiven;
