//! The verb `compare`: steps two boards from the same start, independently, and measures how far
//! they diverge.

mod show;
mod side;
mod spec;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use pgs_support::Crew;
use serde_json::{Value, json};
use zynq_pgs::StepParameters;

use self::side::{Measured, Side, World};
use self::spec::SideSpec;
use crate::common::{AcceleratorChoice, BoardName, CommonArgs};
use crate::deviation::StateDeviation;
use crate::failure::{Failure, Verdict};
use crate::interrupt::Interrupt;
use crate::options::scenes::SceneArgs;
use crate::options::solver::{DeadlineArgs, SolverArgs};
use crate::output::SCHEMA;
use crate::output::progress::progress_bar;
use crate::step_input;

const EXAMPLES: &str = "\
Examples:
  pgs compare float float,unchecked --grid 10x10x10 --steps 200
  pgs compare float,hazard-free float,unchecked,as-given --input tests/golden/pile5_step60
  pgs compare float,gpu float,as-given --input tests/golden/pile5_step60
  pgs compare float half --input tests/golden/pile5_step60
  pgs compare half,thesis16 half,binary16 --steps 300 --every 10 --json
  pgs compare float,world naive,world --scene shapes --grid 8x8x8

Examples with the Verilog in simulation (docs/bitstream.md):
  pgs compare float,flush float,flush --grid 2x2x2 --steps 3 --accelerator rtl:rtl-sim/pgs-rtl

A and B are builds of the emulated board: a profile, and changes of its defaults after commas. A
change is a word: binary16, thesis16, thesis16-literal (numbers on 16-bit streams), f32
(arithmetic), interlocked, unchecked, keep, flush, isotropic, world; or window=SLOTS,
bandwidth=GBPS, arithmetic=f32|binary16, length-width=BITS, address-width=BITS, threads=N and
lanes=on|off. The order of a board's collisions is one of auto, as-given, hazard-free,
hazard-free-nearby, body-by-body, body-by-body-oldest, body-by-body-newest, colours, gpu,
random=SEED (see `pgs solve --help`). Without an order, a board that waits on hazards takes the
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

/// Step two boards from the same start and show how far they diverge.
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
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..))]
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
    a: Option<Measured>,
    b: Option<Measured>,
    /// Present if both boards took the step.
    deviation: Option<StateDeviation>,
}

impl Row {
    fn to_json(&self) -> Value {
        let of = |measured: &Option<Measured>| measured.as_ref().map(Measured::to_json);
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
pub(crate) fn run(
    args: &CompareArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    if !matches!(common.board, BoardName::Auto | BoardName::Emulated) {
        let error = "`pgs compare` builds both boards itself and cannot use a real one";
        return Err(Failure::input(error).next("leave out --board (and PGS_BOARD)"));
    }
    let folder = args.input.as_deref().map(step_input::load).transpose()?;
    let parameters = match &folder {
        Some(folder) => folder.parameters,
        None => StepParameters::default(),
    };
    let mut parameters = args.deadline.apply(args.solver.apply(parameters));
    parameters.verify_order |= args.verify;
    let open = |name, spec: SideSpec, accelerator: &AcceleratorChoice| {
        let world = |opened: &_| match &folder {
            Some(folder) => {
                let capacity = board_shapes(opened);
                folder.check_shapes(capacity).map_err(Failure::input)?;
                Ok(World::Folder { folder, bodies: folder.bodies.clone() })
            }
            None => {
                args.scene.check_size(opened.accelerator.capabilities())?;
                args.scene.build(&spec.build).map(Box::new).map(World::Scene)
            }
        };
        let common = CommonArgs { accelerator: accelerator.clone(), ..common.clone() };
        Side::open(name, spec, common, world, parameters.gravity)
    };
    let mut sides =
        (open("A", args.a, &AcceleratorChoice::Model)?, open("B", args.b, &common.accelerator)?);

    let steps = if folder.is_some() { 1 } else { args.steps };
    let every = args.every.unwrap_or(steps.div_ceil(ROWS));
    let moving = sides.0.world.moving();
    let interrupt = Interrupt::install();
    let progress = progress_bar(steps);
    let mut crew = Crew::new("compare", 1);
    if let Some(error) = crew.refused() {
        log::warn!("no thread of its own for board B, which takes its steps after A: {error}");
    }
    let (a, b) = both(&mut crew, &mut sides, |side| Some(side.start()));
    let mut last = Row { step: 0, a, b, deviation: None };
    let mut documents = vec![last.to_json()];
    let mut done = 0;
    while done < steps && !interrupt.is_set() {
        done += 1;
        let (a, b) = both(&mut crew, &mut sides, |side| side.step(done, &parameters));
        if done == 1 && a.is_none() && b.is_none() {
            // Both builds fail at once: nothing can be compared.
            let Side { name, spec, failed, .. } = &mut sides.0;
            if let Some(failed) = failed.take() {
                return Err(failed.failure.about(format!("board {name} ({spec}), and B as well")));
            }
        }
        if done == 1 && !common.json {
            // The heading waits for the first step: a refused scene prints only the refusal.
            progress.suspend(|| show::head(args, &sides, steps, &last, out))?;
        }
        progress.inc(1);
        let fails = [&sides.0, &sides.1].map(|side| &side.failed);
        let fails_now = fails.iter().any(|f| f.as_ref().is_some_and(|f| f.step == done));
        let all_failed = fails.iter().all(|failed| failed.is_some());
        let deviation = (a.is_some() && b.is_some())
            .then(|| StateDeviation::of(sides.0.world.bodies(), sides.1.world.bodies(), &moving));
        let row = Row { step: done, a, b, deviation };
        if done == 1 || done % every == 0 || done == steps || fails_now {
            if common.json {
                documents.push(row.to_json());
            } else {
                progress.suspend(|| show::row(&row, &sides, out))?;
                out.flush()?;
            }
        }
        last = row;
        if all_failed {
            break;
        }
    }
    progress.finish_and_clear();

    let failed = sides.0.failed.is_some() || sides.1.failed.is_some();
    let complete = done == steps && !failed;
    if common.json {
        let mut config = match &args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => args.scene.to_json(),
        };
        config["steps"] = steps.into();
        config["every"] = every.into();
        config["contact_iterations"] = parameters.contact_iterations.into();
        config["friction_iterations"] = parameters.friction_iterations.into();
        config["time_step_s"] = parameters.time_step.into();
        config["spin_damping"] = parameters.spin_damping.into();
        config["a"] = args.a.to_string().into();
        config["b"] = args.b.to_string().into();
        let document = json!({
            "schema": SCHEMA,
            "verb": "compare",
            "config": config,
            "complete": complete,
            "a": sides.0.to_json(),
            "b": sides.1.to_json(),
            "rows": documents,
        });
        writeln!(out, "{document:#}")?;
    } else {
        show::end(&last, &sides, out)?;
        if !failed && !complete {
            writeln!(out, "interrupted after {done} of {steps} steps")?;
        }
    }
    Ok(if failed {
        Verdict::Differs
    } else if complete {
        Verdict::Done
    } else {
        Verdict::Interrupted
    })
}

fn board_shapes(opened: &crate::board::OpenBoard) -> u32 {
    opened.accelerator.capabilities().shapes_max()
}

/// Does the same with both boards: in parallel, or one after the other where there is no second
/// thread.
fn both<'a>(
    crew: &mut Crew,
    sides: &mut (Side<'a>, Side<'a>),
    act: impl Fn(&mut Side<'a>) -> Option<Measured> + Sync,
) -> (Option<Measured>, Option<Measured>) {
    let mut measured = (None, None);
    let shares = [(&mut sides.0, &mut measured.0), (&mut sides.1, &mut measured.1)];
    crew.each(shares.into_iter(), |(side, to)| *to = act(side));
    measured
}
