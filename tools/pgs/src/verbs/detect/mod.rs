//! The verb `detect`: detects the collisions of a folder's poses or of a scene, and compares them
//! with the folder's own.

mod cause;
mod comparison;
mod geometry;
mod input;
mod show;
mod timing;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use zynq_pgs::StepParameters;
use zynq_pgs::emulation::Build;

use self::comparison::Comparison;
use self::input::Input;
use self::show::Shown;
use self::timing::Timing;
use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::options::scenes::{self, SceneArgs};
use crate::step_input;

const EXAMPLES: &str = "\
Examples:
  pgs detect --input tests/golden/pile5_step60 --compare
  pgs detect --input tests/golden/two_cubes --compare --json
  pgs detect --grid 20x20x20 --drop 0

The folder is one for `pgs solve`. Body 0 is the ground, a box of 800 m whose top is y = 0; every
other body is a cube of 2 m, as in Bullet's demo: a folder says nothing of shapes. Two bodies up to
2 cm apart collide.

Detection runs twice: from nothing, and again after all bodies have moved by their velocities for
one time step, with everything kept.

--compare holds pairs, normals and points against the folder's. It fails, with exit code 1, if a
pair deeper than 1 mm is missing or extra. Every normal more than 0.01 degrees off and every point
more than 1 mm off is counted under its cause:

  apart     the cubes are apart along a face of B and along none of A; the folder's axis is across
            two edges. Bullet's kernel (sat.cl) leaves the faces of such a pair and tries its edges
  equal     along both axes the cubes overlap equally, within 0.1 mm
  choice    the point is one of ours, before four of them are chosen
  clip      the folder's point is a corner of B's face cut by the sides of A's face; ours is cut
            along the normal. Bullet cuts so
  first     the first point of the collision is none of these. Bullet's kernel of contacts
            (satClipHullContacts.cl) puts the point of a portal refinement (MPR) in place of the
            first corner
  normal    the point belongs to a collision whose normal differs, too
  unknown   none of these";

/// Detect collisions, time the detection, and compare them with a folder's.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DetectArgs {
    /// Take the poses from this folder of .npy arrays instead of a scene.
    #[arg(long, value_name = "DIR", conflicts_with = "SceneArgs")]
    input: Option<PathBuf>,
    /// Compare with the folder's own collisions; exit code 1 if a pair deeper than 1 mm is missing
    /// or extra.
    #[arg(long, requires = "input")]
    compare: bool,
    /// Threads; no result depends on them.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    threads: u16,
    /// Runs for the median times.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    #[command(flatten)]
    scene: SceneArgs,
}

/// Detects, and compares.
pub(crate) fn run(
    args: &DetectArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let (mut scene, input, time_step) = match &args.input {
        Some(path) => {
            let folder = step_input::load(path)?;
            let time_step = folder.parameters.time_step;
            let input = Input::new(folder).map_err(Failure::input)?;
            if args.compare {
                input.check_collisions().map_err(Failure::input)?;
            }
            let scene = scene::Scene::of_cubes(input.bodies()).map_err(|error| {
                Failure::input(error)
                    .about(path.display().to_string())
                    .next("`pgs detect --help` tells which bodies it takes")
            })?;
            (scene, Some(input), time_step)
        }
        None => {
            scenes::check_rows(args.scene.grid())?;
            let scene = args.scene.build(&Build::default())?;
            (scene, None, StepParameters::default().time_step)
        }
    };
    let timing = Timing::measure(&mut scene, args.threads, time_step, args.runs);
    let comparison = input
        .as_ref()
        .filter(|_| args.compare)
        .map(|input| Comparison::of(&scene, input.collisions()));

    let shown =
        Shown { args, scene: &scene, time_step, timing: &timing, comparison: comparison.as_ref() };
    if common.json {
        writeln!(out, "{:#}", shown.to_json())?;
    } else {
        shown.print(out)?;
    }
    let agrees = comparison.is_none_or(|comparison| comparison.agrees());
    Ok(if agrees { Verdict::Done } else { Verdict::Differs })
}
