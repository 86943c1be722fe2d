//! Measures the energy of a scene.

use zynq_pgs::{Body, Shape};

use super::{dot, inverted, moving, rotation, to_body};

/// Kinetic energy of the moving bodies, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KineticEnergy {
    /// m v²/2.
    pub translational: f64,
    /// w²/(2 x inverse inertia), each component of w about the body's own axis.
    pub rotational: f64,
}

impl KineticEnergy {
    /// Both together, J.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.translational + self.rotational
    }
}

/// Kinetic energy of the moving bodies, J, by kind.
///
/// A body that cannot turn about an axis (inverse inertia 0) has no energy about it.
#[must_use]
pub fn kinetic_energy_parts(bodies: &[Body], shapes: &[Shape]) -> KineticEnergy {
    kinetic_energy_less([0.0; 3], bodies, shapes)
}

/// Kinetic energy of the velocities that moved the bodies in the last step, J, by kind.
///
/// A step moves a body by v dt and then adds g dt to v. Without this addition a body at rest has no
/// energy.
#[must_use]
pub fn kinetic_energy_before_gravity(
    bodies: &[Body],
    shapes: &[Shape],
    gravity: [f32; 3],
    time_step: f32,
) -> KineticEnergy {
    // The product, rounded as in the step.
    kinetic_energy_less(gravity.map(|g| f64::from(g * time_step)), bodies, shapes)
}

/// Kinetic energy with `addition` subtracted from each linear velocity, m/s.
fn kinetic_energy_less(addition: [f64; 3], bodies: &[Body], shapes: &[Shape]) -> KineticEnergy {
    let mut energy = KineticEnergy::default();
    for (body, shape) in moving(bodies, shapes) {
        let v = [0, 1, 2].map(|k| f64::from(body.velocity.linear[k]) - addition[k]);
        energy.translational += dot(v, v) * inverted(shape.inverse_mass) / 2.0;
        let w = body.velocity.angular.map(f64::from);
        let inertia = shape.inverse_inertia.map(inverted);
        energy.rotational += if shape.is_isotropic() {
            dot(w, w) * inertia[0] / 2.0
        } else {
            let [x, y, z] = to_body(&rotation(body.pose.orientation), w);
            dot([x * x, y * y, z * z], inertia) / 2.0
        };
    }
    energy
}

/// Kinetic energy of the moving bodies, J.
#[must_use]
pub fn kinetic_energy(bodies: &[Body], shapes: &[Shape]) -> f64 {
    kinetic_energy_parts(bodies, shapes).total()
}

/// Mass of the moving bodies, kg.
#[must_use]
pub fn moving_mass(bodies: &[Body], shapes: &[Shape]) -> f64 {
    moving(bodies, shapes).map(|(_, shape)| inverted(shape.inverse_mass)).sum()
}

/// Potential energy of the moving bodies in a uniform field, J: -m g.p, nothing at the origin.
#[must_use]
pub fn potential_energy(bodies: &[Body], shapes: &[Shape], gravity: [f32; 3]) -> f64 {
    let gravity = gravity.map(f64::from);
    moving(bodies, shapes).fold(0.0, |energy, (body, shape)| {
        let position = body.pose.position.map(f64::from);
        energy - inverted(shape.inverse_mass) * dot(gravity, position)
    })
}

#[cfg(test)]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    const LEVEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
    const VELOCITY: Velocity = Velocity { linear: [1.0, 2.0, 2.0], angular: [0.0, 4.0, 0.0] };

    fn body(shape: u32, orientation: [f32; 4]) -> Body {
        Body { pose: Pose { position: [3.0, 5.0, 7.0], orientation }, velocity: VELOCITY, shape }
    }

    #[test]
    fn energy_counts_moving_bodies_only() {
        let shapes = [Shape::STATIC, Shape::isotropic(0.5, 2.0)];
        let bodies = [body(0, LEVEL), body(1, LEVEL), body(7, LEVEL)];
        // 2 kg: 2 * 9 / 2 = 9 J; inertia 0.5 kg m²: 0.5 * 16 / 2 = 4 J.
        let parts = kinetic_energy_parts(&bodies, &shapes);
        assert!((parts.translational - 9.0).abs() < 1e-12, "{parts:?}");
        assert!((parts.rotational - 4.0).abs() < 1e-12, "{parts:?}");
        assert!((kinetic_energy(&bodies, &shapes) - 13.0).abs() < 1e-12);
    }

    #[test]
    fn a_body_at_rest_has_no_energy_before_gravity() {
        let shapes = [Shape::STATIC, Shape::isotropic(0.5, 2.0)];
        let (gravity, time_step) = ([0.0, -9.8, 0.0], 1.0 / 60.0);
        let mut resting = body(1, LEVEL);
        resting.velocity = Velocity { linear: [0.0, -9.8 * time_step, 0.0], angular: [0.0; 3] };
        let bodies = [resting];
        let energy = kinetic_energy_before_gravity(&bodies, &shapes, gravity, time_step);
        assert_eq!(energy.total().to_bits(), 0.0_f64.to_bits());
        assert!(kinetic_energy(&bodies, &shapes) > 0.02);
        // 2 kg that moved at 3 m/s.
        let moved = [body(1, LEVEL)];
        let energy = kinetic_energy_before_gravity(&moved, &shapes, [0.0, 2.0, 0.0], 1.0);
        assert!((energy.translational - 5.0).abs() < 1e-12, "{energy:?}");
    }

    #[test]
    fn mass_counts_moving_bodies_only() {
        let shapes = [Shape::STATIC, Shape::isotropic(0.5, 2.0)];
        let bodies = [body(0, LEVEL), body(1, LEVEL), body(1, LEVEL), body(7, LEVEL)];
        assert!((moving_mass(&bodies, &shapes) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_body_turns_about_its_own_axes() {
        // Inertia 1, 2 and 4 kg m²; the spin is about the world's y.
        let shapes = [Shape { inverse_inertia: [1.0, 0.5, 0.25], ..Shape::isotropic(1.0, 0.0) }];
        let half = 0.5_f32.sqrt();
        for (orientation, inertia) in [
            (LEVEL, 2.0),
            // A quarter turn about x brings the body's z to the world's -y,
            ([half, 0.0, 0.0, half], 4.0),
            // one about z its x to the world's y.
            ([0.0, 0.0, half, half], 1.0),
        ] {
            let energy = kinetic_energy_parts(&[body(0, orientation)], &shapes).rotational;
            assert!((energy - inertia * 8.0).abs() < 1e-9, "{orientation:?}: {energy}");
        }
    }

    #[test]
    fn a_body_that_cannot_turn_has_no_energy_of_rotation() {
        let shapes = [Shape::isotropic(1.0, 0.0)];
        let parts = kinetic_energy_parts(&[body(0, LEVEL)], &shapes);
        assert_eq!(parts.rotational.to_bits(), 0.0_f64.to_bits());
    }

    #[test]
    fn potential_energy_is_weight_times_height() {
        let shapes = [Shape::STATIC, Shape::isotropic(0.5, 2.0)];
        let bodies = [body(0, LEVEL), body(1, LEVEL)];
        // 2 kg, 5 m up.
        let energy = potential_energy(&bodies, &shapes, [0.0, -10.0, 0.0]);
        assert!((energy - 100.0).abs() < 1e-12, "{energy}");
        let sideways = potential_energy(&bodies, &shapes, [1.0, 0.0, 0.0]);
        assert!((sideways + 6.0).abs() < 1e-12, "{sideways}");
    }
}
