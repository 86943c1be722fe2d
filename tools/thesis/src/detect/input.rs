//! Checks that a folder holds bodies and collisions that can be compared.

use std::path::PathBuf;

use step_folder::folder::{
    BODY_INVERSE_MASS, COLLISION_BODIES, COLLISION_COUNT, COLLISION_NORMAL, COLLISION_POINTS,
    Folder,
};
use thiserror::Error;
use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision};

/// How far the length of a unit normal may lie from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// A folder whose collisions cannot be detected or compared.
#[derive(Debug, Error)]
#[error("{}: {problem}", path.display())]
pub(super) struct InputError {
    path: PathBuf,
    problem: Problem,
}

#[derive(Debug, Error)]
enum Problem {
    #[error(
        "expected body 0 to be static, the ground, found an inverse mass of {found}: put it first"
    )]
    GroundMoves { found: f32 },
    #[error(
        "expected one static body, the ground, found body {body} with inverse mass 0: leave it \
         out, \
         or give it a mass"
    )]
    OtherStatic { body: usize },
    #[error(
        "collision {collision}: expected two different bodies below {bodies}, found {a} and {b}: \
         take poses and collisions of one step"
    )]
    Bodies { collision: usize, bodies: usize, a: u32, b: u32 },
    #[error(
        "collision {collision}: bodies {a} and {b} are in an earlier collision, too: join the two"
    )]
    Again { collision: usize, a: u32, b: u32 },
    #[error(
        "collision {collision}: expected at most {CONTACT_POINTS} points, found {found}: leave \
         the others out"
    )]
    Count { collision: usize, found: u32 },
    #[error(
        "collision {collision}: expected a normal of length 1, found {found:?}: divide it by its \
         length"
    )]
    Normal { collision: usize, found: [f32; 3] },
    #[error(
        "collision {collision}, point {point}: expected finite numbers, found {found:?}: correct \
         them"
    )]
    Point { collision: usize, point: usize, found: [f32; 4] },
}

/// A folder with a static ground and moving cubes.
#[derive(Debug)]
pub(super) struct Input(Folder);

impl Input {
    /// Refuses other static bodies than body 0. The scene checks poses.
    pub(super) fn new(folder: Folder) -> Result<Self, InputError> {
        let refused = |problem| InputError { path: folder.path.join(BODY_INVERSE_MASS), problem };
        for (body, Body { shape, .. }) in folder.bodies.iter().enumerate() {
            let shape = usize::try_from(*shape).ok().and_then(|shape| folder.shapes.get(shape));
            let inverse_mass = shape.map_or(0.0, |shape| shape.inverse_mass);
            let is_static = inverse_mass == 0.0;
            if body == 0 && !is_static {
                return Err(refused(Problem::GroundMoves { found: inverse_mass }));
            }
            if body > 0 && is_static {
                return Err(refused(Problem::OtherStatic { body }));
            }
        }
        Ok(Self(folder))
    }

    pub(super) fn bodies(&self) -> &[Body] {
        &self.0.bodies
    }

    pub(super) fn collisions(&self) -> &[Collision] {
        &self.0.collisions
    }

    /// Refuses collisions that belong to other bodies, or are none.
    pub(super) fn check_collisions(&self) -> Result<(), InputError> {
        let bodies = self.0.bodies.len();
        let mut pairs = std::collections::BTreeSet::new();
        for (collision, found) in self.0.collisions.iter().enumerate() {
            let refused = |file, problem| Err(InputError { path: self.0.path.join(file), problem });
            let (a, b) = (found.body_a, found.body_b);
            let is_body = |index: u32| usize::try_from(index).is_ok_and(|index| index < bodies);
            if a == b || !is_body(a) || !is_body(b) {
                return refused(COLLISION_BODIES, Problem::Bodies { collision, bodies, a, b });
            }
            if !pairs.insert((a.min(b), a.max(b))) {
                return refused(COLLISION_BODIES, Problem::Again { collision, a, b });
            }
            let used = usize::try_from(found.count).ok().and_then(|n| found.contacts.get(..n));
            let Some(used) = used else {
                let problem = Problem::Count { collision, found: found.count };
                return refused(COLLISION_COUNT, problem);
            };
            let [x, y, z] = found.normal;
            let length = ((x * x + y * y) + z * z).sqrt();
            // False for a NaN.
            let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
            if !used.is_empty() && !is_unit {
                let problem = Problem::Normal { collision, found: found.normal };
                return refused(COLLISION_NORMAL, problem);
            }
            for (point, contact) in used.iter().enumerate() {
                let [x, y, z] = contact.point;
                let found = [x, y, z, contact.distance];
                if !found.iter().all(|value| value.is_finite()) {
                    let problem = Problem::Point { collision, point, found };
                    return refused(COLLISION_POINTS, problem);
                }
            }
        }
        Ok(())
    }
}
