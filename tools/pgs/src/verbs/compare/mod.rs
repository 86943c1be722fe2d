//! The verb `compare`: two boards step the same start, each on its own way, and what becomes of it.

mod lane;
mod show;

use std::fmt;
use std::io::Write;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use pgs_support::Crew;
use serde_json::{Value, json};
use zynq_pgs::StepParameters;

use self::lane::{Lane, Measured, World};
use super::SCHEMA;
use super::progress::progress_bar;
use crate::args::{BoardName, CommonArgs};
use crate::deviation::StateDeviation;
use crate::failure::{Failure, Verdict};
use crate::interrupt::Interrupt;
use crate::options::{BuildArgs, DeadlineArgs};
use crate::ordering::{OrderName, OrderingArgs};
use crate::origin;
use crate::scenes::SceneArgs;
use crate::solver::SolverArgs;

const EXAMPLES: &str = "\
Examples:
  pgs compare float float,unchecked --grid 10x10x10 --steps 200
  pgs compare float,hazard-free float,unchecked,as-given --input vectors/full_step186
  pgs compare float half --input vectors/full_step186
  pgs compare half,thesis16 half,binary16 --steps 300 --every 10 --json
  pgs compare float,world mixed,world --scene shapes --grid 8x8x8

A and B are builds of the emulated board: a profile, and what is not as usual, after commas. Words
are binary16, thesis16 (numbers on 16-bit streams), f32 (arithmetic), interlocked, unchecked, keep,
flush, isotropic, world; the rest is window=SLOTS, bandwidth=GBPS, arithmetic=f32|binary16,
length-width=BITS and address-width=BITS. The order in which a board is sent the collisions is one of
auto, as-given, hazard-free, hazard-free-nearby, body-by-body, body-by-body-oldest, body-by-body-newest,
colours. Without one a board that waits on hazards takes the collisions as given, so that two such
boards solve them in one order. Each board finds its own collisions.

Only moving bodies are compared; A is the original. Relative deviations are |B - A| / |A| of each
component (thesis eq. 4.1); where A's component is 0 they leave it out. A velocity is within 1 % if it
differs by 1 % of A's at most: 0 only with 0. Momenta are shown by their length, and B-A is that of
the difference; angular momentum is about the origin, potential energy from y = 0. Unmoved is the
share of position components that the step left at the bits that the board was sent. Penetration is
that of the state after the step: of a scene, of all contacts found then; of a folder, whose shapes
are not known, of the step's own contacts, carried along with their bodies.

A board whose step fails stops there and the other goes on. Exit code 0 if every step was taken, 1
if one failed.";

/// Rows of the table, if not said otherwise.
const ROWS: u32 = 10;

/// Step the same start on two boards and show how far they come apart.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Build of the board that is the original.
    #[arg(value_name = "A")]
    a: Side,
    /// Build of the board that is compared with it.
    #[arg(value_name = "B")]
    b: Side,
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

/// What one side of a comparison is: how its board is built, and in which order it is sent the
/// collisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Side {
    pub(super) build: BuildArgs,
    pub(super) ordering: OrderingArgs,
}

impl FromStr for Side {
    type Err = String;

    /// A word of the order may stand anywhere behind the profile.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut order = None;
        let mut rest = Vec::new();
        for (place, word) in text.split(',').enumerate() {
            match OrderName::of_word(word) {
                Some(_) if order.is_some() => return Err("order is given twice".to_owned()),
                Some(name) if place > 0 => order = Some(name),
                _ => rest.push(word),
            }
        }
        let build = rest.join(",").parse().map_err(|error| {
            format!("{error}; orders of the collisions are {}", OrderName::all())
        })?;
        Ok(Self { build, ordering: OrderingArgs { order, verify: false } })
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.build)?;
        match self.ordering.order {
            Some(order) => write!(f, ",{}", order.text()),
            None => Ok(()),
        }
    }
}

/// A step on both boards.
struct Row {
    /// 0 is the common start.
    step: u32,
    a: Option<Measured>,
    b: Option<Measured>,
    /// If both took the step.
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

    /// B less A.
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
        let error = "`pgs compare` builds both boards itself, a real one is as its bitstream is";
        return Err(Failure::input(error).next("leave out --board (and PGS_BOARD)"));
    }
    let folder = args.input.as_deref().map(origin::load).transpose()?;
    let parameters = match &folder {
        Some(folder) => folder.parameters,
        None => StepParameters::default(),
    };
    let mut parameters = args.deadline.apply(args.solver.apply(parameters));
    parameters.verify_order |= args.verify;
    let open = |name, side: Side| {
        let world = |opened: &_| match &folder {
            Some(folder) => {
                let capacity = board_shapes(opened);
                folder.check_shapes(capacity).map_err(Failure::input)?;
                Ok(World::Folder { folder, bodies: folder.bodies.clone() })
            }
            None => {
                args.scene.check_size(opened)?;
                args.scene.build(&side.build).map(Box::new).map(World::Scene)
            }
        };
        Lane::open(name, side, common, world, parameters.gravity)
    };
    let mut lanes = (open("A", args.a)?, open("B", args.b)?);

    let steps = if folder.is_some() { 1 } else { args.steps };
    let every = args.every.unwrap_or(steps.div_ceil(ROWS));
    let moving = lanes.0.world.moving();
    let interrupt = Interrupt::install();
    let progress = progress_bar(steps);
    let mut crew = Crew::new("compare", 1);
    if let Some(error) = crew.refused() {
        log::warn!("no thread of its own for board B, which takes its steps after A: {error}");
    }
    let (a, b) = both(&mut crew, &mut lanes, |lane| Some(lane.start()));
    let mut last = Row { step: 0, a, b, deviation: None };
    let mut documents = vec![last.to_json()];
    let mut done = 0;
    while done < steps && !interrupt.is_set() {
        done += 1;
        let (a, b) = both(&mut crew, &mut lanes, |lane| lane.step(done, &parameters));
        if done == 1 && a.is_none() && b.is_none() {
            // Nothing to be compared, and nothing that one build does better than the other.
            let Lane { name, side, failed, .. } = &mut lanes.0;
            if let Some(failed) = failed.take() {
                return Err(failed.failure.about(format!("board {name} ({side}), and B as well")));
            }
        }
        if done == 1 && !common.json {
            // Only now: what is refused prints nothing but the refusal.
            progress.suspend(|| show::head(args, &lanes, steps, &last, out))?;
        }
        progress.inc(1);
        let fails = [&lanes.0, &lanes.1].map(|lane| &lane.failed);
        let fails_now = fails.iter().any(|f| f.as_ref().is_some_and(|f| f.step == done));
        let all_failed = fails.iter().all(|failed| failed.is_some());
        let deviation = (a.is_some() && b.is_some())
            .then(|| StateDeviation::of(lanes.0.world.bodies(), lanes.1.world.bodies(), &moving));
        let row = Row { step: done, a, b, deviation };
        if done == 1 || done % every == 0 || done == steps || fails_now {
            if common.json {
                documents.push(row.to_json());
            } else {
                progress.suspend(|| show::row(&row, &lanes, out))?;
                out.flush()?;
            }
        }
        last = row;
        if all_failed {
            break;
        }
    }
    progress.finish_and_clear();

    let failed = lanes.0.failed.is_some() || lanes.1.failed.is_some();
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
        config["a"] = args.a.to_string().into();
        config["b"] = args.b.to_string().into();
        let document = json!({
            "schema": SCHEMA,
            "verb": "compare",
            "config": config,
            "complete": complete,
            "a": lanes.0.to_json(),
            "b": lanes.1.to_json(),
            "rows": documents,
        });
        writeln!(out, "{document:#}")?;
    } else {
        show::end(&last, &lanes, out)?;
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

fn board_shapes(opened: &crate::board::Opened) -> u32 {
    opened.accelerator.capabilities().shape_capacity
}

/// Does the same with both boards: side by side, or one after the other where there is no second
/// thread.
fn both<'a>(
    crew: &mut Crew,
    lanes: &mut (Lane<'a>, Lane<'a>),
    act: impl Fn(&mut Lane<'a>) -> Option<Measured> + Sync,
) -> (Option<Measured>, Option<Measured>) {
    let mut measured = (None, None);
    let shares = [(&mut lanes.0, &mut measured.0), (&mut lanes.1, &mut measured.1)];
    crew.each(shares.into_iter(), |(lane, to)| *to = act(lane));
    measured
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_written_as_it_is_read() {
        for text in [
            "float",
            "half,thesis16,f32,unchecked",
            "float,unchecked,hazard-free",
            "mixed,body-by-body-oldest",
            "float,auto",
        ] {
            assert_eq!(text.parse::<Side>().expect(text).to_string(), text);
        }
        let side: Side = "float,order=as-given,unchecked".parse().expect("the same");
        assert_eq!(side.to_string(), "float,unchecked,as-given");
        let error = "float,sorted".parse::<Side>().expect_err("no such word");
        assert!(error.contains("sorted") && error.contains("colours"), "{error}");
        let error = "float,colours,as-given".parse::<Side>().expect_err("two orders");
        assert_eq!(error, "order is given twice");
        "hazard-free".parse::<Side>().expect_err("no profile");
    }
}
