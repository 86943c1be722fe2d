//! The end of a run: its figures for people, and its document for programs.

use std::io::{self, Write};

use scene::Scene;
use serde_json::{Value, json};
use zynq_pgs::StepParameters;

use super::facts::is_emulated;
use super::summary::Summary;
use super::{Course, RunArgs};
use pgs_command::board::OpenBoard;
use pgs_command::numbers::grouped;
use pgs_command::options::solver::time_step_text;
use pgs_command::output::SCHEMA;
use pgs_command::output::facts::fact;
use step_folder::digest;

/// The summary of the run; none before the first step.
fn summary<'a>(opened: &OpenBoard, scene: &mut Scene, course: &'a Course) -> Option<Summary<'a>> {
    let last = course.last.as_ref()?;
    Some(Summary::new(&course.totals, is_emulated(opened), (scene, last)))
}

/// Prints the end of the run for people: an interruption and planned faults if there are any, then
/// five lines.
pub(super) fn print_end(
    args: &RunArgs,
    opened: &OpenBoard,
    scene: &mut Scene,
    course: &Course,
    out: &mut dyn Write,
) -> io::Result<()> {
    let Course { done, retries, .. } = course;
    if !course.is_complete(args.steps()) {
        let cold =
            if *done == args.steps() { "; the scene beside it lacks the last step" } else { "" };
        writeln!(out, "interrupted after {done} of {} steps{cold}", args.steps())?;
    }
    if let Some(faults) = opened.faults_text() {
        fact(out, "faults", &faults)?;
    }
    if *retries > 0 {
        fact(out, "retries", &format!("{} of {done} steps", grouped(*retries)))?;
    }
    if let Some((energy, _)) = &course.energy {
        fact(out, "energy", energy)?;
    }
    if let Some(summary) = summary(opened, scene, course) {
        summary.print(out)?;
    }
    writeln!(out, "digest     {} {:016x}", digest::ALGORITHM, digest::of_bodies(scene.bodies()))
}

/// The document of the run, for programs.
pub(super) fn document(
    args: &RunArgs,
    parameters: &StepParameters,
    opened: &OpenBoard,
    scene: &mut Scene,
    mut course: Course,
) -> Value {
    let mut config = args.scene.to_json();
    config["steps"] = args.steps().into();
    config["contact_iterations"] = parameters.contact_iterations.into();
    config["friction_iterations"] = parameters.friction_iterations.into();
    config["time_step_s"] = parameters.time_step.into();
    config["spin_damping"] = parameters.spin_damping.into();
    config["warm_start"] = parameters.warm_start.into();
    config["pair_friction"] = parameters.pair_friction.into();
    config["time_step"] = time_step_text(parameters.time_step).into();
    let steps = std::mem::take(&mut course.documents);
    let (done, complete) = (course.done, course.is_complete(args.steps()));
    let cold = course.cold.as_mut().and_then(|cold| cold.end_json(done));
    let summary = summary(opened, scene, &course);
    let digest = format!("{:016x}", digest::of_bodies(scene.bodies()));
    json!({
        "schema": SCHEMA,
        "verb": "run",
        "config": config,
        "board": opened.to_json(),
        "complete": complete,
        "steps": steps,
        "summary": summary.map(|summary| summary.to_json()),
        "beside_cold": cold,
        "energy": course.energy.as_ref().map(|(_, energy)| energy),
        "faults": opened.faults_json(),
        "traced": args.traced.to_json(course.inside),
        "digest": { "algorithm": digest::ALGORITHM, "value": digest },
    })
}
