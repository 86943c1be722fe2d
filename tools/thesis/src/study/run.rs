//! Steps one run of a study: its bodies, and the order of its collisions.

use scene::{Scene, kinetic_energy};
use zynq_pgs::{Body, Collision, Shape, StepParameters, StepReport};

use crate::permutation::{Arranger, Permutation};
use crate::session::Session;
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::{Failure, Result};
use pgs_command::step_input;
use step_folder::folder::Folder;

/// The bodies and collisions of a run.
#[derive(Debug)]
pub(crate) enum World<'a> {
    /// A scene, whose collisions are detected.
    Scene(Box<Scene>),
    /// One step from a folder, without the shapes' geometry.
    Folder { folder: &'a Folder, bodies: Vec<Body> },
}

impl World<'_> {
    pub(crate) fn bodies(&self) -> &[Body] {
        match self {
            Self::Scene(scene) => scene.bodies(),
            Self::Folder { bodies, .. } => bodies,
        }
    }

    pub(crate) fn shapes(&self) -> &[Shape] {
        match self {
            Self::Scene(scene) => scene.shapes(),
            Self::Folder { folder, .. } => &folder.shapes,
        }
    }

    /// Makes a failure of the driver's error; for a folder, with the array at fault.
    pub(crate) fn failure(&self, opened: &OpenBoard, error: zynq_pgs::Error) -> Failure {
        let folder = match self {
            Self::Scene(_) => None,
            Self::Folder { folder, .. } => Some(*folder),
        };
        step_input::failure(folder, opened, error)
    }

    /// The collisions of the next step; a folder's are the same at any time.
    pub(crate) fn collisions(&mut self) -> Vec<Collision> {
        match self {
            Self::Scene(scene) => scene.detect().to_vec(),
            Self::Folder { folder, .. } => folder.collisions.clone(),
        }
    }
}

/// A run.
#[derive(Debug)]
pub(crate) struct Run<'a> {
    pub(crate) world: World<'a>,
    /// None if the collisions stay as given.
    arranger: Option<Arranger>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        world: World<'a>,
        permutation: Option<Permutation>,
        recorded: Option<Vec<u32>>,
    ) -> Self {
        Self { world, arranger: permutation.map(|order| Arranger::new(order, recorded)) }
    }

    /// Takes a step with the collisions that were detected last.
    pub(crate) fn take(
        &mut self,
        opened: &mut OpenBoard,
        parameters: &StepParameters,
    ) -> Result<StepReport, zynq_pgs::Error> {
        let Self { world, arranger } = self;
        let shapes = if arranger.is_some() { world.shapes().to_vec() } else { Vec::new() };
        let (bodies, collisions) = match world {
            World::Scene(scene) => scene.parts_mut(),
            World::Folder { folder, bodies } => (&mut bodies[..], &folder.collisions[..]),
        };
        let collisions = match arranger {
            Some(arranger) => arranger.arrange(bodies, &shapes, collisions),
            None => collisions,
        };
        opened.accelerator.step(bodies, collisions, parameters)
    }

    /// Detects the collisions and takes a step; false if Ctrl-C ended it.
    pub(super) fn step(
        &mut self,
        opened: &mut OpenBoard,
        parameters: &StepParameters,
        session: &Session,
    ) -> Result<bool> {
        if session.is_interrupted() {
            return Ok(false);
        }
        if let World::Scene(scene) = &mut self.world {
            scene.detect();
        }
        match self.take(opened, parameters) {
            Ok(_) => {
                opened.alive()?;
                session.advance();
                Ok(true)
            }
            Err(error) if board::is_cancelled(&error) => Ok(false),
            Err(error) => Err(self.world.failure(opened, error)),
        }
    }

    /// Takes a step by a function of bodies and collisions instead of a board; false if Ctrl-C
    /// ended it.
    pub(super) fn step_by(
        &mut self,
        session: &Session,
        step: impl FnOnce(&mut [Body], &[Collision]) -> Result<(), String>,
    ) -> Result<bool> {
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
        self.world.bodies()
    }

    /// J.
    pub(super) fn kinetic_energy(&self) -> f64 {
        kinetic_energy(self.bodies(), self.world.shapes())
    }
}
