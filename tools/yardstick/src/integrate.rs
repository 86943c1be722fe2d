//! Moves a body by one time step: position first, then gravity.

use zynq_pgs::{Pose, StepParameters};

use super::Moving;
use super::vector::{add, dot, scale};

/// Largest rotation in a step, rad: a quarter of Bullet's pi, which is not the nearest f32.
#[allow(clippy::approx_constant, reason = "Bullet's constant")]
const ROTATION_LIMIT: f32 = 0.25 * 3.141_592_5;
/// Speed below which the sine is taken from its series, rad/s.
const SERIES_BELOW: f32 = 0.001;
/// Its third term, 1/48.
const SERIES_TERM: f32 = 0.020_833_334;

pub(super) fn integrate(parameters: &StepParameters, pose: &mut Pose, body: &mut Moving) {
    let dt = parameters.time_step;
    let w = scale(body.angular, parameters.angular_damping);
    let mut speed = dot(w, w).sqrt();
    if speed * dt > ROTATION_LIMIT {
        speed = ROTATION_LIMIT / dt;
    }
    let [x, y, z] = if speed < SERIES_BELOW {
        scale(w, 0.5 * dt - ((((dt * dt) * dt) * SERIES_TERM) * speed) * speed)
    } else {
        scale(w, libm::sinf((0.5 * speed) * dt) / speed)
    };
    let c = libm::cosf((speed * dt) * 0.5);
    let [qx, qy, qz, qw] = pose.orientation;
    let turned = [
        ((c * qx + x * qw) + y * qz) - z * qy,
        ((c * qy + y * qw) + z * qx) - x * qz,
        ((c * qz + z * qw) + x * qy) - y * qx,
        ((c * qw - x * qx) - y * qy) - z * qz,
    ];
    let [rx, ry, rz, rw] = turned;
    let length = (((rx * rx + ry * ry) + rz * rz) + rw * rw).sqrt();
    pose.orientation = turned.map(|r| r * (1.0 / length));
    pose.position = add(pose.position, scale(body.linear, dt));
    body.linear = add(body.linear, scale(parameters.gravity, dt));
    body.angular = w;
}
