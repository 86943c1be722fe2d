//! Figure 4.1: the pile, as a picture and as a page that plays its fall.

use zynq_pgs::StepParameters;
use zynq_pgs::emulation::Build;
use zynq_pgs_view::Recording;
use zynq_pgs_view::page::page;
use zynq_pgs_view::picture::Picture;

use super::super::studies::Effort;
use crate::experiment::Part;
use crate::figure::Figure;
use crate::index::{Origin, Row};
use pgs_command::common::CommonArgs;
use pgs_command::failure::Failure;
use pgs_command::numbers::grouped;
use pgs_command::options::scenes::DROP;
use pgs_command::options::scenes::{ITERATIONS, STEPS};
use pgs_command::options::solver::time_of;
use pgs_command::pile;

/// Steps from one frame of the playback to the next.
const EVERY: u32 = 2;

/// A number and its noun.
fn counted(count: u64, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(count))
}

pub(crate) fn part(effort: &Effort<'_>, common: &CommonArgs) -> Result<Part, Failure> {
    let grid = effort.pile();
    let (mut scene, mut opened) = pile::open(grid, DROP, common, &Build::default())?;
    // As `pgs run`, whose defaults the printed command takes.
    let [steps, _] = STEPS;
    let parameters = StepParameters::default()
        .with_contact_iterations(ITERATIONS)
        .with_friction_iterations(ITERATIONS);
    let mut recording = Recording::new(scene.bodies(), scene.geometries());
    recording.add(0, 0.0, scene.bodies()).map_err(Failure::input)?;
    let mut most = 0;
    for step in 1..=steps {
        effort.go_on()?;
        most = most.max(scene.detect().len());
        let (bodies, collisions) = scene.parts_mut();
        let stepped = opened.accelerator.step(bodies, collisions, &parameters);
        stepped.map_err(|error| opened.failure(error))?;
        if step.is_multiple_of(EVERY) {
            let time = time_of(step, parameters.time_step);
            recording.add(step, time, scene.bodies()).map_err(Failure::input)?;
        }
    }
    let cubes = counted(recording.bodies() as u64, "cube");
    let title = format!("{cubes} falling on the ground");
    let facts = [("scene", format!("{grid} cubes, dropped from {DROP} m, {steps} steps"))];
    let command =
        format!("pgs run --grid {grid} --every {EVERY} --view pile.html --picture pile.svg");
    let figure = Figure {
        id: "figure-4-1",
        thesis: "§4.3, Figure 4.1",
        title: format!("A snapshot of the scene: {cubes} after {steps} steps"),
        svg: Picture::of_all(scene.bodies(), scene.geometries()).svg().map_err(Failure::input)?,
        caption: "The thesis shows a snapshot of Bullet's demo with 38,880 cubes.".to_owned(),
        origin: Origin::Measured,
        playback: Some(page(&recording, &title, &facts).map_err(Failure::input)?.html),
    };
    let row = Row {
        thesis: figure.thesis.to_owned(),
        subject: "cubes, and collisions of a heavy step".to_owned(),
        recorded: "38,880 cubes, 90,000 to 130,000 collisions".to_owned(),
        ours: format!("{cubes}, up to {}", counted(most as u64, "collision")),
        origin: Origin::Measured,
        command,
        shown: figure.id.to_owned(),
    };
    Ok(Part { figures: vec![figure], rows: vec![row], ..Part::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cube_is_no_cubes() {
        assert_eq!([1, 2].map(|count| counted(count, "cube")), ["1 cube", "2 cubes"]);
    }
}
