//! Integration of one body over one time step.
//!
//! Source: Bullet (integrateTransforms of the OpenCL pipeline): position first, then gravity.

use super::arithmetic::number::{Format, Number};
use super::arithmetic::vector::Vec3;
use super::state::{Pose, Velocity};
use pgs_interface::profile::solver::{ROTATION_LIMIT, SERIES_BELOW, SERIES_TERM};

/// Parameters of the integration.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Integration {
    pub(crate) time_step: f32,
    pub(crate) angular_damping: f32,
    pub(crate) gravity: [f32; 3],
}

impl Integration {
    /// The integration of a body of inverse mass 0, whose velocity nothing changes.
    pub(crate) fn undamped(&self) -> Self {
        Self { angular_damping: 1.0, gravity: [0.0; 3], ..*self }
    }
}

/// The state of a moving body one time step later.
pub(crate) fn integrate<U: Format>(
    parameters: &Integration,
    pose: &Pose,
    velocity: &Velocity,
) -> (Pose, Velocity) {
    let n = Number::<U>::new;
    let dt = n(parameters.time_step);
    let half = n(0.5);
    let v = Vec3::<U>::new(velocity.linear);
    let w = Vec3::<U>::new(velocity.angular) * n(parameters.angular_damping);
    let position = Vec3::<U>::new(pose.position) + v * dt;

    let mut speed = w.dot(w).sqrt();
    if (speed * dt).above(n(ROTATION_LIMIT)) {
        speed = n(ROTATION_LIMIT) / dt;
    }
    let rotation = if n(SERIES_BELOW).above(speed) {
        w * (half * dt - ((((dt * dt) * dt) * n(SERIES_TERM)) * speed) * speed)
    } else {
        w * (n(libm::sinf(((half * speed) * dt).value())) / speed)
    };
    let (Vec3(x, y, z), c) = (rotation, n(libm::cosf(((speed * dt) * half).value())));
    let [qx, qy, qz, qw] = pose.orientation.map(n);
    let rx = ((c * qx + x * qw) + y * qz) - z * qy;
    let ry = ((c * qy + y * qw) + z * qx) - x * qz;
    let rz = ((c * qz + z * qw) + x * qy) - y * qx;
    let rw = ((c * qw - x * qx) - y * qy) - z * qz;
    let scale = n(1.0) / (((rx * rx + ry * ry) + rz * rz) + rw * rw).sqrt();
    let orientation = [rx, ry, rz, rw].map(|r| (r * scale).value());

    let linear = v + Vec3::<U>::new(parameters.gravity) * dt;
    let velocity = Velocity { linear: linear.values(), angular: w.values() };
    (Pose { position: position.values(), orientation }, velocity)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the expected values are exact")]
mod tests {
    use super::*;
    use crate::accelerator::arithmetic::number::Single;

    const AT_ORIGIN: Pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
    const STEP: Integration =
        Integration { time_step: 0.5, angular_damping: 1.0, gravity: [0.0, -8.0, 0.0] };

    #[test]
    fn the_position_moves_with_the_velocity_before_gravity() {
        let velocity = Velocity { linear: [1.0, 2.0, 0.0], angular: [0.0; 3] };
        let (pose, after) = integrate::<Single>(&STEP, &AT_ORIGIN, &velocity);
        assert_eq!(pose.position, [0.5, 1.0, 0.0]);
        assert_eq!(after.linear, [1.0, -2.0, 0.0]);
        assert_eq!(pose.orientation, AT_ORIGIN.orientation);
    }

    #[test]
    fn a_fast_spin_turns_a_quarter_of_pi_and_keeps_its_velocity() {
        let velocity = Velocity { linear: [0.0; 3], angular: [0.0, 1000.0, 0.0] };
        let (pose, after) = integrate::<Single>(&STEP, &AT_ORIGIN, &velocity);
        assert_eq!(after.angular, [0.0, 1000.0, 0.0]);
        let [x, y, z, w] = pose.orientation;
        assert_eq!([x, z], [0.0, 0.0]);
        assert!((y * y + w * w - 1.0).abs() < 1e-6);
    }
}
