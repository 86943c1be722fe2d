//! Reads one step from a folder of arrays, and writes its results beside them.
//!
//! One array a file: `params` (8) and `iterations` (2); per body `body_pos` (N, 3), `body_quat` (N,
//! 4), `body_linvel`, `body_angvel` (N, 3), `body_inv_mass` (N), `body_inv_inertia` (N, 3); per
//! collision `contact_bodies` (M, 2), `contact_npoints` (M), `contact_normal` (M, 3),
//! `contact_points` (M, 4, 4). The type is f32, except u32 for `iterations`, `contact_bodies` and
//! `contact_npoints`. An array without rows may have the shape (0,) and any type, as
//! `numpy.array([])` has.
//!
//! This module checks the files' form only; the driver judges their values.

use std::collections::HashMap;
use std::io::{BufWriter, ErrorKind, Read, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;
use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision, Contact, Pose, Shape, StepParameters, Velocity};

use crate::npy::{self, Dimensions, Element, NpyError, Problem};
use crate::replace::{ReplaceError, Replacement};

/// Parameters of the step without its iterations: (8). Time step, position drift, position
/// coefficient, friction, angular damping, gravity x, y, z.
pub const PARAMS: &str = "params.npy";
/// Contact and friction iterations: (2).
pub const ITERATIONS: &str = "iterations.npy";
/// Centres of mass: (N, 3).
pub const BODY_POSITION: &str = "body_pos.npy";
/// Quaternions x, y, z, w: (N, 4).
pub const BODY_ORIENTATION: &str = "body_quat.npy";
/// Linear velocities: (N, 3).
pub const BODY_LINEAR: &str = "body_linvel.npy";
/// Angular velocities: (N, 3).
pub const BODY_ANGULAR: &str = "body_angvel.npy";
/// Inverse masses: (N).
pub const BODY_INVERSE_MASS: &str = "body_inv_mass.npy";
/// Diagonals of the inverse inertia: (N, 3).
pub const BODY_INVERSE_INERTIA: &str = "body_inv_inertia.npy";
/// Indices of bodies A and B: (M, 2).
pub const COLLISION_BODIES: &str = "contact_bodies.npy";
/// Numbers of contact points: (M).
pub const COLLISION_COUNT: &str = "contact_npoints.npy";
/// Unit normals, from B to A: (M, 3).
pub const COLLISION_NORMAL: &str = "contact_normal.npy";
/// Contact points: (M, 4, 4). x, y, z on B's surface, and the signed distance of A's surface,
/// negative for penetration.
pub const COLLISION_POINTS: &str = "contact_points.npy";

/// The folder has more shapes than the board's table holds.
#[derive(Debug, Error)]
#[error(
    "{}: body {body} brings another mass or inertia, {found} different ones in all, and the board \
     takes at most {limit}",
    path.display()
)]
pub struct TooManyShapes {
    path: PathBuf,
    body: usize,
    found: usize,
    limit: usize,
}

/// The step in a folder.
#[derive(Debug)]
pub struct Folder {
    /// Its path.
    pub path: PathBuf,
    /// The bodies, with indices into `shapes`.
    pub bodies: Vec<Body>,
    /// The distinct rows of mass and inertia, in the order of their first body.
    pub shapes: Vec<Shape>,
    /// The first body of each shape.
    pub shape_bodies: Vec<usize>,
    /// The collisions.
    pub collisions: Vec<Collision>,
    /// The parameters of the step.
    pub parameters: StepParameters,
}

/// A property of a body that a step changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Centre of mass.
    Position,
    /// Quaternion.
    Orientation,
    /// Linear velocity.
    Linear,
    /// Angular velocity.
    Angular,
}

impl State {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Position, Self::Orientation, Self::Linear, Self::Angular];

    /// The file of the property after the step.
    #[must_use]
    pub const fn file(self) -> &'static str {
        match self {
            Self::Position => "out_pos.npy",
            Self::Orientation => "out_quat.npy",
            Self::Linear => "out_linvel.npy",
            Self::Angular => "out_angvel.npy",
        }
    }

    /// Numbers per body.
    #[must_use]
    pub const fn width(self) -> usize {
        match self {
            Self::Orientation => 4,
            Self::Position | Self::Linear | Self::Angular => 3,
        }
    }

    /// The numbers of all bodies.
    pub fn of(self, bodies: &[Body]) -> Box<dyn Iterator<Item = f32> + '_> {
        match self {
            Self::Position => Box::new(bodies.iter().flat_map(|body| body.pose.position)),
            Self::Orientation => Box::new(bodies.iter().flat_map(|body| body.pose.orientation)),
            Self::Linear => Box::new(bodies.iter().flat_map(|body| body.velocity.linear)),
            Self::Angular => Box::new(bodies.iter().flat_map(|body| body.velocity.angular)),
        }
    }
}

/// The linear and angular velocity of each body in turn, the layout of `out_vel_*`.
pub fn velocities(bodies: &[Body]) -> impl Iterator<Item = f32> {
    bodies.iter().flat_map(|body| body.velocity.linear.into_iter().chain(body.velocity.angular))
}

/// The dimensions of an array of rows: (`first`, N).
fn rows<T: Element, const N: usize>(
    read: impl Fn(&str, Dimensions) -> Result<(usize, Vec<T>), NpyError>,
    name: &str,
    first: Option<usize>,
) -> Result<Vec<[T; N]>, NpyError> {
    let (_, elements) = read(name, Dimensions(vec![first, Some(N)]))?;
    Ok(as_rows(&elements))
}

fn as_rows<T: Element, const N: usize>(elements: &[T]) -> Vec<[T; N]> {
    let (rows, rest) = elements.as_chunks();
    debug_assert!(rest.is_empty(), "the shape was checked");
    rows.to_vec()
}

impl Folder {
    /// Reads every array of the step.
    ///
    /// # Errors
    ///
    /// [`NpyError`] names the first file that is missing or not as expected.
    pub fn load(path: &Path) -> Result<Self, NpyError> {
        let problem = match std::fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => return Self::load_with(path, npy::open),
            Ok(metadata) => Problem::NotAFolder(npy::kind(&metadata)),
            Err(error) if error.kind() == ErrorKind::NotFound => Problem::NotAFolder("nothing"),
            Err(error) => Problem::Read(error),
        };
        Err(NpyError { path: path.to_path_buf(), problem })
    }

    /// Reads every array of the step from the streams that `open` returns for the files' names,
    /// with their lengths in bytes.
    ///
    /// # Errors
    ///
    /// As for [`load`](Self::load), and the errors of `open`.
    pub fn load_with<S: Read>(
        path: &Path,
        open: impl Fn(&Path) -> Result<(S, u64), Problem>,
    ) -> Result<Self, NpyError> {
        let array = |name: &str, shape| npy::read_with::<f32, S>(&path.join(name), &shape, &open);
        let numbers = |name: &str, shape| npy::read_with::<u32, S>(&path.join(name), &shape, &open);
        let one = |name: &str, n| array(name, Dimensions(vec![n]));
        let (_, params) = one(PARAMS, Some(8))?;
        let (_, iterations) = numbers(ITERATIONS, Dimensions(vec![Some(2)]))?;

        let positions: Vec<[f32; 3]> = rows(array, BODY_POSITION, None)?;
        let n = Some(positions.len());
        let orientations: Vec<[f32; 4]> = rows(array, BODY_ORIENTATION, n)?;
        let linear: Vec<[f32; 3]> = rows(array, BODY_LINEAR, n)?;
        let angular: Vec<[f32; 3]> = rows(array, BODY_ANGULAR, n)?;
        let (_, inverse_masses) = one(BODY_INVERSE_MASS, n)?;
        let inverse_inertias: Vec<[f32; 3]> = rows(array, BODY_INVERSE_INERTIA, n)?;
        let (shapes, shape_bodies, shape_of) = distinct(&inverse_masses, &inverse_inertias);
        let bodies = (0..positions.len())
            .map(|k| Body {
                pose: Pose { position: positions[k], orientation: orientations[k] },
                velocity: Velocity { linear: linear[k], angular: angular[k] },
                shape: shape_of[k],
            })
            .collect();

        let pairs: Vec<[u32; 2]> = rows(numbers, COLLISION_BODIES, None)?;
        let m = Some(pairs.len());
        let (_, counts) = numbers(COLLISION_COUNT, Dimensions(vec![m]))?;
        let normals: Vec<[f32; 3]> = rows(array, COLLISION_NORMAL, m)?;
        let shape = Dimensions(vec![m, Some(CONTACT_POINTS), Some(4)]);
        let (_, points) = array(COLLISION_POINTS, shape)?;
        let points: Vec<[f32; 4]> = as_rows(&points);
        let contacts = points.as_chunks::<CONTACT_POINTS>().0;
        let collisions = (0..pairs.len())
            .map(|k| Collision {
                body_a: pairs[k][0],
                body_b: pairs[k][1],
                normal: normals[k],
                count: counts[k],
                contacts: contacts[k]
                    .map(|[x, y, z, distance]| Contact { point: [x, y, z], distance }),
            })
            .collect();

        let mut parameters = StepParameters::thesis();
        parameters.time_step = params[0];
        parameters.position_drift = params[1];
        parameters.position_coefficient = params[2];
        parameters.friction = params[3];
        parameters.angular_damping = params[4];
        parameters.gravity = [params[5], params[6], params[7]];
        parameters.contact_iterations = iterations[0];
        parameters.friction_iterations = iterations[1];
        let path = path.to_path_buf();
        Ok(Self { path, bodies, shapes, shape_bodies, collisions, parameters })
    }

    /// Refuses more shapes than a table of `limit` entries holds, and names the first body beyond
    /// it.
    ///
    /// # Errors
    ///
    /// [`TooManyShapes`].
    pub fn check_shapes(&self, limit: u32) -> Result<(), TooManyShapes> {
        let limit = usize::try_from(limit).unwrap_or(usize::MAX);
        match self.shape_bodies.get(limit) {
            None => Ok(()),
            Some(body) => Err(TooManyShapes {
                path: self.path.join(BODY_INVERSE_MASS),
                body: *body,
                found: self.shapes.len(),
                limit,
            }),
        }
    }
}

/// The distinct rows, the first body of each, and each body's row.
///
/// Rows are equal if their bits are. The map is used for look-ups only, so that it decides no
/// order.
fn distinct(
    inverse_masses: &[f32],
    inverse_inertias: &[[f32; 3]],
) -> (Vec<Shape>, Vec<usize>, Vec<u32>) {
    let mut known: HashMap<[u32; 4], u32> = HashMap::new();
    let mut shapes = Vec::new();
    let mut first_bodies = Vec::new();
    let mut shape_of = Vec::with_capacity(inverse_masses.len());
    for (body, (mass, inertia)) in inverse_masses.iter().zip(inverse_inertias).enumerate() {
        let [x, y, z] = inertia.map(f32::to_bits);
        let index = known.entry([mass.to_bits(), x, y, z]).or_insert_with(|| {
            shapes.push(Shape { inverse_inertia: *inertia, ..Shape::isotropic(*mass, 0.0) });
            first_bodies.push(body);
            // A table has far fewer entries; `check_shapes` refuses the excess before the index is
            // used.
            u32::try_from(shapes.len() - 1).unwrap_or(u32::MAX)
        });
        shape_of.push(*index);
    }
    (shapes, first_bodies, shape_of)
}

/// Writes the state of all bodies as the four arrays of [`State`]; makes the folder if necessary.
///
/// All four replace earlier ones together: after a failure the folder is unchanged.
///
/// # Errors
///
/// [`ReplaceError`]: a file or the folder cannot be written.
pub fn write_results(path: &Path, bodies: &[Body]) -> Result<(), ReplaceError> {
    let made = first_missing(path);
    let written = write_into(path, bodies);
    if let (Err(_), Some(made)) = (&written, made) {
        // Removes empty folders only.
        for folder in path.ancestors().take_while(|folder| folder.starts_with(made)) {
            if std::fs::remove_dir(folder).is_err() {
                break;
            }
        }
    }
    written
}

/// The outermost missing folder on the path.
fn first_missing(path: &Path) -> Option<&Path> {
    let ancestors = path.ancestors().filter(|folder| !folder.as_os_str().is_empty());
    ancestors.take_while(|folder| std::fs::symlink_metadata(folder).is_err()).last()
}

fn write_into(path: &Path, bodies: &[Body]) -> Result<(), ReplaceError> {
    std::fs::create_dir_all(path)
        .map_err(|source| ReplaceError { path: path.to_path_buf(), source })?;
    let mut results = Replacement::default();
    for state in State::ALL {
        results.stage(&path.join(state.file()), |file| {
            let mut file = BufWriter::new(file);
            npy::encode(&mut file, &[bodies.len(), state.width()], state.of(bodies))?;
            file.flush()
        })?;
    }
    results.commit()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_none_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let refused = |path: &Path| Folder::load(path).expect_err("no folder").problem.to_string();
        let missing = folder.path().join("missing");
        assert_eq!(refused(&missing), "expected a folder of .npy arrays, found nothing");
        std::fs::write(&missing, "x").expect("written");
        assert_eq!(refused(&missing), "expected a folder of .npy arrays, found a file");
    }

    #[test]
    fn the_folders_that_are_made_are_those_that_were_missing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let deep = folder.path().join("a/b/c");
        assert_eq!(first_missing(&deep), Some(folder.path().join("a").as_path()));
        assert_eq!(first_missing(folder.path()), None);
        assert_eq!(first_missing(Path::new("no-such-folder/b")), Some(Path::new("no-such-folder")));
    }

    #[test]
    fn shapes_are_the_distinct_rows_in_order() {
        let masses = [0.0, 1.0, 2.0, 1.0, 1.0];
        let inertias = [[0.0; 3], [1.5; 3], [1.5; 3], [1.5; 3], [1.5, 1.5, 2.0]];
        let (shapes, first_bodies, shape_of) = distinct(&masses, &inertias);
        assert_eq!(shape_of, [0, 1, 2, 1, 3]);
        assert_eq!(first_bodies, [0, 1, 2, 4]);
        assert_eq!(shapes[3].inverse_inertia.map(f32::to_bits), [1.5, 1.5, 2.0].map(f32::to_bits));
    }
}
