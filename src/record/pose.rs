//! Makes the pose record of a body.

use super::{ORIENTATION, POSITION, row_of};
use crate::scene::Body;
use crate::simd::Lanes;
use pgs_interface::record::pose;

/// The pose record: position beside 0, orientation.
///
/// Shape: 2 rows. Units: metres, unit quaternion x, y, z, w, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(body: &Body) -> [Lanes; pose::ROWS] {
    let mut rows = [Lanes::all(0); pose::ROWS];
    rows[pose::POSITION] = row_of::<POSITION, _>(body).beside(0);
    rows[pose::ORIENTATION] = row_of::<ORIENTATION, _>(body);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pose, Velocity};
    use pgs_interface::record::Beat;

    #[test]
    fn a_pose_record_is_these_bytes() {
        let body = Body {
            pose: Pose { position: [1.0, -2.0, 0.5], orientation: [0.5, -0.5, 0.25, 1.0] },
            velocity: Velocity { linear: [9.0; 3], angular: [9.0; 3] },
            shape: 7,
        };
        let bytes: [u8; 32] = [
            0x00, 0x00, 0x80, 0x3F, // p.x 1.0
            0x00, 0x00, 0x00, 0xC0, // p.y -2.0
            0x00, 0x00, 0x00, 0x3F, // p.z 0.5
            0x00, 0x00, 0x00, 0x00, //
            0x00, 0x00, 0x00, 0x3F, // q.x 0.5
            0x00, 0x00, 0x00, 0xBF, // q.y -0.5
            0x00, 0x00, 0x80, 0x3E, // q.z 0.25
            0x00, 0x00, 0x80, 0x3F, // q.w 1.0
        ];
        assert_eq!(bytemuck::bytes_of(&encode(&body).map(Beat::from)), bytes);
    }
}
