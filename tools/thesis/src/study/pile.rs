//! Figure 4.1: the pile, as a picture and as a page that plays its fall.

use bitstream_model::BoardConfig;
use clap::Args;
use scene::Grid;
use zynq_pgs::StepParameters;
use zynq_pgs_view::Recording;
use zynq_pgs_view::page::page;
use zynq_pgs_view::picture::Picture;

use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::figure::Figure;
use crate::session::Session;
use pgs_command::board;
use pgs_command::failure::{Failure, Result};
use pgs_command::numbers::grouped;
use pgs_command::options::scenes::{DROP, ITERATIONS, STEPS};
use pgs_command::options::solver::time_of;
use pgs_command::pile;

/// Steps from one frame of the playback to the next.
const EVERY: u32 = 2;

/// The experiment.
pub(crate) static PILE: Experiment = Experiment::of::<Options>(
    "pile",
    "§4.3, Figure 4.1",
    Boards::Own,
    "The cubes after their fall, and the collisions of their heaviest step",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
pub(crate) struct Options {
    /// Cubes of the pile along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value_t)]
    grid: Grid,
}

/// A number and its noun.
fn counted(count: u64, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(count))
}

impl Measure for Options {
    fn measure(&self, session: &Session) -> Result<Part> {
        let grid = self.grid;
        let (mut scene, mut opened) =
            pile::open(grid, DROP, &session.emulated(), BoardConfig::default())?;
        session.watch(&mut opened);
        // As `pgs run`, whose defaults the printed command takes.
        let [steps, _] = STEPS;
        let parameters = StepParameters::thesis()
            .with_contact_iterations(ITERATIONS)
            .with_friction_iterations(ITERATIONS);
        let mut recording = Recording::new(scene.bodies(), scene.geometries());
        recording.add(0, 0.0, scene.bodies()).map_err(Failure::input)?;
        let mut most = 0;
        session.expect(steps.into());
        for step in 1..=steps {
            if session.is_interrupted() {
                return Ok(Part::interrupted());
            }
            most = most.max(scene.detect().len());
            let (bodies, collisions) = scene.parts_mut();
            match opened.accelerator.step(bodies, collisions, &parameters) {
                Ok(_) => session.advance(),
                Err(error) if board::is_cancelled(&error) => continue,
                Err(error) => return Err(opened.failure(error)),
            }
            if step.is_multiple_of(EVERY) {
                let time = time_of(step, parameters.time_step);
                recording.add(step, time, scene.bodies()).map_err(Failure::input)?;
            }
        }
        session.end();
        let cubes = counted(recording.bodies() as u64, "cube");
        let title = format!("{cubes} falling on the ground");
        let facts = [("scene", format!("{grid} cubes, dropped from {DROP} m, {steps} steps"))];
        let mut figure = Figure::new(
            ("figure-4-1", "§4.3, Figure 4.1"),
            format!("A snapshot of the scene: {cubes} after {steps} steps"),
            Picture::of(&recording).svg().map_err(Failure::input)?,
            "The thesis shows a snapshot of Bullet's demo with 38,880 cubes.",
        );
        figure.playback = Some(page(&recording, &title, &facts).map_err(Failure::input)?.html);
        let mut row = figure.row(
            "cubes, and collisions of a heavy step",
            "38,880 cubes, 90,000 to 130,000 collisions",
            format!("{cubes}, up to {}", counted(most as u64, "collision")),
        );
        row.command = format!(
            "pgs run --grid {grid} --fps {} --view pile.html --picture pile.png",
            60 / EVERY
        );
        let mut part = Part::of(Vec::new());
        part.figure(figure, [row]);
        Ok(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cube_is_no_cubes() {
        assert_eq!([1, 2].map(|count| counted(count, "cube")), ["1 cube", "2 cubes"]);
    }
}
