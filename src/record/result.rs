//! Reads the result record of a body, and makes the record of a body that does not change.

use super::{to_vec3, to_vec4, vec3_and_word, vec4};
use crate::scene::{Pose, Velocity};
use pgs_interface::record::{Beat, result};

/// A result record, in f32.
pub(crate) type Record = [Beat; result::ROWS];

/// The new state of a body from its result record. The words beside each vec3 are ignored.
///
/// Shape: 4 rows. Units: metres, unit quaternion, m/s, rad/s, world frame.
///
/// Source: interface specification, record table.
#[inline]
pub(crate) fn decode(beats: &Record) -> (Pose, Velocity) {
    let pose = Pose {
        position: to_vec3(beats[result::POSITION]),
        orientation: to_vec4(beats[result::ORIENTATION]),
    };
    let velocity = Velocity {
        linear: to_vec3(beats[result::LINEAR]),
        angular: to_vec3(beats[result::ANGULAR]),
    };
    (pose, velocity)
}

/// The record that [`decode`] turns back into this state.
#[inline]
pub(crate) fn of(pose: Pose, velocity: Velocity) -> Record {
    let mut beats = Record::default();
    beats[result::POSITION] = vec3_and_word(pose.position, 0).into();
    beats[result::ORIENTATION] = vec4(pose.orientation).into();
    beats[result::LINEAR] = vec3_and_word(velocity.linear, 0).into();
    beats[result::ANGULAR] = vec3_and_word(velocity.angular, 0).into();
    beats
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_record_is_read_from_these_bytes() {
        let bytes: [u8; 64] = [
            0x00, 0x00, 0x80, 0x3F, // p.x 1.0
            0x00, 0x00, 0x00, 0xC0, // p.y -2.0
            0x00, 0x00, 0x00, 0x3F, // p.z 0.5
            0x00, 0x00, 0x00, 0x00, //
            0x00, 0x00, 0x00, 0x3F, // q.x 0.5
            0x00, 0x00, 0x00, 0xBF, // q.y -0.5
            0x00, 0x00, 0x80, 0x3E, // q.z 0.25
            0x00, 0x00, 0x80, 0x3F, // q.w 1.0
            0x00, 0x00, 0x40, 0x40, // v.x 3.0
            0x00, 0x00, 0x80, 0x40, // v.y 4.0
            0x00, 0x00, 0xA0, 0x40, // v.z 5.0
            0x00, 0x00, 0x00, 0x00, //
            0x00, 0x00, 0xC0, 0x40, // w.x 6.0
            0x00, 0x00, 0xE0, 0x40, // w.y 7.0
            0x00, 0x00, 0x00, 0x41, // w.z 8.0
            0x00, 0x00, 0x00, 0x00, //
        ];
        let beats: [Beat; 4] = bytemuck::pod_read_unaligned(&bytes);
        let (pose, velocity) = decode(&beats);
        assert_eq!(pose, Pose { position: [1.0, -2.0, 0.5], orientation: [0.5, -0.5, 0.25, 1.0] });
        assert_eq!(velocity, Velocity { linear: [3.0, 4.0, 5.0], angular: [6.0, 7.0, 8.0] });
        assert_eq!(of(pose, velocity), beats);
    }
}
