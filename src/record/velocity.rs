//! This file makes the velocity record of a body.

use super::inertia::Inverse;
use super::{ANGULAR, LINEAR, Words, row_of, vec3_and_word};
use crate::interface::record::velocity;
use crate::platform::Lanes;
use crate::scene::Body;

/// Rows whose word is an unsigned integer: the shape.
pub(crate) const WORDS: Words<{ velocity::ROWS }> = {
    let mut integers = [false; velocity::ROWS];
    integers[velocity::LINEAR] = true;
    Words { integers, bodies: None }
};

/// Rows whose word is an unsigned integer in a record with world inertia.
pub(crate) const WORLD_WORDS: Words<{ velocity::WORLD_ROWS }> = {
    let mut integers = [false; velocity::WORLD_ROWS];
    integers[velocity::LINEAR] = true;
    Words { integers, bodies: None }
};

/// The velocity record: linear velocity beside the shape index, angular velocity beside 0.
///
/// Shape: 2 rows. Units: m/s, rad/s, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(body: &Body) -> [Lanes; velocity::ROWS] {
    let mut rows = [Lanes::all(0); velocity::ROWS];
    rows[velocity::LINEAR] = row_of::<LINEAR, _>(body).beside(body.shape);
    rows[velocity::ANGULAR] = row_of::<ANGULAR, _>(body).beside(0);
    rows
}

/// The velocity record with world inertia: the two rows above, and the inverse inertia of the body.
///
/// Shape: 4 rows. Units: m/s, rad/s, 1/(kg m²), world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode_world(body: &Body, inertia: &Inverse) -> [Lanes; velocity::WORLD_ROWS] {
    let [linear, angular] = encode(body);
    let mut rows = [Lanes::all(0); velocity::WORLD_ROWS];
    rows[velocity::LINEAR] = linear;
    rows[velocity::ANGULAR] = angular;
    rows[velocity::DIAGONAL] = vec3_and_word(inertia.diagonal, 0);
    rows[velocity::OFF_DIAGONAL] = vec3_and_word(inertia.off_diagonal, 0);
    rows
}

const _: () = assert!(velocity::LINEAR == 0 && velocity::ANGULAR == 1);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::record::Beat;
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
        assert_eq!(bytemuck::bytes_of(&encode(&body).map(Beat::from)), bytes);
    }
    #[test]
    fn world_inertia_follows_the_velocities() {
        let body = Body {
            pose: Pose { position: [9.0; 3], orientation: [9.0; 4] },
            velocity: Velocity { linear: [1.0, -2.0, 0.5], angular: [3.0, 0.25, -0.0] },
            shape: 5,
        };
        let inertia = Inverse { diagonal: [1.0, 2.0, 3.0], off_diagonal: [-0.5, 0.25, 4.0] };
        let rows = encode_world(&body, &inertia).map(Beat::from);
        assert_eq!(rows[..2], encode(&body).map(Beat::from));
        assert_eq!(rows[2], Beat([0x3F80_0000, 0x4000_0000, 0x4040_0000, 0]));
        assert_eq!(rows[3], Beat([0xBF00_0000, 0x3E80_0000, 0x4080_0000, 0]));
    }
}
