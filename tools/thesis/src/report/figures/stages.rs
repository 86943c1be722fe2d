//! Figures 5.1 and 5.2: a step without a pipeline and with one, on the channels of the board.

use pgs_interface::profile::{FLOAT, NAIVE, Profile};
use scene::{Grid, Scene, SceneOptions};
use step_trace::TracedStep;
use zynq_pgs::StepParameters;
use zynq_pgs::emulation::Build;

use crate::experiment::Part;
use crate::figure::Figure;
use crate::index::{Origin, Row};
use pgs_command::board;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Cause, Failure};
use pgs_command::numbers::grouped;
use pgs_command::options::build::described;
use pgs_command::options::scenes::DROP;

/// Steps before the recorded one: the cubes have landed.
const STEPS: u32 = 40;
/// Cubes along each axis: few enough to see the stages.
const SIDE: u16 = 4;

/// Draws a step of the pile on a board; also its cycles.
fn timeline(profile: &'static Profile, common: &CommonArgs) -> Result<(String, u64), Failure> {
    let grid = Grid::new(SIDE, SIDE, SIDE).map_err(Failure::input)?;
    let mut scene = Scene::new(&SceneOptions { grid, drop: DROP, ..SceneOptions::default() })
        .map_err(Failure::input)?;
    let build = Build { profile: Some(profile), ..Build::default() };
    let mut opened = board::open(common, &build)?;
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
        let stepped = opened.accelerator.step(bodies, collisions, &StepParameters::default());
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

pub(crate) fn part(common: &CommonArgs) -> Result<Part, Failure> {
    let (one_by_one, naive) = timeline(&NAIVE, common)?;
    let (pipelined, float) = timeline(&FLOAT, common)?;
    let figure = |id, thesis, title: &str, svg, caption: &str| Figure {
        id,
        thesis,
        title: title.to_owned(),
        svg,
        caption: caption.to_owned(),
        origin: Origin::Modelled,
        playback: None,
    };
    let figures = vec![
        figure(
            "figure-5-1",
            "§5.1.1, Figure 5.1",
            "Stages of a step without a pipeline (profile naive)",
            one_by_one,
            "One stream of 32 bits: a collision is solved when all of its words have come.",
        ),
        figure(
            "figure-5-2",
            "§5.1.1, Figure 5.2",
            "The same step with a pipeline, on four channels (profile float)",
            pipelined,
            "Four streams of 128 bits: a collision enters every two cycles unless it must wait for a body.",
        ),
    ];
    let command = |profile: &Profile| {
        let StepParameters { contact_iterations, friction_iterations, .. } =
            StepParameters::default();
        format!(
            "pgs run --grid {SIDE}x{SIDE}x{SIDE} --steps {} --contact-iterations {contact_iterations} \
             --friction-iterations {friction_iterations} --profile {} --json --timeline step.svg",
            STEPS + 1,
            profile.name
        )
    };
    let row = |figure: &Figure, profile: &Profile, cycles: u64| Row {
        thesis: figure.thesis.to_owned(),
        subject: format!("a step of {} cubes, profile {}", SIDE * SIDE * SIDE, profile.name),
        recorded: "a drawing, no numbers".to_owned(),
        ours: format!("{} cycles on the emulated board", grouped(cycles)),
        origin: Origin::Modelled,
        command: command(profile),
        shown: figure.id.to_owned(),
    };
    let rows = vec![row(&figures[0], &NAIVE, naive), row(&figures[1], &FLOAT, float)];
    Ok(Part { figures, rows, ..Part::default() })
}
