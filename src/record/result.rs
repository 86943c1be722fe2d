//! Reads the result record of a body, and makes the record of a body that does not change.

use super::{Magnitudes, to_vec3, to_vec4, vec3_and_word, vec4};
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
    beats[result::POSITION] = vec3_and_word(pose.position, 0);
    beats[result::ORIENTATION] = vec4(pose.orientation);
    beats[result::LINEAR] = vec3_and_word(velocity.linear, 0);
    beats[result::ANGULAR] = vec3_and_word(velocity.angular, 0);
    beats
}

/// Whether all numbers of a record are finite. The words beside each vec3 are ignored.
pub(crate) fn finite(record: &Record) -> bool {
    all_finite(std::slice::from_ref(record))
}

/// Whether all numbers of all records are finite.
pub(crate) fn all_finite(records: &[Record]) -> bool {
    let (mut vec3, mut orientation) = (Magnitudes::default(), Magnitudes::default());
    for record in records {
        orientation.see(record[result::ORIENTATION]);
        for row in [result::POSITION, result::LINEAR, result::ANGULAR] {
            vec3.see(record[row]);
        }
    }
    orientation.are_within(f32::MAX) & vec3.of_vec3_are_within(f32::MAX)
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

    #[test]
    fn what_is_not_finite_is_found_wherever_it_is_and_nothing_else_is() {
        let good = [Beat([f32::MAX, f32::MIN, -0.0, f32::from_bits(1)].map(f32::to_bits)); 4];
        assert!(finite(&good));
        for value in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN] {
            for at in 0..16 {
                let mut record = good;
                record[at / 4].0[at % 4] = value.to_bits();
                assert_eq!(finite(&record), [3, 11, 15].contains(&at), "{value} {at}");
            }
        }
    }
}
