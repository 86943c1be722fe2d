//! Loads or makes the collisions to be ordered: from a folder, a pile of spheres or a pile of
//! cubes.

use std::path::Path;

use scene::Spheres;
use zynq_pgs::emulation::Build;
use zynq_pgs::order::{InputBuffers, OrderInput};
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use super::OrderArgs;
use crate::permutation;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Failure, Result};
use pgs_command::pile;
use pgs_command::step_input;
use step_folder::folder::Folder;

/// Collisions to be ordered.
pub(super) struct Source {
    pub(super) name: String,
    /// A permutation of the collisions.
    pub(super) gpu_order: Option<Vec<u32>>,
    buffers: InputBuffers,
}

impl Source {
    /// Loads or makes the collisions that the command line asks for.
    pub(super) fn load(args: &OrderArgs, common: &CommonArgs) -> Result<Self> {
        if let Some(path) = &args.input {
            return Self::folder(path);
        }
        if let Some(count) = args.spheres {
            let spheres = Spheres::new(count, args.seed).map_err(Failure::input)?;
            let name = format!("{count} spheres, seed {}", args.seed);
            return Ok(Self::new(
                name,
                spheres.bodies(),
                spheres.collisions(),
                spheres.shapes(),
                None,
            ));
        }
        Self::grid(args, common)
    }

    fn new(
        name: String,
        bodies: &[Body],
        collisions: &[Collision],
        shapes: &[Shape],
        gpu_order: Option<Vec<u32>>,
    ) -> Self {
        let mut buffers = InputBuffers::new();
        buffers.gather(bodies, collisions, shapes);
        Self { name, gpu_order, buffers }
    }

    fn folder(path: &Path) -> Result<Self> {
        let folder = step_input::load(path)?;
        let gpu_order = permutation::recorded(path, folder.collisions.len())?;
        let Folder { bodies, collisions, shapes, .. } = folder;
        Ok(Self::new(path.display().to_string(), &bodies, &collisions, &shapes, gpu_order))
    }

    /// Cubes, after some steps on the board.
    fn grid(args: &OrderArgs, common: &CommonArgs) -> Result<Self> {
        let scene = if args.steps == 0 {
            let mut scene = pile::build(args.grid, args.drop)?;
            scene.detect();
            scene
        } else {
            let (mut scene, mut opened) =
                pile::open(args.grid, args.drop, common, &Build::default())?;
            let parameters = StepParameters::default();
            pile::step_to(&mut scene, &mut opened, &parameters, args.steps, || true)?;
            scene
        };
        let name =
            format!("{} cubes dropped from {} m, step {}", args.grid, args.drop, args.steps + 1);
        Ok(Self::new(name, scene.bodies(), scene.collisions(), scene.shapes(), None))
    }

    pub(super) fn input(&self) -> OrderInput<'_> {
        self.buffers.input()
    }

    /// Number of moving bodies.
    pub(super) fn moving(&self) -> usize {
        self.input().moving.iter().filter(|moving| **moving).count()
    }

    /// Average number of collisions of a moving body.
    pub(super) fn touches(&self) -> f64 {
        let input = self.input();
        let uses = input.pairs.iter().flatten().filter(|body| {
            let body = usize::try_from(**body).ok();
            body.and_then(|body| input.moving.get(body)).is_some_and(|moving| *moving)
        });
        uses.count() as f64 / (self.moving() as f64).max(1.0)
    }
}
