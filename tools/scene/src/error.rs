//! The errors of building a scene.

use zynq_pgs::Pose;
use zynq_pgs::scene::ShapeError;

/// Why a scene could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The text is not a grid.
    #[error(
        "expected a grid as three numbers of cubes joined by \"x\", such as 36x30x36, \
         found {found:?}"
    )]
    GridSyntax {
        /// The text.
        found: String,
    },
    /// A side of the grid is empty or too long.
    #[error("expected 1 to {most} cubes along {axis}, found {found}: {reason}")]
    GridSide {
        /// x, y or z.
        axis: char,
        /// Cubes asked for.
        found: u64,
        /// Most cubes along that axis.
        most: u16,
        /// The reason for the limit.
        reason: &'static str,
    },
    /// No scene can start from this height above the ground.
    #[error("expected a drop of 0 to {most} m, found {found} m")]
    Drop {
        /// Height asked for, m.
        found: f32,
        /// Largest height, m.
        most: f32,
    },
    /// Body 0 is not the ground.
    #[error(
        "expected body 0 to be the ground, with its centre at [0.0, {:?}, 0.0] and the orientation \
         [0.0, 0.0, 0.0, 1.0], found {}",
        -crate::GROUND_HALF_EXTENT,
        found.map_or_else(
            || "no bodies".to_owned(),
            |pose| format!("a body at {:?}, turned by {:?}", pose.position, pose.orientation)
        )
    )]
    Ground {
        /// Its pose; none without bodies.
        found: Option<Pose>,
    },
    /// A position is not finite, or an orientation has not the length 1.
    #[error("body {body}: expected {what}, found {found:?}")]
    Pose {
        /// Index of the body.
        body: usize,
        /// The expectation.
        what: &'static str,
        /// The numbers, m for a position.
        found: Vec<f32>,
    },
    /// The sizes or the mass of a body are out of range.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}
