//! Steps one run of a study: its bodies, and the order of its collisions.

use scene::{Scene, kinetic_energy};
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use super::start::Start;
use crate::permutation::{Arranger, Permutation};
use crate::session::Session;
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::Failure;
use step_folder::folder::Folder;

/// The bodies and collisions of a run.
#[derive(Debug)]
pub(super) enum World<'a> {
    /// A scene, whose collisions are detected before each step.
    Scene(Box<Scene>),
    /// One step from a folder.
    Folder { folder: &'a Folder, bodies: Vec<Body> },
}

/// A run.
#[derive(Debug)]
pub(super) struct Run<'a> {
    world: World<'a>,
    /// None if the collisions stay as given.
    arranger: Option<Arranger>,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        world: World<'a>,
        permutation: Option<Permutation>,
        recorded: Option<Vec<u32>>,
    ) -> Self {
        Self { world, arranger: permutation.map(|order| Arranger::new(order, recorded)) }
    }

    /// Takes a step; false if Ctrl-C ended it.
    pub(super) fn step(
        &mut self,
        opened: &mut OpenBoard,
        parameters: &StepParameters,
        session: &Session,
        start: &Start<'_>,
    ) -> Result<bool, Failure> {
        if session.is_interrupted() {
            return Ok(false);
        }
        let shapes = start.shapes();
        let stepped = match &mut self.world {
            World::Scene(scene) => {
                scene.detect();
                let (bodies, collisions) = scene.parts_mut();
                let collisions = arranged(&mut self.arranger, bodies, shapes, collisions);
                opened.accelerator.step(bodies, collisions, parameters)
            }
            World::Folder { folder, bodies } => {
                let collisions = arranged(&mut self.arranger, bodies, shapes, &folder.collisions);
                opened.accelerator.step(bodies, collisions, parameters)
            }
        };
        match stepped {
            Ok(_) => {
                opened.alive()?;
                session.advance();
                Ok(true)
            }
            Err(error) if board::is_cancelled(&error) => Ok(false),
            Err(error) => Err(start.failure(opened, error)),
        }
    }

    /// Takes a step by a function of bodies and collisions instead of a board; false if Ctrl-C ended
    /// it.
    pub(super) fn step_by(
        &mut self,
        session: &Session,
        step: impl FnOnce(&mut [Body], &[Collision]) -> Result<(), String>,
    ) -> Result<bool, Failure> {
        if session.is_interrupted() {
            return Ok(false);
        }
        let stepped = match &mut self.world {
            World::Scene(scene) => {
                scene.detect();
                let (bodies, collisions) = scene.parts_mut();
                step(bodies, collisions)
            }
            World::Folder { folder, bodies } => step(bodies, &folder.collisions),
        };
        stepped.map_err(Failure::input)?;
        session.advance();
        Ok(true)
    }

    pub(super) fn bodies(&self) -> &[Body] {
        match &self.world {
            World::Scene(scene) => scene.bodies(),
            World::Folder { bodies, .. } => bodies,
        }
    }

    /// The collisions of the next step; a folder's are the same at any time.
    pub(super) fn collisions(&mut self) -> Vec<Collision> {
        match &mut self.world {
            World::Scene(scene) => scene.detect().to_vec(),
            World::Folder { folder, .. } => folder.collisions.clone(),
        }
    }

    /// J.
    pub(super) fn kinetic_energy(&self, start: &Start<'_>) -> f64 {
        kinetic_energy(self.bodies(), start.shapes())
    }
}

fn arranged<'c>(
    arranger: &'c mut Option<Arranger>,
    bodies: &[Body],
    shapes: &[Shape],
    collisions: &'c [Collision],
) -> &'c [Collision] {
    match arranger {
        Some(arranger) => arranger.arrange(bodies, shapes, collisions),
        None => collisions,
    }
}
