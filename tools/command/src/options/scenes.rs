//! The scene, as chosen on the command line.

use std::hint::black_box;

use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::Inertia as Form;
use clap::{Args, ValueEnum};
use scene::{Grid, SHAPE_FRICTIONS, Scene, SceneOptions, ShapesOptions};
use serde_json::{Value, json};
use step_folder::npy;
use zynq_pgs::Capabilities;
use zynq_pgs::emulation::Build;

use crate::failure::{Failure, Result};
use crate::numbers::grouped;

/// Default steps of `pgs run` for cubes, and for shapes.
pub const STEPS: [u32; 2] = [120, 600];

/// Default contact and friction iterations of its steps: enough to carry 30 layers.
pub const ITERATIONS: u32 = 10;

/// Default drop, m: the pile lands within half a second.
pub const DROP: f32 = 1.0;

/// The scene and its size.
#[derive(Debug, Clone, Args)]
pub struct SceneArgs {
    /// The falling bodies: cubes or shapes
    ///
    /// The thesis' cubes, or a pile of shapes (cubes, spheres, boxes, capsules, cylinders, convex
    /// hulls of several masses), which need a board with world inertia: `pgs run` and `pgs thesis
    /// formats` build such an emulated board themselves.
    #[arg(long, value_enum, default_value_t = SceneName::Cubes, hide_possible_values = true)]
    scene: SceneName,
    /// Bodies along each axis [default: 36x30x36 cubes, 10x10x10 shapes]
    #[arg(long, value_name = "NXxNYxNZ")]
    grid: Option<Grid>,
    /// Height of the lowest bodies at the start, m.
    #[arg(long, value_name = "H", default_value_t = DROP, value_parser = drop_height)]
    drop: f32,
    /// Seed of the shapes' kinds and orientations [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SceneName {
    Cubes,
    Shapes,
}

fn drop_height(text: &str) -> Result<f32, String> {
    let most = scene::DROP_MAX;
    match text.parse::<f32>() {
        Ok(height) if (0.0..=most).contains(&height) => Ok(height),
        _ => Err(format!("expected a height from 0 to {most} m")),
    }
}

/// Refuses a grid that no board takes, before memory is allocated for it.
///
/// # Errors
///
/// Fails where the grid has too many bodies.
pub fn check_rows(grid: Grid) -> Result<()> {
    let bodies = u64::from(grid.cubes()) + 1;
    if bodies <= npy::ROWS_MAX as u64 {
        return check_memory(grid);
    }
    let error = format!(
        "a grid of {grid} is {bodies} bodies with the ground, no board takes more than {}",
        npy::ROWS_MAX
    );
    Err(Failure::input(error).next("give a smaller --grid"))
}

/// Refuses a grid that does not fit, before memory is allocated for it.
///
/// # Errors
///
/// Fails where the grid has too many bodies for the board.
pub fn check_size(grid: Grid, capabilities: &Capabilities) -> Result<()> {
    let capacity = capabilities.body_capacity;
    if grid.cubes() < capacity {
        return check_memory(grid);
    }
    let error = format!(
        "a grid of {grid} is {} bodies with the ground, the board takes at most {capacity}",
        u64::from(grid.cubes()) + 1
    );
    Err(Failure::input(error).next("give a smaller --grid"))
}

/// Memory that a run takes for each body, bytes: 98 MB for the 38,880 cubes of the default grid.
const BODY_BYTES: usize = 2560;

/// Refuses a grid that the system has no memory for. The program would abort at some later
/// allocation.
fn check_memory(grid: Grid) -> Result<()> {
    let bytes = BODY_BYTES * grid.cubes() as usize;
    let mut room = Vec::<u8>::new();
    let reserved = room.try_reserve_exact(bytes);
    // Otherwise a compiler may leave out an allocation that nothing uses.
    black_box(&mut room);
    reserved.map_err(|_| {
        let error = format!("a grid of {grid} takes about {bytes} bytes of memory, there is less");
        Failure::input(error).next("give a smaller --grid, free memory, or raise the limit of it")
    })
}

impl SceneArgs {
    /// Builds the scene. Detection uses as many threads as the emulated board may.
    ///
    /// # Errors
    ///
    /// Fails on options of another scene, and where the bodies reach too far.
    pub fn build(&self, board: &Build) -> Result<Scene> {
        let (grid, drop) = (self.grid(), self.drop);
        let built = match self.scene {
            SceneName::Cubes if self.seed.is_some() => {
                let error = "--seed is for --scene shapes, the cubes are not placed at random";
                return Err(Failure::input(error));
            }
            SceneName::Cubes => Scene::new(&SceneOptions { grid, drop }),
            SceneName::Shapes => Scene::of_shapes(&ShapesOptions { grid, drop, seed: self.seed() }),
        };
        let mut scene = built.map_err(Failure::input)?;
        scene.set_threads(board.config().threads);
        Ok(scene)
    }

    /// Bodies along each axis.
    pub fn grid(&self) -> Grid {
        let shapes = || Grid::new(10, 10, 10).unwrap_or_default();
        self.grid.unwrap_or_else(|| if self.is_cubes() { Grid::default() } else { shapes() })
    }

    /// The configuration of an emulated board of that build, with the inertia that the shapes need
    /// unless the build names another.
    pub fn config(&self, build: &Build) -> BoardConfig {
        let inertia = (!self.is_cubes()).then_some(Form::World);
        Build { inertia: build.inertia.or(inertia), ..*build }.config()
    }

    fn seed(&self) -> u64 {
        self.seed.unwrap_or(ShapesOptions::default().seed)
    }

    /// Refuses a grid that does not fit, before memory is allocated for it.
    ///
    /// # Errors
    ///
    /// Fails where the grid has too many bodies for the board.
    pub fn check_size(&self, capabilities: &Capabilities) -> Result<()> {
        check_size(self.grid(), capabilities)
    }

    /// Gives the shapes their frictions, which a step takes from each collision.
    ///
    /// # Errors
    ///
    /// Fails on cubes, which have one friction.
    pub fn give_frictions(&self, scene: &mut Scene) -> Result<()> {
        if self.is_cubes() {
            let error = "--pair-friction is for --scene shapes, the cubes have one friction";
            return Err(Failure::input(error));
        }
        scene.set_frictions(&SHAPE_FRICTIONS);
        Ok(())
    }

    /// Whether these are the thesis' cubes.
    pub fn is_cubes(&self) -> bool {
        self.scene == SceneName::Cubes
    }

    /// The scene for people.
    pub fn text(&self) -> String {
        let (grid, drop) = (self.grid(), self.drop);
        let what = match self.scene {
            SceneName::Cubes => format!("cubes ({grid})"),
            SceneName::Shapes => {
                format!("bodies of six shapes ({grid}, seed {})", self.seed())
            }
        };
        let count = grouped(grid.cubes().into());
        format!("{count} {what} on a static ground, dropped from {drop} m")
    }

    /// The scene for programs.
    pub fn to_json(&self) -> Value {
        let cubes = self.is_cubes();
        json!({
            "scene": if cubes { "cubes" } else { "shapes" },
            "grid": self.grid().to_string(),
            "drop_m": self.drop,
            "inertia": cubes.then_some("bullet"),
            "seed": (!cubes).then(|| self.seed()),
        })
    }
}
