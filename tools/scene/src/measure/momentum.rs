//! Measures the momentum of a scene.

use zynq_pgs::{Body, Shape};

use super::{cross, inverted, moving, rotation, to_body, to_world};

/// Total momentum of the moving bodies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Momentum {
    /// N s.
    pub linear: [f64; 3],
    /// About the origin, N m s: from the bodies' motion and their spin.
    pub angular: [f64; 3],
}

/// Total momentum of the moving bodies.
#[must_use]
pub fn momentum(bodies: &[Body], shapes: &[Shape]) -> Momentum {
    let mut total = Momentum::default();
    for (body, shape) in moving(bodies, shapes) {
        let mass = inverted(shape.inverse_mass);
        let linear = body.velocity.linear.map(|v| mass * f64::from(v));
        let orbital = cross(body.pose.position.map(f64::from), linear);
        let w = body.velocity.angular.map(f64::from);
        let inertia = shape.inverse_inertia.map(inverted);
        let spin = if shape.is_isotropic() {
            w.map(|w| w * inertia[0])
        } else {
            let rows = rotation(body.pose.orientation);
            let [x, y, z] = to_body(&rows, w);
            to_world(&rows, [x * inertia[0], y * inertia[1], z * inertia[2]])
        };
        for axis in 0..3 {
            total.linear[axis] += linear[axis];
            total.angular[axis] += orbital[axis] + spin[axis];
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    fn near(found: [f64; 3], wanted: [f64; 3]) {
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-6, "{found} for {wanted}");
        }
    }

    #[test]
    fn momentum_is_of_motion_about_the_origin_and_of_spin() {
        let half = 0.5_f32.sqrt();
        let pose = Pose { position: [2.0, 0.0, 0.0], orientation: [half, 0.0, 0.0, half] };
        let velocity = Velocity { linear: [0.0, 3.0, 0.0], angular: [0.0, 5.0, 0.0] };
        let shapes = [
            Shape::STATIC,
            Shape::isotropic(0.25, 0.5),
            Shape { inverse_inertia: [1.0, 0.5, 0.25], ..Shape::isotropic(0.25, 0.0) },
        ];
        let of = |shape| momentum(&[Body { pose, velocity, shape }], &shapes);
        assert_eq!(of(0), Momentum::default());
        // 4 kg: 12 N s along y at x = 2 m are 24 N m s about z; the spin 2 kg m² * 5 rad/s.
        near(of(1).linear, [0.0, 12.0, 0.0]);
        near(of(1).angular, [0.0, 10.0, 24.0]);
        // The body's z lies along the world's -y: 4 kg m².
        near(of(2).angular, [0.0, 20.0, 24.0]);
    }

    #[test]
    fn opposite_bodies_have_no_momentum() {
        let body = |sign: f32| Body {
            pose: Pose { position: [sign, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity { linear: [sign * 2.0, 0.0, 0.0], angular: [0.0, 0.0, sign] },
            shape: 0,
        };
        let total = momentum(&[body(1.0), body(-1.0)], &[Shape::isotropic(1.0, 1.0)]);
        near(total.linear, [0.0; 3]);
        near(total.angular, [0.0; 3]);
    }
}
