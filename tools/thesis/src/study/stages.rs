//! Figures 5.1 and 5.2: a step without a pipeline and with one, on the channels of the board.

use bitstream_model::BoardConfig;
use pgs_interface::profile::{FLOAT, NAIVE, Profile};
use scene::{Grid, Scene, SceneOptions};
use step_trace::TracedStep;
use zynq_pgs::StepParameters;

use crate::experiment::{Boards, Experiment, Part};
use crate::figure::Figure;
use pgs_command::board;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::numbers::grouped;
use pgs_command::options::build::described;
use pgs_command::options::scenes::DROP;

/// The experiment.
pub(crate) static STAGES: Experiment = Experiment {
    id: "stages",
    thesis: "§5.1.1, Figures 5.1 and 5.2",
    about: "The stages of a step without a pipeline, and with one",
    boards: Boards::Own,
    arguments: |command| command,
    run: |_, session| measure(&session.emulated()),
};

/// Steps before the recorded one: the cubes have landed.
const STEPS: u32 = 40;
/// Cubes along each axis: few enough to see the stages.
const SIDE: u16 = 4;

/// Draws a step of the pile on a board; also its cycles.
fn timeline(profile: &'static Profile, common: &CommonArgs) -> Result<(String, u64)> {
    let grid = Grid::new(SIDE, SIDE, SIDE).map_err(Failure::input)?;
    let mut scene = Scene::new(&SceneOptions { grid, drop: DROP }).map_err(Failure::input)?;
    let mut opened = board::open(common, BoardConfig { profile, ..BoardConfig::default() })?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    let observer = opened.observer.clone().ok_or_else(|| {
        Failure::input("the inside of a step can be seen on the emulated board alone")
            .next("leave out --board")
    })?;
    let mut report = None;
    for step in 0..=STEPS {
        if step == STEPS {
            observer.record();
        }
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        let stepped = opened.accelerator.step(bodies, collisions, &StepParameters::thesis());
        report = Some(stepped.map_err(|error| opened.failure(error))?);
    }
    let recording = observer.take_recording();
    let recording =
        recording.ok_or_else(|| Failure::new(Cause::Hardware, "no step was recorded"))?;
    let design = described(&observer.config());
    let step = TracedStep { recording: &recording, design: &design, report: report.as_ref() };
    let mut svg = Vec::new();
    step.write_timeline(&mut svg)?;
    let cycles = report.map_or(0, |report| report.cycles.total);
    Ok((String::from_utf8_lossy(&svg).into_owned(), cycles))
}

fn measure(common: &CommonArgs) -> Result<Part> {
    let mut part = Part::of(Vec::new());
    for (profile, id, title, caption) in [
        (
            &NAIVE,
            ("figure-5-1", "§5.1.1, Figure 5.1"),
            "Stages of a step without a pipeline (profile naive)",
            "One stream of 32 bits: a collision is solved when all of its words have come.",
        ),
        (
            &FLOAT,
            ("figure-5-2", "§5.1.1, Figure 5.2"),
            "The same step with a pipeline, on four channels (profile float)",
            "Four streams of 128 bits: a collision enters every two cycles unless it must wait \
             for a body.",
        ),
    ] {
        let (svg, cycles) = timeline(profile, common)?;
        let figure = Figure::new(id, title, svg, caption).modelled();
        let mut row = figure.row(
            format!("a step of {} cubes, profile {}", SIDE * SIDE * SIDE, profile.name),
            "a drawing, no numbers",
            format!("{} cycles on the emulated board", grouped(cycles)),
        );
        let StepParameters { contact_iterations, friction_iterations, .. } =
            StepParameters::thesis();
        row.command = format!(
            "pgs run --grid {SIDE}x{SIDE}x{SIDE} --steps {} --contact-iterations \
             {contact_iterations} \
             --friction-iterations {friction_iterations} --board emulated:{} --json --timeline \
             step.svg",
            STEPS + 1,
            profile.name
        );
        part.figure(figure, [row]);
    }
    Ok(part)
}
