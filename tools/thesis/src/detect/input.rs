//! Checks that a folder holds bodies and collisions that can be compared.

use pgs_command::failure::{Failure, Result};
use step_folder::folder::{
    BODY_INVERSE_MASS, COLLISION_BODIES, COLLISION_COUNT, COLLISION_NORMAL, COLLISION_POINTS,
    Folder,
};
use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision};

/// How far the length of a unit normal may lie from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Refuses what a file of the folder holds.
fn refused(folder: &Folder, file: &str, problem: &str) -> Failure {
    Failure::input(format!("{}: {problem}", folder.path.join(file).display()))
}

/// A folder with a static ground and moving cubes.
#[derive(Debug)]
pub(super) struct Input(Folder);

impl Input {
    /// Refuses other static bodies than body 0. The scene checks poses.
    pub(super) fn new(folder: Folder) -> Result<Self> {
        let refused = |problem: String| Err(refused(&folder, BODY_INVERSE_MASS, &problem));
        for (body, Body { shape, .. }) in folder.bodies.iter().enumerate() {
            let shape = usize::try_from(*shape).ok().and_then(|shape| folder.shapes.get(shape));
            let inverse_mass = shape.map_or(0.0, |shape| shape.inverse_mass);
            let is_static = inverse_mass == 0.0;
            if body == 0 && !is_static {
                return refused(format!(
                    "expected body 0 to be static, the ground, found an inverse mass of \
                     {inverse_mass}: put it first"
                ));
            }
            if body > 0 && is_static {
                return refused(format!(
                    "expected one static body, the ground, found body {body} with inverse mass 0: \
                     leave it out, or give it a mass"
                ));
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
    pub(super) fn check_collisions(&self) -> Result<()> {
        let bodies = self.0.bodies.len();
        let mut pairs = std::collections::BTreeSet::new();
        for (collision, found) in self.0.collisions.iter().enumerate() {
            let refused = |file, problem: String| {
                Err(refused(&self.0, file, &format!("collision {collision}{problem}")))
            };
            let (a, b) = (found.body_a, found.body_b);
            let is_body = |index: u32| usize::try_from(index).is_ok_and(|index| index < bodies);
            if a == b || !is_body(a) || !is_body(b) {
                let problem = format!(
                    ": expected two different bodies below {bodies}, found {a} and {b}: take poses \
                     and collisions of one step"
                );
                return refused(COLLISION_BODIES, problem);
            }
            if !pairs.insert((a.min(b), a.max(b))) {
                let problem =
                    format!(": bodies {a} and {b} are in an earlier collision, too: join the two");
                return refused(COLLISION_BODIES, problem);
            }
            let used = usize::try_from(found.count).ok().and_then(|n| found.contacts.get(..n));
            let Some(used) = used else {
                let problem = format!(
                    ": expected at most {CONTACT_POINTS} points, found {}: leave the others out",
                    found.count
                );
                return refused(COLLISION_COUNT, problem);
            };
            let [x, y, z] = found.normal;
            let length = ((x * x + y * y) + z * z).sqrt();
            // False for a NaN.
            let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
            if !used.is_empty() && !is_unit {
                let problem = format!(
                    ": expected a normal of length 1, found {:?}: divide it by its length",
                    found.normal
                );
                return refused(COLLISION_NORMAL, problem);
            }
            for (point, contact) in used.iter().enumerate() {
                let [x, y, z] = contact.point;
                let found = [x, y, z, contact.distance];
                if !found.iter().all(|value| value.is_finite()) {
                    let problem = format!(
                        ", point {point}: expected finite numbers, found {found:?}: correct them"
                    );
                    return refused(COLLISION_POINTS, problem);
                }
            }
        }
        Ok(())
    }
}
