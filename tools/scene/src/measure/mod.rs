//! Measures a scene for the tables of the command line tool.
//!
//! Sums are f64, in the order of the bodies. A body whose shape is not in `shapes` is left out; a
//! step refuses it.

mod energy;
mod momentum;
mod penetration;

use zynq_pgs::{Body, Collision, Shape};

pub use energy::{
    KineticEnergy, kinetic_energy, kinetic_energy_before_gravity, kinetic_energy_parts,
    moving_mass, potential_energy,
};
pub use momentum::{Momentum, momentum};
pub use penetration::{Penetration, carry_along, penetration};

use crate::GROUND;

/// Number of collisions with the ground.
#[must_use]
pub fn ground_pairs(collisions: &[Collision]) -> usize {
    collisions.iter().filter(|c| c.body_a == GROUND || c.body_b == GROUND).count()
}

/// The moving bodies, each with its shape.
fn moving<'a>(
    bodies: &'a [Body],
    shapes: &'a [Shape],
) -> impl Iterator<Item = (&'a Body, &'a Shape)> {
    bodies.iter().filter_map(|body| {
        let shape = shapes.get(usize::try_from(body.shape).ok()?)?;
        (shape.inverse_mass != 0.0).then_some((body, shape))
    })
}

/// 1 / inverse; 0 for a body that does not move or turn, and so has no energy and no momentum.
fn inverted(inverse: f32) -> f64 {
    if inverse == 0.0 { 0.0 } else { 1.0 / f64::from(inverse) }
}

/// Rows of the rotation matrix of a quaternion x, y, z, w, which need not be of length 1: world =
/// matrix * body.
fn rotation([x, y, z, w]: [f32; 4]) -> [[f64; 3]; 3] {
    let [x, y, z, w] = [x, y, z, w].map(f64::from);
    let s = 2.0 / (((x * x + y * y) + z * z) + w * w);
    [
        [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
        [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
        [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
    ]
}

/// Transforms a vector from body to world axes.
fn to_world(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| dot(row, v))
}

/// Transforms a vector from world to body axes.
fn to_body(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| (rows[0][k] * v[0] + rows[1][k] * v[1]) + rows[2][k] * v[2])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_y_carries_z_to_x_and_back() {
        // Twice the unit quaternion: the length does not matter.
        let rows = rotation([0.0, 2.0_f32.sqrt(), 0.0, 2.0_f32.sqrt()]);
        let world = to_world(&rows, [0.0, 0.0, 1.0]);
        let body = to_body(&rows, [1.0, 0.0, 0.0]);
        for (value, wanted) in world.into_iter().chain(body).zip([1.0, 0.0, 0.0, 0.0, 0.0, 1.0]) {
            assert!((value - wanted).abs() < 1e-12, "{world:?} {body:?}");
        }
    }
}
