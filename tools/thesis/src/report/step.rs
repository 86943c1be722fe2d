//! The step that the report measures: a folder's, or a step of our own pile.

use std::path::Path;

use zynq_pgs::{Body, Collision, Shape, StepParameters};

use super::AllArgs;
use super::studies::{Effort, quoted};
use pgs_command::common::CommonArgs;
use pgs_command::failure::Failure;
use pgs_command::options::scenes::DROP;
use pgs_command::pile;
use pgs_command::step_input;
use step_folder::folder::Folder;
use zynq_pgs::emulation::Build;

/// Depth of the pipeline at which orders are compared, issue slots.
pub(super) const DEPTH: u32 = 64;

/// A folder as the report names it: as it was given, or only its name. A report is passed on, and the
/// folders of its author's machine mean nothing to its readers.
pub(super) fn shown(folder: &Path) -> String {
    let name = folder.file_name().filter(|_| folder.is_absolute());
    name.map_or(folder, Path::new).display().to_string()
}

/// The input of a step.
#[derive(Debug)]
pub(super) struct Step {
    /// The step for people, such as "the step in `tests/golden/pile5_step60`".
    pub(super) name: String,
    /// Options of other verbs that take the same step.
    options: Options,
    pub(super) bodies: Vec<Body>,
    pub(super) shapes: Vec<Shape>,
    pub(super) collisions: Vec<Collision>,
}

#[derive(Debug)]
enum Options {
    Folder(String),
    Pile { grid: String, steps: u32 },
}

impl Step {
    pub(super) fn folder(path: &Path) -> Result<Self, Failure> {
        let Folder { bodies, shapes, collisions, .. } = step_input::load(path)?;
        let shown = shown(path);
        let name = format!("the step in {shown}");
        Ok(Self { name, options: Options::Folder(shown), bodies, shapes, collisions })
    }

    /// A step of our own pile, after the steps before it on the emulated board.
    pub(super) fn of_pile(
        args: &AllArgs,
        common: &CommonArgs,
        effort: &Effort<'_>,
    ) -> Result<Self, Failure> {
        let grid = args.pile();
        let (mut scene, mut opened) = pile::open(grid, DROP, common, &Build::default())?;
        let (parameters, before) = (StepParameters::default(), args.step.saturating_sub(1));
        let go_on = || effort.go_on().is_ok();
        pile::step_to(&mut scene, &mut opened, &parameters, before, go_on)?;
        effort.go_on()?;
        Ok(Self {
            name: format!("step {} of our pile of {grid} cubes", args.step),
            options: Options::Pile { grid: grid.to_string(), steps: args.step },
            bodies: scene.bodies().to_vec(),
            shapes: scene.shapes().to_vec(),
            collisions: scene.collisions().to_vec(),
        })
    }

    /// The command by which `pgs thesis formats` measures this step.
    pub(super) fn formats_command(&self) -> String {
        self.command("pgs thesis formats", |step| format!("--step {step}"))
    }

    /// The command by which `pgs thesis order` measures this step; it counts the steps before.
    pub(super) fn order_command(&self) -> String {
        let command = self.command("pgs thesis order", |step| {
            format!("--drop {DROP} --steps {}", step.saturating_sub(1))
        });
        format!("{command} --depth {DEPTH}")
    }

    fn command(&self, verb: &str, step: impl Fn(u32) -> String) -> String {
        match &self.options {
            Options::Folder(path) => format!("{verb} --input {}", quoted(path)),
            Options::Pile { grid, steps } => format!("{verb} --grid {grid} {}", step(*steps)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_names_no_folder_above_that_of_the_step() {
        let names = ["tests/golden/two_cubes", "/home/somebody/two_cubes/", "/"];
        let found = names.map(|name| shown(Path::new(name)));
        assert_eq!(found, ["tests/golden/two_cubes", "two_cubes", "/"]);
    }
}
