//! This file measures a scene: what the tables of the command line tool show.

use zynq_pgs::{Body, Collision, Shape};

use crate::GROUND;

/// Kinetic energy of the moving bodies, J: m v²/2 + w²/(2 x inverse inertia), summed in f64 in the
/// order of the bodies.
///
/// A body whose shape is not in `shapes` is left out; a step refuses it.
#[must_use]
pub fn kinetic_energy(bodies: &[Body], shapes: &[Shape]) -> f64 {
    let mut energy = 0.0;
    for body in bodies {
        let shape = usize::try_from(body.shape).ok().and_then(|index| shapes.get(index));
        let Some(shape) = shape else { continue };
        energy += share(body.velocity.linear, shape.inverse_mass);
        energy += share(body.velocity.angular, shape.inverse_inertia[0]);
    }
    energy
}

/// Number of collisions in which the ground takes part.
#[must_use]
pub fn ground_pairs(collisions: &[Collision]) -> usize {
    collisions.iter().filter(|c| c.body_a == GROUND || c.body_b == GROUND).count()
}

/// v²/(2 x inverse), or nothing for what does not move.
fn share(velocity: [f32; 3], inverse: f32) -> f64 {
    if inverse == 0.0 {
        return 0.0;
    }
    let [x, y, z] = velocity.map(f64::from);
    ((x * x + y * y) + z * z) / (2.0 * f64::from(inverse))
}

#[cfg(test)]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    #[test]
    fn energy_counts_moving_bodies_only() {
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let velocity = Velocity { linear: [1.0, 2.0, 2.0], angular: [0.0, 4.0, 0.0] };
        let body = |shape| Body { pose, velocity, shape };
        let shapes = [Shape::STATIC, Shape::isotropic(0.5, 2.0)];
        // 2 kg: 2 * 9 / 2 = 9 J; inertia 0.5 kg m²: 0.5 * 16 / 2 = 4 J.
        let energy = kinetic_energy(&[body(0), body(1), body(7)], &shapes);
        assert!((energy - 13.0).abs() < 1e-12, "{energy}");
    }
}
