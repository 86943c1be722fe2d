//! Steps two boards from the same start, independently, and measures how far
//! they diverge.

mod show;
mod side;
mod spec;

use std::path::PathBuf;

use clap::Args;
use pgs_command::board::OpenBoard;
use pgs_command::common::{AcceleratorChoice, CommonArgs};
use pgs_command::failure::{Failure, Result};
use pgs_command::options::scenes::SceneArgs;
use pgs_command::options::solver::{DeadlineArgs, SolverArgs};
use pgs_command::step_input;
use pgs_support::Crew;
use serde_json::{Value, json};
use step_folder::folder::Folder;
use zynq_pgs::StepParameters;

use self::side::Side;
use self::spec::SideSpec;
use crate::deviation::{StateDeviation, moving};
use crate::experiment::{Boards, Experiment, Part, given};
use crate::session::Session;
use crate::study::run::World;
use crate::table::Table;

const EXAMPLES: &str = "\
Examples:
  pgs thesis compare float float,unchecked --grid 10x10x10 --steps 200
  pgs thesis compare float,hazard-free float,unchecked,as-given --input tests/golden/pile5_step60
  pgs thesis compare float,gpu float,as-given --input tests/golden/pile5_step60
  pgs thesis compare float half --input tests/golden/pile5_step60
  pgs thesis compare half,f32 half --steps 300 --every 10 --json
  pgs thesis compare float,world float,world,unchecked --scene shapes --grid 8x8x8

Examples with the Verilog in simulation (docs/bitstream.md):
  pgs thesis compare float float --grid 2x2x2 --steps 3 --accelerator \
  rtl:rtl-sim/pgs-rtl

A and B are builds of the emulated board: a profile, and changes of its defaults after commas. A
change is a word: f32, binary16 (arithmetic), interlocked, unchecked, isotropic, world; or \
queue=DEPTH, window=SLOTS,
bandwidth=GBPS, length-width=BITS, address-width=BITS, threads=N and
fast=on|off. The order of a board's collisions is one of auto, as-given, interleaved,
hazard-free, body-by-body, body-by-body-oldest, body-by-body-newest, gpu,
random=SEED (another one in each step). Without an order, a board that waits on hazards takes the
collisions as given, so that two such boards solve them in the same order. Each board detects its
own collisions. `--accelerator` gives board B another accelerator; board A keeps the built-in
model.

Only moving bodies are compared; A is the original. Relative deviations are |B - A| / |A| of each
component (thesis eq. 4.1) and leave out components where A is 0. A velocity is within 1 % if it
differs from A's by at most 1 % of A's; with 0 only 0 agrees. Momenta are shown by their length,
and B-A is the length of the difference; angular momentum is about the origin, potential energy
from y = 0. Unmoved is the share of position components whose bits the step did not change from the
ones sent to the board. Penetration is measured after the step: in a scene over all contacts
detected then; in a folder, which has no geometry, over the step's own contacts, carried along with
their bodies.

If a step fails on one board, this board stops and the other goes on. Exit code 0 if every step was
taken, 1 if one failed.";

/// Default rows of the table.
const ROWS: u32 = 10;

/// The experiment.
pub(crate) static COMPARE: Experiment = Experiment {
    id: "compare",
    thesis: "§4.6.3, equation 4.1",
    about: "Two boards from the same start, and how far they diverge",
    boards: Boards::Own,
    arguments: CompareArgs::augment_args,
    run: |args, session| measure(&given(args)?, session),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Build of the original board.
    #[arg(value_name = "A")]
    a: SideSpec,
    /// Build of the board compared with it.
    #[arg(value_name = "B")]
    b: SideSpec,
    /// Take one step from this folder of .npy arrays instead of a scene.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "steps", "every"])]
    input: Option<PathBuf>,
    /// Steps to take.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 120,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    steps: u32,
    /// Show every N-th step [default: a tenth of the steps]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    #[command(flatten)]
    scene: SceneArgs,
    /// Prove before each step on either board that no moving body recurs within the hazard window;
    /// the board fails otherwise
    #[arg(long)]
    verify: bool,
    #[command(flatten)]
    solver: SolverArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
}

/// A step on both boards.
struct Row {
    /// 0 is the start, before any step.
    step: u32,
    a: Option<side::Measured>,
    b: Option<side::Measured>,
    /// Present if both boards took the step.
    deviation: Option<StateDeviation>,
}

impl Row {
    fn to_json(&self) -> Value {
        let of = |measured: &Option<side::Measured>| measured.as_ref().map(side::Measured::to_json);
        json!({
            "step": self.step,
            "a": of(&self.a),
            "b": of(&self.b),
            "difference": self.difference(),
        })
    }

    /// B minus A.
    fn difference(&self) -> Value {
        let (Some(a), Some(b), Some(state)) = (&self.a, &self.b, &self.deviation) else {
            return Value::Null;
        };
        json!({
            "position": state.position.to_json(),
            "linear_velocity": state.linear.to_json(),
            "angular_velocity": state.angular.to_json(),
            "collisions": b.collisions.cast_signed() - a.collisions.cast_signed(),
            "kinetic_energy_j": b.kinetic.total() - a.kinetic.total(),
            "translational_energy_j": b.kinetic.translational - a.kinetic.translational,
            "rotational_energy_j": b.kinetic.rotational - a.kinetic.rotational,
            "potential_energy_j": b.potential - a.potential,
            "linear_momentum_n_s": vector(b.momentum.linear, a.momentum.linear),
            "angular_momentum_n_m_s": vector(b.momentum.angular, a.momentum.angular),
            "penetration_mean_m": b.penetration.mean - a.penetration.mean,
            "penetration_largest_m": b.penetration.largest - a.penetration.largest,
            "unmoved_share": b.unmoved.zip(a.unmoved).map(|(b, a)| b - a),
        })
    }
}

/// b - a.
fn vector(b: [f64; 3], a: [f64; 3]) -> [f64; 3] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

/// Steps both boards.
fn measure(args: &CompareArgs, session: &Session) -> Result<Part> {
    let common = &session.emulated();
    let folder = args.input.as_deref().map(step_input::load).transpose()?;
    let own = folder.as_ref().map_or_else(StepParameters::default, |folder| folder.parameters);
    let mut parameters = args.deadline.apply(args.solver.apply(own));
    parameters.verify_order |= args.verify;
    let mut sides = open(args, common, folder.as_ref(), parameters.gravity)?;
    let steps = if folder.is_some() { 1 } else { args.steps };
    let course = Course { steps, every: args.every.unwrap_or(steps.div_ceil(ROWS)), parameters };
    let Taken { rows, table, last, done } = course.take(&mut sides, session)?;

    let failed = sides.0.failed.is_some() || sides.1.failed.is_some();
    let mut tables = vec![table];
    tables.extend(show::last(&last));
    let mut part = Part::of(tables);
    part.complete = done == steps && !failed;
    part.agrees = !failed;
    part.fact("A", args.a.to_string());
    part.fact("B", args.b.to_string());
    match &args.input {
        Some(path) => part.fact("input", format!("{}, one step", path.display())),
        None => part.fact("scene", format!("{}, {done} of {steps} steps", args.scene.text())),
    }
    show::end(&mut part, &sides.0, last.a.as_ref());
    show::end(&mut part, &sides.1, last.b.as_ref());
    part.data = json!({
        "config": course.to_json(args),
        "a": sides.0.to_json(),
        "b": sides.1.to_json(),
        "rows": rows,
    });
    Ok(part)
}

/// Opens both boards, each with a world of its own.
fn open<'a>(
    args: &CompareArgs,
    common: &CommonArgs,
    folder: Option<&'a Folder>,
    gravity: [f32; 3],
) -> Result<(Side<'a>, Side<'a>)> {
    let open = |name, spec: SideSpec, accelerator: &AcceleratorChoice| {
        let world = |opened: &_| match folder {
            Some(folder) => {
                folder.check_shapes(board_shapes(opened)).map_err(Failure::input)?;
                Ok(World::Folder { folder, bodies: folder.bodies.clone() })
            }
            None => {
                args.scene.check_size(opened.accelerator.capabilities())?;
                args.scene.build(&spec.build).map(Box::new).map(World::Scene)
            }
        };
        let common = CommonArgs { accelerator: accelerator.clone(), ..common.clone() };
        Side::open(name, spec, common, world, gravity)
    };
    Ok((open("A", args.a, &AcceleratorChoice::Model)?, open("B", args.b, &common.accelerator)?))
}

/// The steps of a comparison.
struct Course {
    steps: u32,
    /// Steps from one shown row to the next.
    every: u32,
    parameters: StepParameters,
}

/// The rows of the steps that were taken.
struct Taken {
    /// For programs.
    rows: Vec<Value>,
    table: Table,
    last: Row,
    done: u32,
}

impl Course {
    fn take<'a>(&self, sides: &mut (Side<'a>, Side<'a>), session: &Session) -> Result<Taken> {
        let world = &sides.0.run.world;
        let moving = moving(world.bodies(), world.shapes());
        let mut crew = Crew::new("compare", 1);
        if let Some(error) = crew.refused() {
            log::warn!("no thread of its own for board B, which takes its steps after A: {error}");
        }
        session.expect(self.steps.into());
        let (a, b) = both(&mut crew, sides, |side| Some(side.start()));
        let mut last = Row { step: 0, a, b, deviation: None };
        let (mut rows, mut table) = (vec![last.to_json()], show::steps());
        show::row(&mut table, &last);
        let mut done = 0;
        while done < self.steps && !session.is_interrupted() {
            done += 1;
            let (a, b) = both(&mut crew, sides, |side| side.step(done, &self.parameters));
            if done == 1 && a.is_none() && b.is_none() {
                // Both builds fail at once: nothing can be compared.
                let Side { name, spec, failed, .. } = &mut sides.0;
                if let Some(failed) = failed.take() {
                    return Err(failed
                        .failure
                        .about(format!("board {name} ({spec}), and B as well")));
                }
            }
            session.advance();
            let fails = [&sides.0, &sides.1].map(|side| side.failed.as_ref().map(|f| f.step));
            let both_moved = a.is_some() && b.is_some();
            let (one, other) = (sides.0.run.world.bodies(), sides.1.run.world.bodies());
            let deviation = both_moved.then(|| StateDeviation::of(one, other, &moving));
            last = Row { step: done, a, b, deviation };
            let fails_now = fails.contains(&Some(done));
            if done == 1 || done % self.every == 0 || done == self.steps || fails_now {
                rows.push(last.to_json());
                show::row(&mut table, &last);
            }
            if fails.iter().all(Option::is_some) {
                break;
            }
        }
        session.end();
        Ok(Taken { rows, table, last, done })
    }

    /// The circumstances for programs.
    fn to_json(&self, args: &CompareArgs) -> Value {
        let mut config = match &args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => args.scene.to_json(),
        };
        config["steps"] = self.steps.into();
        config["every"] = self.every.into();
        config["contact_iterations"] = self.parameters.contact_iterations.into();
        config["friction_iterations"] = self.parameters.friction_iterations.into();
        config["time_step_s"] = self.parameters.time_step.into();
        config["spin_damping"] = self.parameters.spin_damping.into();
        config["a"] = args.a.to_string().into();
        config["b"] = args.b.to_string().into();
        config
    }
}

fn board_shapes(opened: &OpenBoard) -> u32 {
    opened.accelerator.capabilities().shapes_max()
}

/// Does the same with both boards: in parallel, or one after the other where there is no second
/// thread.
fn both<'a>(
    crew: &mut Crew,
    sides: &mut (Side<'a>, Side<'a>),
    act: impl Fn(&mut Side<'a>) -> Option<side::Measured> + Sync,
) -> (Option<side::Measured>, Option<side::Measured>) {
    let mut measured = (None, None);
    let shares = [(&mut sides.0, &mut measured.0), (&mut sides.1, &mut measured.1)];
    crew.each(shares.into_iter(), |(side, to)| *to = act(side));
    measured
}
