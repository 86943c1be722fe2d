//! Makes the velocity and pose records of a body.

use std::mem::offset_of;

use super::inertia::about_world_axes;
use super::vec3_and_word;
use crate::scene::{Body, Shape};
use pgs_interface::record::{Beat, WORD_LANE, pose, velocity};

/// The velocity record: linear velocity beside the shape index, angular velocity beside 0.
///
/// Shape: 2 rows. Units: m/s, rad/s, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn velocity(body: &Body, rows: &mut [Beat; velocity::ROWS]) {
    rows[velocity::LINEAR] = row(body, LINEAR);
    rows[velocity::LINEAR].0[WORD_LANE] = body.shape;
    rows[velocity::ANGULAR] = row(body, ANGULAR);
    rows[velocity::ANGULAR].0[WORD_LANE] = 0;
}

/// The velocity record with world inertia: the rows of [`velocity()`], and the inverse inertia of
/// the body of this shape, beside which its inverse mass stands; that is 0 where masses are not
/// streamed.
///
/// Shape: 4 rows. Units: m/s, rad/s, 1/(kg m²), 1/kg, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn world_velocity(
    body: &Body,
    shape: &Shape,
    streamed_masses: bool,
    [linear, angular, diagonal, off_diagonal]: &mut [Beat; velocity::WORLD_ROWS],
) {
    let inertia = about_world_axes(shape, body.pose.orientation);
    let inverse_mass = if streamed_masses { shape.inverse_mass } else { 0.0 };
    let mut rows = [Beat::default(); velocity::ROWS];
    velocity(body, &mut rows);
    [*linear, *angular] = rows;
    *diagonal = vec3_and_word(inertia.diagonal, inverse_mass.to_bits());
    *off_diagonal = vec3_and_word(inertia.off_diagonal, 0);
}

const _: () = assert!(velocity::LINEAR == 0 && velocity::ANGULAR == 1);
const _: () = assert!(velocity::DIAGONAL == 2 && velocity::OFF_DIAGONAL == 3);

/// The pose record: position beside 0, orientation.
///
/// Shape: 2 rows. Units: metres, unit quaternion x, y, z, w, world frame.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn pose(body: &Body, rows: &mut [Beat; pose::ROWS]) {
    rows[pose::POSITION] = row(body, POSITION);
    rows[pose::POSITION].0[WORD_LANE] = 0;
    rows[pose::ORIENTATION] = row(body, ORIENTATION);
}

/// All vectors of a body: linear velocity, angular velocity, position, orientation. The words
/// beside each vec3 are others of the body.
#[inline(always)]
pub(crate) fn vectors(body: &Body) -> [Beat; 4] {
    [LINEAR, ANGULAR, POSITION, ORIENTATION].map(|at| row(body, at))
}

/// Four words of a body, from one of these on.
#[inline(always)]
fn row(body: &Body, at: usize) -> Beat {
    let words: &[u32; size_of::<Body>() / 4] = bytemuck::cast_ref(body);
    Beat(std::array::from_fn(|lane| words[at + lane]))
}

/// The first words of the vectors of a body.
const POSITION: usize = offset_of!(Body, pose.position) / 4;
const ORIENTATION: usize = offset_of!(Body, pose.orientation) / 4;
const LINEAR: usize = offset_of!(Body, velocity.linear) / 4;
const ANGULAR: usize = offset_of!(Body, velocity.angular) / 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pose, Velocity};

    const BODY: Body = Body {
        pose: Pose { position: [1.0, -2.0, 0.5], orientation: [0.5, -0.5, 0.25, 1.0] },
        velocity: Velocity { linear: [1.0, -2.0, 0.5], angular: [3.0, 0.25, -0.0] },
        shape: 0x0102_0304,
    };

    fn made<const ROWS: usize>(of: impl Fn(&mut [Beat; ROWS])) -> [Beat; ROWS] {
        let mut rows = [Beat([7; 4]); ROWS];
        of(&mut rows);
        rows
    }

    #[test]
    fn a_pose_record_is_these_bytes() {
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
        assert_eq!(bytemuck::bytes_of(&made(|rows| pose(&BODY, rows))), bytes);
    }

    #[test]
    fn a_velocity_record_is_these_bytes() {
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
        assert_eq!(bytemuck::bytes_of(&made(|rows| velocity(&BODY, rows))), bytes);
    }

    #[test]
    fn world_inertia_follows_the_velocities() {
        // A quarter turn about z, not of unit length, and exact: s = 1.
        let pose = Pose { orientation: [0.0, 0.0, 1.0, 1.0], ..BODY.pose };
        let body = Body { pose, ..BODY };
        let shape = Shape { inverse_inertia: [1.0, 2.0, 3.0], ..Shape::isotropic(0.5, 0.0) };
        let of = |streamed| made(|rows| world_velocity(&body, &shape, streamed, rows));
        let rows = of(false);
        assert_eq!(rows[..2], made(|rows| velocity(&body, rows)));
        assert_eq!(rows[2], Beat([0x4000_0000, 0x3F80_0000, 0x4040_0000, 0]));
        assert_eq!(rows[3], Beat([0; 4]));
        let streamed = of(true);
        assert_eq!(streamed[2], Beat([0x4000_0000, 0x3F80_0000, 0x4040_0000, 0x3F00_0000]));
        assert_eq!([streamed[0], streamed[1], streamed[3]], [rows[0], rows[1], rows[3]]);
    }
}
