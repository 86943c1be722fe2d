//! Makes the measured step, from a folder of arrays or a pile, and takes it on emulated boards.

use std::error::Error;
use std::path::Path;

use bitstream_model::{BoardConfig, EmulatedBoard};
use scene::{Scene, SceneOptions};
use step_folder::folder::Folder;
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Orderer, Schedule};
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, OpenOptions, Shape, StepParameters, StepReport,
};

use crate::options::Pile;

/// The input of one step.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its name in the output.
    pub name: String,
    /// The shape table.
    pub shapes: Vec<Shape>,
    /// The bodies before the step.
    pub bodies: Vec<Body>,
    /// The collisions, in the order of detection.
    pub collisions: Vec<Collision>,
    /// The parameters.
    pub parameters: StepParameters,
}

/// Opens an emulated board; packing and unpacking use as many threads as the board may.
fn open(config: BoardConfig, shapes: &[Shape]) -> Result<Accelerator, Box<dyn Error>> {
    let board = BoardChoice::Emulated(EmulatedBoard::new(config)?.cpu_port());
    let pack_threads = Some(config.threads);
    let options = OpenOptions { board, pack_threads, ..Default::default() };
    let mut accelerator = Accelerator::open(options)?;
    accelerator.set_shapes(shapes)?;
    Ok(accelerator)
}

impl Step {
    /// The step in a folder.
    ///
    /// # Errors
    /// If the folder does not hold one.
    pub fn load(path: &Path) -> Result<Self, Box<dyn Error>> {
        let Folder { bodies, shapes, collisions, parameters, .. } = Folder::load(path)?;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Ok(Self { name, shapes, bodies, collisions, parameters })
    }

    /// The last step of a pile; the steps before it are taken on the emulated board.
    ///
    /// # Errors
    ///
    /// There is no such pile, or a step fails.
    pub fn of_pile(pile: &Pile, config: BoardConfig) -> Result<Self, Box<dyn Error>> {
        let Pile { grid, drop, steps } = *pile;
        let mut scene = Scene::new(&SceneOptions { grid, drop })?;
        let mut accelerator = open(config, scene.shapes())?;
        let parameters = StepParameters::thesis();
        let mut sent = parameters;
        sent.order = Some(Order::HazardFree);
        scene.detect();
        for _ in 1..steps {
            let (bodies, collisions) = scene.parts_mut();
            accelerator.step(bodies, collisions, &sent)?;
            scene.detect();
        }
        Ok(Self {
            name: format!("step {steps} of {grid} cubes dropped from {drop} m"),
            shapes: scene.shapes().to_vec(),
            bodies: scene.bodies().to_vec(),
            collisions: scene.collisions().to_vec(),
            parameters,
        })
    }

    /// The order `hazard-free` for a board of this build.
    ///
    /// # Errors
    ///
    /// There is no such order.
    pub fn schedule(&self, config: BoardConfig) -> Result<Schedule, Box<dyn Error>> {
        let accelerator = open(config, &self.shapes)?;
        let window = IssueWindow::of(accelerator.capabilities())?;
        let mut buffers = InputBuffers::new();
        let input = buffers.gather(&self.bodies, &self.collisions, &self.shapes);
        Ok(Orderer::new().order(&input, Order::HazardFree, window)?.clone())
    }

    /// The collisions in the order `hazard-free`, as a board of this build gets them.
    ///
    /// # Errors
    ///
    /// There is no such order.
    pub fn in_order(&self, config: BoardConfig) -> Result<Vec<Collision>, Box<dyn Error>> {
        let schedule = self.schedule(config)?;
        let entries = (0..schedule.len()).filter_map(|entry| schedule.get(entry));
        Ok(entries.map(|index| self.collisions[index]).collect())
    }
}

/// An emulated board that takes the same step repeatedly, in the order `hazard-free`.
#[derive(Debug)]
pub struct Emulated<'a> {
    step: &'a Step,
    accelerator: Accelerator,
    parameters: StepParameters,
    bodies: Vec<Body>,
}

impl<'a> Emulated<'a> {
    /// Opens a board of this build.
    ///
    /// # Errors
    ///
    /// It cannot be built.
    pub fn new(step: &'a Step, config: BoardConfig) -> Result<Self, Box<dyn Error>> {
        let mut parameters = step.parameters;
        parameters.order = Some(Order::HazardFree);
        let accelerator = open(config, &step.shapes)?;
        Ok(Self { step, accelerator, parameters, bodies: Vec::new() })
    }

    /// Takes the step from its start.
    ///
    /// # Errors
    ///
    /// The step fails.
    pub fn take(&mut self) -> Result<StepReport, Box<dyn Error>> {
        self.bodies.clone_from(&self.step.bodies);
        let collisions = &self.step.collisions;
        Ok(self.accelerator.step(&mut self.bodies, collisions, &self.parameters)?)
    }

    /// The bodies after the last step.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }
}
