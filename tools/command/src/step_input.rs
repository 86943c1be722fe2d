//! Loads a step from a folder, and names the array that the driver refuses.

use std::path::Path;

use thiserror::Error;
use zynq_pgs::validate::{Excess, InputItem, OutOfRange};
use zynq_pgs::{Accelerator, InputError, Shape};

use crate::board::OpenBoard;
use crate::failure::{Failure, Result};
use step_folder::folder::{
    BODY_ANGULAR, BODY_INVERSE_INERTIA, BODY_INVERSE_MASS, BODY_LINEAR, BODY_ORIENTATION,
    BODY_POSITION, COLLISION_BODIES, COLLISION_COUNT, COLLISION_NORMAL, COLLISION_POINTS, Folder,
    ITERATIONS, PARAMS,
};

/// Loads the step in a folder named on the command line.
///
/// # Errors
///
/// Fails where an array is missing or has another shape.
pub fn load(path: &Path) -> Result<Folder> {
    Folder::load(path).map_err(|error| {
        Failure::input(error).next("`pgs solve --help` lists the arrays of a folder")
    })
}

/// Loads the shapes of a scene. One without bodies has none, and needs none.
///
/// # Errors
///
/// Fails where the driver refuses a shape.
pub fn set_shapes(accelerator: &mut Accelerator, shapes: &[Shape]) -> Result<(), zynq_pgs::Error> {
    if shapes.is_empty() { Ok(()) } else { accelerator.set_shapes(shapes) }
}

/// Input that the driver refused, with the file that holds it.
#[derive(Debug, Error)]
#[error("{place}")]
pub struct Located {
    place: String,
    #[source]
    source: zynq_pgs::Error,
}

/// Names the array, and for a shape the first body with it.
pub fn locate(source: zynq_pgs::Error, folder: &Folder) -> Located {
    let place = match &source {
        zynq_pgs::Error::Input(input) => place(input, &folder.path, &folder.shape_bodies),
        _ => folder.path.display().to_string(),
    };
    Located { place, source }
}

/// Makes a failure of the driver's error; for a folder's step, with the array at fault.
pub fn failure(folder: Option<&Folder>, opened: &OpenBoard, error: zynq_pgs::Error) -> Failure {
    match folder {
        Some(folder) if error.is_input() => Failure::input(locate(error, folder)),
        _ => opened.failure(error),
    }
}

fn place(error: &InputError, folder: &Path, shape_bodies: &[usize]) -> String {
    let file = folder.join(file_of(error)).display().to_string();
    let shape = match error {
        InputError::ShapeValue { shape, .. }
        | InputError::StaticShapeRotates { shape, .. }
        | InputError::BeyondBitstream {
            excess:
                Excess::Anisotropic { shape, .. }
                | Excess::OutOfRange(OutOfRange { item: InputItem::Shape(shape), .. }),
            ..
        } => Some(*shape),
        _ => None,
    };
    match shape.and_then(|shape| shape_bodies.get(shape)) {
        Some(body) => format!("{file}: the shape of body {body}"),
        None => file,
    }
}

/// The array that holds a refused value.
fn file_of(error: &InputError) -> &'static str {
    match error {
        InputError::BeyondBitstream { excess, .. } => file_of_excess(excess),
        InputError::BodyNotFinite { field, .. } | InputError::StaticBodyMoves { field, .. } => {
            file_of_body(field)
        }
        InputError::Orientation { .. } => BODY_ORIENTATION,
        InputError::ShapeIndex { .. }
        | InputError::NoShapes
        | InputError::TooManyShapes { .. }
        | InputError::ShapeValue { field: "inverse mass", .. } => BODY_INVERSE_MASS,
        InputError::ShapeValue { .. } | InputError::StaticShapeRotates { .. } => {
            BODY_INVERSE_INERTIA
        }
        InputError::BodyIndex { .. }
        | InputError::SelfCollision { .. }
        | InputError::BothStatic { .. }
        | InputError::Order(_) => COLLISION_BODIES,
        InputError::ContactCount { .. } => COLLISION_COUNT,
        InputError::NormalNotFinite { .. }
        | InputError::NormalZero { .. }
        | InputError::NormalLength { .. } => COLLISION_NORMAL,
        InputError::ContactNotFinite { .. } => COLLISION_POINTS,
        InputError::Parameter { .. } => PARAMS,
        InputError::TooManyIterations { .. } => ITERATIONS,
        // Errors of later versions of the driver.
        _ => BODY_POSITION,
    }
}

/// The array that holds a value beyond the bitstream.
fn file_of_excess(excess: &Excess) -> &'static str {
    match excess {
        Excess::OutOfRange(OutOfRange { item, field, .. }) => match item {
            InputItem::Body(_) => file_of_body(field),
            InputItem::Shape(_) if *field == "inverse mass" => BODY_INVERSE_MASS,
            InputItem::Shape(_) => BODY_INVERSE_INERTIA,
            InputItem::Collision(_, Some(_)) => COLLISION_POINTS,
            InputItem::Parameters { .. } => PARAMS,
            // Positions of bodies, constraint rows. A normal of unit length is always in range.
            _ => BODY_POSITION,
        },
        Excess::Anisotropic { .. } => BODY_INVERSE_INERTIA,
        Excess::TooManyCollisions { .. }
        | Excess::MemoryExceeded { .. }
        | Excess::OrderTooLong { .. } => COLLISION_BODIES,
        // Too many bodies.
        _ => BODY_POSITION,
    }
}

/// The array that holds a field of the bodies.
fn file_of_body(field: &str) -> &'static str {
    match field {
        "orientation" => BODY_ORIENTATION,
        "linear velocity" => BODY_LINEAR,
        "angular velocity" => BODY_ANGULAR,
        _ => BODY_POSITION,
    }
}
