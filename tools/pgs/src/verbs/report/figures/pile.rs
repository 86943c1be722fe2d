//! Figure 4.1: the pile, as a picture and as a page that plays its fall.

use scene::{Scene, SceneOptions};
use zynq_pgs::StepParameters;
use zynq_pgs::emulation::Build;
use zynq_pgs_view::Recording;
use zynq_pgs_view::page::page;
use zynq_pgs_view::picture::Picture;

use super::super::document::{Figure, Origin, Part, Row};
use super::super::studies::Effort;
use crate::board;
use crate::common::CommonArgs;
use crate::failure::Failure;
use crate::numbers::grouped;
use crate::options::scenes::DROP;

const STEPS: u16 = 120;
/// Iterations of each kind: enough to carry 30 layers.
const ITERATIONS: u32 = 10;
/// Steps from one frame of the playback to the next.
const EVERY: u16 = 2;

pub(crate) fn part(effort: &Effort<'_>, common: &CommonArgs) -> Result<Part, Failure> {
    let grid = effort.pile();
    let mut scene = Scene::new(&SceneOptions { grid, drop: DROP, ..SceneOptions::default() })
        .map_err(Failure::input)?;
    let mut opened = board::open(common, &Build::default())?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    let parameters = StepParameters::default()
        .with_contact_iterations(ITERATIONS)
        .with_friction_iterations(ITERATIONS);
    let mut recording = Recording::new(scene.bodies(), scene.geometries());
    recording.add(0, 0.0, scene.bodies()).map_err(Failure::input)?;
    let mut most = 0;
    for step in 1..=STEPS {
        effort.go_on()?;
        most = most.max(scene.detect().len());
        let (bodies, collisions) = scene.parts_mut();
        let stepped = opened.accelerator.step(bodies, collisions, &parameters);
        stepped.map_err(|error| opened.failure(error))?;
        if step.is_multiple_of(EVERY) {
            let time = f32::from(step) * parameters.time_step;
            recording.add(step.into(), time, scene.bodies()).map_err(Failure::input)?;
        }
    }
    let cubes = grouped(recording.bodies() as u64);
    let title = format!("{cubes} cubes falling on the ground");
    let facts = [("scene", format!("{grid} cubes, dropped from {DROP} m, {STEPS} steps"))];
    let command = format!("pgs run --grid {grid} --view pile.html --picture pile.svg");
    let figure = Figure {
        id: "figure-4-1",
        thesis: "Figure 4.1",
        title: format!("A snapshot of the scene: {cubes} cubes after {STEPS} steps"),
        svg: Picture::of_all(scene.bodies(), scene.geometries()).svg().map_err(Failure::input)?,
        caption: "The thesis shows a snapshot of Bullet's demo with 38,880 cubes.".to_owned(),
        origin: Origin::Measured,
        playback: Some(page(&recording, &title, &facts).map_err(Failure::input)?.html),
    };
    let row = Row {
        thesis: "§4.3, Figure 4.1".to_owned(),
        subject: "cubes, and collisions of a heavy step".to_owned(),
        recorded: "38,880 cubes, 90,000 to 130,000 collisions".to_owned(),
        ours: format!("{cubes} cubes, up to {} collisions", grouped(most as u64)),
        origin: Origin::Measured,
        command,
        shown: figure.id.to_owned(),
    };
    Ok(Part { figures: vec![figure], rows: vec![row] })
}
