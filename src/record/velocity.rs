//! This file makes the velocity record of a body.

use super::vec3_and_word;
use crate::interface::record::{Beat, velocity};
use crate::scene::Body;

/// The velocity record: linear velocity beside the shape index, angular velocity beside 0.
///
/// Shape: 2 beats. Units: m/s, rad/s, world frame.
///
/// Source: interface specification, record table.
#[inline]
pub(crate) fn encode(body: &Body) -> [Beat; velocity::ROWS] {
    let mut beats = [Beat::default(); velocity::ROWS];
    beats[velocity::LINEAR] = vec3_and_word(body.velocity.linear, body.shape);
    beats[velocity::ANGULAR] = vec3_and_word(body.velocity.angular, 0);
    beats
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pose, Velocity};

    #[test]
    fn a_velocity_record_is_these_bytes() {
        let body = Body {
            pose: Pose { position: [9.0; 3], orientation: [9.0; 4] },
            velocity: Velocity { linear: [1.0, -2.0, 0.5], angular: [3.0, 0.25, -0.0] },
            shape: 0x0102_0304,
        };
        let bytes: [u8; 32] = [
            0x00, 0x00, 0x80, 0x3F, // v.x 1.0
            0x00, 0x00, 0x00, 0xC0, // v.y -2.0
            0x00, 0x00, 0x00, 0x3F, // v.z 0.5
            0x04, 0x03, 0x02, 0x01, // shape
            0x00, 0x00, 0x40, 0x40, // w.x 3.0
            0x00, 0x00, 0x80, 0x3E, // w.y 0.25
            0x00, 0x00, 0x00, 0x80, // w.z -0.0
            0x00, 0x00, 0x00, 0x00,
        ];
        assert_eq!(bytemuck::bytes_of(&encode(&body)), bytes);
    }
}
