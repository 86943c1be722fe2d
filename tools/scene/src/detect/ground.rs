//! This file finds where a cube touches the ground.
//!
//! The ground is taken as the plane y = 0, not as the box of 400 m half extent that it is: relative
//! to the centre of that box an f32 carries the height of a corner in steps of 0.03 mm, while from
//! the plane it is the corner's own y. Cubes touch it with the corners of the face that looks down
//! most; the three lowest corners of a cube always belong to that face.

use zynq_pgs::{Body, CONTACT_POINTS, Collision, Contact};

use super::MARGIN;
use crate::{CUBE_HALF_EXTENT, GROUND, rotation};

/// From the cube (B) down to the ground (A).
const NORMAL: [f32; 3] = [0.0, -1.0, 0.0];

/// The collision of the cube `body` of index `index` with the ground, if there is one.
pub(super) fn collide(index: u32, body: &Body) -> Option<Collision> {
    let centre = body.pose.position;
    let rows = rotation::matrix(body.pose.orientation);

    // The body axis closest to the vertical, of equals the first.
    let mut axis = 0;
    for other in 1..3 {
        if rows[1][other].abs() > rows[1][axis].abs() {
            axis = other;
        }
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let down = if rows[1][axis] > 0.0 { -CUBE_HALF_EXTENT } else { CUBE_HALF_EXTENT };

    let mut contacts = [Contact::default(); CONTACT_POINTS];
    let mut count = 0;
    for (su, sv) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let mut corner = [0.0; 3];
        corner[axis] = down;
        corner[u] = su * CUBE_HALF_EXTENT;
        corner[v] = sv * CUBE_HALF_EXTENT;
        let mut point = [0.0; 3];
        for row in 0..3 {
            let [x, y, z] = rows[row];
            point[row] = centre[row] + ((x * corner[0] + y * corner[1]) + z * corner[2]);
        }
        // Written so that a NaN is no contact.
        if point[1] <= MARGIN && point.iter().all(|value| value.is_finite()) {
            contacts[count] = Contact { point, distance: point[1] };
            count += 1;
        }
    }
    // At most four.
    let count = u32::try_from(count).ok().filter(|&count| count > 0)?;
    Some(Collision { body_a: GROUND, body_b: index, normal: NORMAL, count, contacts })
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the normal is a constant")]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    fn cube(position: [f32; 3], orientation: [f32; 4]) -> Body {
        Body { pose: Pose { position, orientation }, velocity: Velocity::default(), shape: 1 }
    }

    #[test]
    fn a_flat_cube_stands_on_four_corners() {
        let found = collide(7, &cube([10.0, 0.995, -3.0], [0.0, 0.0, 0.0, 1.0])).expect("contact");
        assert_eq!((found.body_a, found.body_b, found.count), (0, 7, 4));
        assert_eq!(found.normal, [0.0, -1.0, 0.0]);
        for contact in found.contacts {
            assert!((contact.distance + 0.005).abs() < 1e-6, "{contact:?}");
            assert_eq!(contact.point[1].to_bits(), contact.distance.to_bits());
            assert!((contact.point[0] - 10.0).abs() > 0.999_999);
            assert!((contact.point[2] + 3.0).abs() > 0.999_999);
        }
    }

    #[test]
    fn the_margin_is_kept_at_two_centimetres() {
        let level = [0.0, 0.0, 0.0, 1.0];
        assert!(collide(1, &cube([0.0, 1.019_9, 0.0], level)).is_some());
        assert!(collide(1, &cube([0.0, 1.020_1, 0.0], level)).is_none());
    }

    #[test]
    fn a_cube_on_its_edge_has_two_contacts_and_on_its_corner_one() {
        // Turned by 45 degrees about z.
        let (sin, cos) = (0.382_683_43, 0.923_879_5);
        let edge = collide(1, &cube([0.0, 1.414, 0.0], [0.0, 0.0, sin, cos])).expect("edge");
        assert_eq!(edge.count, 2);
        // The diagonal of the cube upright: 54.7356 degrees about (1, 0, -1)/sqrt 2.
        let (sin, cos) = (0.459_700_85, 0.888_073_85);
        let half = 0.5_f32.sqrt();
        let upright = [sin * half, 0.0, -sin * half, cos];
        let corner = collide(1, &cube([0.0, 1.73, 0.0], upright)).expect("corner");
        assert_eq!(corner.count, 1);
        assert!((corner.contacts[0].distance + 0.002_05).abs() < 1e-4, "{corner:?}");
    }

    #[test]
    fn a_cube_at_rest_has_the_contacts_that_bullet_finds() {
        // Bullet's vectors, scene `one_cube`, without the point that Bullet puts on an edge.
        let position = [0.249_908_21, 0.995_000_9, -0.500_063_96];
        let orientation = [-6.546_008e-6, 0.000_274_304_27, -6.135_436e-6, 1.0];
        let bullet: [[f32; 3]; 3] = [
            [-0.749_555_4, -0.004_973_769, 0.500_497_64],
            [-0.750_652_55, -0.004_999_935_6, -1.499_502_2],
            [1.250_444_5, -0.004_998_326_3, 0.499_400_5],
        ];
        let found = collide(1, &cube(position, orientation)).expect("contact");
        assert_eq!((found.count, found.normal), (4, [0.0, -1.0, 0.0]));
        for point in bullet {
            let near = found
                .contacts
                .iter()
                .any(|contact| (0..3).all(|axis| (contact.point[axis] - point[axis]).abs() < 4e-4));
            assert!(near, "{point:?} is none of {:?}", found.contacts);
        }
    }

    #[test]
    fn a_pose_that_is_not_finite_touches_nothing() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(collide(1, &cube([value, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])).is_none());
            assert!(collide(1, &cube([0.0, value, 0.0], [0.0, 0.0, 0.0, 1.0])).is_none());
            assert!(collide(1, &cube([0.0; 3], [value, 0.0, 0.0, 1.0])).is_none());
        }
    }
}
