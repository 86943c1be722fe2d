//! Makes the velocity record of a body.

use super::inertia::Inverse;
use super::{ANGULAR, LINEAR, Record, SHAPE, row_of, vec3_and_word};
use crate::scene::Body;
use crate::simd::{Integer, Lanes};
use pgs_interface::record::velocity;

/// The velocity record: linear velocity beside the shape index, angular velocity beside 0.
///
/// Shape: 2 rows. Units: m/s, rad/s, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(body: &Body) -> Record<{ velocity::ROWS }> {
    let mut record = Record::from([Lanes::all(0); velocity::ROWS]);
    let angular_and_shape = row_of::<ANGULAR, _>(body);
    record.rows[velocity::LINEAR] = row_of::<LINEAR, _>(body);
    record.integers[velocity::LINEAR] = Some(Integer::new::<SHAPE>(angular_and_shape));
    record.rows[velocity::ANGULAR] = angular_and_shape.beside(0);
    record
}

/// The velocity record with world inertia: the rows of [`encode`], and the inverse inertia of the
/// body, beside which its inverse mass stands; that is 0 where masses are not streamed.
///
/// Shape: 4 rows. Units: m/s, rad/s, 1/(kg m²), 1/kg, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode_world(
    body: &Body,
    inertia: &Inverse,
    inverse_mass: f32,
) -> Record<{ velocity::WORLD_ROWS }> {
    let Record { rows: [linear, angular], integers } = encode(body);
    let mut record = Record::from([Lanes::all(0); velocity::WORLD_ROWS]);
    record.rows[velocity::LINEAR] = linear;
    record.rows[velocity::ANGULAR] = angular;
    [record.integers[velocity::LINEAR], record.integers[velocity::ANGULAR]] = integers;
    record.rows[velocity::DIAGONAL] = vec3_and_word(inertia.diagonal, inverse_mass.to_bits());
    record.rows[velocity::OFF_DIAGONAL] = vec3_and_word(inertia.off_diagonal, 0);
    record
}

const _: () = assert!(velocity::LINEAR == 0 && velocity::ANGULAR == 1);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pose, Velocity};
    use pgs_interface::record::Beat;

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
        assert_eq!(bytemuck::bytes_of(&encode(&body).whole().map(Beat::from)), bytes);
    }
    #[test]
    fn world_inertia_follows_the_velocities() {
        let body = Body {
            pose: Pose { position: [9.0; 3], orientation: [9.0; 4] },
            velocity: Velocity { linear: [1.0, -2.0, 0.5], angular: [3.0, 0.25, -0.0] },
            shape: 5,
        };
        let inertia = Inverse { diagonal: [1.0, 2.0, 3.0], off_diagonal: [-0.5, 0.25, 4.0] };
        let rows = encode_world(&body, &inertia, 0.0).whole().map(Beat::from);
        assert_eq!(rows[..2], encode(&body).whole().map(Beat::from));
        assert_eq!(rows[2], Beat([0x3F80_0000, 0x4000_0000, 0x4040_0000, 0]));
        assert_eq!(rows[3], Beat([0xBF00_0000, 0x3E80_0000, 0x4080_0000, 0]));
        let streamed = encode_world(&body, &inertia, 0.5).whole().map(Beat::from);
        assert_eq!(streamed[2], Beat([0x3F80_0000, 0x4000_0000, 0x4040_0000, 0x3F00_0000]));
        assert_eq!([streamed[0], streamed[1], streamed[3]], [rows[0], rows[1], rows[3]]);
    }
}
