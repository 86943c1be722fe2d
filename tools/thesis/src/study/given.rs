//! The input of one step: of a folder, or of a scene after some steps.

use std::path::Path;

use pgs_command::board::OpenBoard;
use pgs_command::failure::Result;
use pgs_command::{pile, step_input};
use scene::Scene;
use step_folder::folder::Folder;
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use crate::session::Session;

/// The input of a step.
#[derive(Debug)]
pub(crate) struct GivenStep {
    /// None for a scene's.
    pub(crate) folder: Option<Folder>,
    pub(crate) bodies: Vec<Body>,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) collisions: Vec<Collision>,
    pub(crate) parameters: StepParameters,
}

impl GivenStep {
    /// The step of a folder.
    pub(crate) fn folder(path: &Path) -> Result<Self> {
        let folder = step_input::load(path)?;
        Ok(Self {
            bodies: folder.bodies.clone(),
            shapes: folder.shapes.clone(),
            collisions: folder.collisions.clone(),
            parameters: folder.parameters,
            folder: Some(folder),
        })
    }

    /// The step of a scene behind others on the board; none if Ctrl-C ended them.
    pub(crate) fn after(
        steps: u32,
        mut scene: Scene,
        opened: &mut OpenBoard,
        parameters: StepParameters,
        session: &Session,
    ) -> Result<Option<Self>> {
        opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
        session.watch(opened);
        session.expect(steps.into());
        let taken = pile::step_to(&mut scene, opened, &parameters, steps, || {
            session.advance();
            !session.is_interrupted()
        })?;
        Ok(taken.then(|| Self {
            folder: None,
            bodies: scene.bodies().to_vec(),
            shapes: scene.shapes().to_vec(),
            collisions: scene.collisions().to_vec(),
            parameters,
        }))
    }
}
