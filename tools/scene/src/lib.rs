//! The box-on-plane scene of the thesis and a scene of several shapes, with collision detection.
//!
//! A grid of cubes above a plane, as Bullet's demo `box on plane` builds it. A [`Scene`] holds the
//! bodies and the collisions of their current poses; the accelerator steps them:
//!
//! ```
//! use scene::{Grid, Scene, SceneOptions};
//!
//! let options = SceneOptions { grid: "3x2x3".parse::<Grid>()?, drop: 0.0 };
//! let mut scene = Scene::new(&options)?;
//! assert_eq!(scene.detect().len(), 9 + 25); // on the ground, and one layer on the other
//! let (bodies, collisions) = scene.parts_mut();
//! // accelerator.step(bodies, collisions, &StepParameters::default())?;
//! # assert_eq!((bodies.len(), collisions.len()), (19, 34));
//! # Ok::<(), scene::SceneError>(())
//! ```
//!
//! [`Scene::of_shapes`] is a pile of cubes, spheres, boxes, capsules, cylinders and convex hulls of
//! several masses instead, and [`Scene::of_cubes`] has any poses.
//!
//! The bits of every result are the same on every architecture and with every number of threads:
//! arithmetic is f32 in a written order, parry3d is built with `enhanced-determinism`, and neither
//! threads nor state kept from an earlier detection decide an order. Building scenes and detecting
//! collisions use the standard floating-point environment, whatever the caller's is.

mod build;
mod detect;
mod error;
#[cfg(test)]
mod fixtures;
mod geometry;
mod grid;
mod hull;
mod measure;
mod poses;
mod rotation;
mod shapes;
mod warm_start;

pub use build::{DROP_MAX, Scene, SceneOptions};
pub use detect::{DetectionTimes, MARGIN};
pub use error::SceneError;
pub use geometry::Geometry;
pub use grid::Grid;
pub use hull::faces as hull_faces;
pub use measure::{
    KineticEnergy, Momentum, Penetration, carry_along, ground_pairs, kinetic_energy,
    kinetic_energy_before_gravity, kinetic_energy_parts, momentum, moving_mass, penetration,
    potential_energy,
};
pub use pgs_support::random::SplitMix64;
pub use shapes::{SHAPE_FRICTIONS, ShapesOptions};
pub use warm_start::WarmStart;

/// Index of the static ground among the bodies.
pub const GROUND: u32 = 0;

/// Half the edge of a cube, m.
pub const CUBE_HALF_EXTENT: f32 = 1.0;

/// Half the edge of the ground's box, m. Its top is the plane y = 0.
pub const GROUND_HALF_EXTENT: f32 = 400.0;
