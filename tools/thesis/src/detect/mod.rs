//! Detects the collisions of a folder's poses, and compares them with the folder's own.

mod cause;
mod comparison;
mod geometry;
mod input;
mod show;

use std::path::PathBuf;

use clap::Args;
use pgs_command::failure::{Failure, Result};
use pgs_command::step_input;
use scene::Scene;
use serde_json::json;

use self::comparison::Comparison;
use self::input::Input;
use crate::experiment::{Boards, Experiment, Part, given};
use crate::session::Session;

const EXAMPLES: &str = "\
Examples:
  pgs thesis detection --input tests/golden/pile5_step60
  pgs thesis detection --input tests/golden/two_cubes --json

The folder is one for `pgs solve`. Body 0 is the ground, a box of 800 m whose top is y = 0; every
other body is a cube of 2 m, as in Bullet's demo: a folder says nothing of shapes. Two bodies up to
2 cm apart collide.

The exit code is 1 if a pair deeper than 1 mm is missing or extra. Every normal more than 0.01 \
degrees off and every point
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

/// The experiment.
pub(crate) static DETECTION: Experiment = Experiment {
    id: "detection",
    thesis: "§2.2.2",
    about: "Our collision detection beside a folder's collisions of the same poses",
    boards: Boards::None,
    arguments: DetectionArgs::augment_args,
    run: |args, session| measure(&given(args)?, session),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DetectionArgs {
    /// The folder of .npy arrays with poses and collisions of one step.
    #[arg(long, value_name = "DIR")]
    input: PathBuf,
}

/// Detects, and compares.
fn measure(args: &DetectionArgs, _: &Session) -> Result<Part> {
    let path = &args.input;
    let input = Input::new(step_input::load(path)?)?;
    input.check_collisions()?;
    let mut scene = Scene::of_cubes(input.bodies()).map_err(|error| {
        Failure::input(error)
            .about(path.display().to_string())
            .next("`pgs thesis detection --help` tells which bodies it takes")
    })?;
    scene.detect();
    let comparison = Comparison::of(&scene, input.collisions());
    let mut part = show::part(&comparison, &scene);
    part.facts.insert(0, ("input", path.display().to_string()));
    part.data = json!({ "config": { "input": path.display().to_string() } });
    Ok(part)
}
