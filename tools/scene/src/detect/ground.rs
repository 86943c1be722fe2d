//! Finds the contacts of a body with the ground.
//!
//! The ground is treated as the plane y = 0, not as its box of 400 m half extent: relative to the
//! box's centre, an f32 carries the height of a corner in steps of 0.03 mm; from the plane it is
//! the corner's own y. A box touches with the corners of its most downward face, which always has
//! the three lowest corners; a sphere with its lowest point, a capsule with the lowest point of
//! each end.

use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision, Contact};

use super::MARGIN;
use crate::{GROUND, Geometry, rotation};

/// From the body (B) down to the ground (A).
const NORMAL: [f32; 3] = [0.0, -1.0, 0.0];

/// Sine of the tilt up to which a cylinder stands on a square fixed in its rim. The lowest point of
/// the rim, which would turn with every tremor, is at most 0.3 % of the radius lower.
const UPRIGHT: f32 = 0.01;

/// The contact points of a body, as they are collected.
#[derive(Default)]
struct Points {
    contacts: [Contact; CONTACT_POINTS],
    count: usize,
}

impl Points {
    /// Adds a point that is near enough; keeps the four lowest, and the earlier ones in a tie.
    fn offer(&mut self, point: [f32; 3]) {
        // In this form a NaN is no contact.
        if !(point[1] <= MARGIN && point.iter().all(|value| value.is_finite())) {
            return;
        }
        let contact = Contact { point, distance: point[1] };
        if let Some(free) = self.contacts.get_mut(self.count) {
            *free = contact;
            self.count += 1;
            return;
        }
        let [mut highest, others @ ..] = self.contacts.each_mut();
        for other in others {
            if other.distance >= highest.distance {
                highest = other;
            }
        }
        if contact.distance < highest.distance {
            *highest = contact;
        }
    }
}

/// The collision of body `index` with the ground, if there is one.
pub(super) fn collide(index: u32, body: &Body, geometry: Geometry) -> Option<Collision> {
    let centre = body.pose.position;
    let mut points = Points::default();
    match geometry {
        Geometry::Box { half_extents } => offer_face(body, half_extents, &mut points),
        Geometry::Sphere { radius } => points.offer([centre[0], centre[1] - radius, centre[2]]),
        Geometry::Capsule { half_height, radius } => {
            let rows = rotation::matrix(body.pose.orientation);
            for end in [half_height, -half_height] {
                let [x, y, z] = [0, 1, 2].map(|row| centre[row] + rows[row][1] * end);
                points.offer([x, y - radius, z]);
            }
        }
        Geometry::Cylinder { half_height, radius } => {
            offer_rims(body, half_height, radius, &mut points);
        }
        Geometry::Hull { points: corners } => {
            let rows = rotation::matrix(body.pose.orientation);
            for corner in corners {
                points.offer(rotation::placed(centre, &rows, *corner));
            }
        }
    }
    let Points { contacts, count } = points;
    // At most four.
    let count = u32::try_from(count).ok().filter(|&count| count > 0)?;
    Some(Collision { body_a: GROUND, body_b: index, normal: NORMAL, count, contacts })
}

/// Offers the corners of the box's most downward face.
fn offer_face(body: &Body, half_extents: [f32; 3], points: &mut Points) {
    let centre = body.pose.position;
    let rows = rotation::matrix(body.pose.orientation);

    // The body axis whose two faces differ most in height; the first one in a tie.
    let height = |axis: usize| rows[1][axis].abs() * half_extents[axis];
    let mut axis = 0;
    for other in 1..3 {
        if height(other) > height(axis) {
            axis = other;
        }
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let down = if rows[1][axis] > 0.0 { -half_extents[axis] } else { half_extents[axis] };

    for (su, sv) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let mut corner = [0.0; 3];
        corner[axis] = down;
        corner[u] = su * half_extents[u];
        corner[v] = sv * half_extents[v];
        points.offer(rotation::placed(centre, &rows, corner));
    }
}

/// Offers the lowest point of either rim of a cylinder, and a square in the lower one.
fn offer_rims(body: &Body, half_height: f32, radius: f32, points: &mut Points) {
    let centre = body.pose.position;
    let rows = rotation::matrix(body.pose.orientation);
    // The vertical in the frame of the body, as far as it lies across the axis.
    let [x, along, z] = rows[1];
    let across = (x * x + z * z).sqrt();
    let below = if along > 0.0 { -half_height } else { half_height };
    let is_upright = across < UPRIGHT;
    let (dx, dz) =
        if is_upright { (radius, 0.0) } else { (-x / across * radius, -z / across * radius) };
    for corner in [[dx, below, dz], [-dz, below, dx], [dz, below, -dx], [-dx, below, -dz]] {
        points.offer(rotation::placed(centre, &rows, corner));
    }
    if !is_upright {
        points.offer(rotation::placed(centre, &rows, [dx, -below, dz]));
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the normal is a constant")]
mod tests {
    use super::*;
    use crate::fixtures::body as cube;

    /// The collision of a cube.
    fn collide(index: u32, body: &Body) -> Option<Collision> {
        super::collide(index, body, Geometry::CUBE)
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
        // The cube stands on a corner: 54.7356 degrees about (1, 0, -1)/sqrt 2.
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

    #[test]
    fn a_sphere_touches_with_its_lowest_point_and_a_capsule_with_its_ends() {
        let level = [0.0, 0.0, 0.0, 1.0];
        let sphere = Geometry::Sphere { radius: 0.5 };
        let found = super::collide(3, &cube([2.0, 0.49, 1.0], level), sphere).expect("contact");
        assert_eq!(found.count, 1);
        assert!((found.contacts[0].distance + 0.01).abs() < 1e-6, "{found:?}");
        assert_eq!(found.contacts[0].point[0], 2.0);
        assert!(super::collide(3, &cube([2.0, 0.521, 1.0], level), sphere).is_none());

        let capsule = Geometry::Capsule { half_height: 0.6, radius: 0.4 };
        let upright = super::collide(3, &cube([0.0, 1.0, 0.0], level), capsule).expect("contact");
        assert_eq!(upright.count, 1, "on one end");
        // A quarter turn about x lays it along z.
        let half = 0.5_f32.sqrt();
        let lying = cube([0.0, 0.39, 0.0], [half, 0.0, 0.0, half]);
        let lying = super::collide(3, &lying, capsule).expect("contact");
        assert_eq!(lying.count, 2, "on both");
        assert!((lying.contacts[0].point[2] - 0.6).abs() < 1e-6, "{lying:?}");
        assert!((lying.contacts[1].distance + 0.01).abs() < 1e-6, "{lying:?}");
    }

    #[test]
    fn a_cylinder_stands_on_a_square_and_lies_on_a_line() {
        let cylinder = Geometry::Cylinder { half_height: 0.6, radius: 0.4 };
        let found = |y: f32, angle: f32| {
            let (sin, cos) = (0.5 * angle).sin_cos();
            super::collide(3, &cube([2.0, y, 0.0], [sin, 0.0, 0.0, cos]), cylinder)
        };
        let upright = found(0.59, 0.0).expect("contact");
        assert_eq!(upright.count, 4, "on its rim");
        for contact in upright.contacts {
            let [x, y, z] = contact.point;
            assert!(
                (y + 0.01).abs() < 1e-6 && (((x - 2.0).powi(2) + z * z).sqrt() - 0.4).abs() < 1e-6
            );
        }
        let quarter = std::f32::consts::FRAC_PI_2;
        let lying = found(0.39, quarter).expect("contact");
        assert_eq!(lying.count, 2, "on the ends of a line");
        assert!(lying.contacts[..2].iter().all(|contact| (contact.distance + 0.01).abs() < 1e-6));
        assert!(
            (lying.contacts[0].point[2] - lying.contacts[1].point[2]).abs() > 1.19,
            "{lying:?}"
        );
        // Tilted by 30 degrees, one way and head down: on the lowest point of a rim.
        let tilt = std::f32::consts::FRAC_PI_6;
        for angle in [tilt, -tilt, std::f32::consts::PI + tilt] {
            let height = 0.6 * 0.866_025_4 + 0.4 * 0.5;
            let tilted = found(height - 0.005, angle).expect("contact");
            assert_eq!(tilted.count, 1, "{tilted:?}");
            assert!((tilted.contacts[0].distance + 0.005).abs() < 1e-6, "{tilted:?}");
        }
        assert!(found(0.621, 0.0).is_none() && found(0.421, quarter).is_none());
    }

    #[test]
    fn a_hull_lies_on_a_face_and_keeps_its_four_lowest_corners() {
        const HULL: [[f32; 3]; 12] = crate::hull::cuboctahedron([0.9, 0.5, 0.6]);
        let hull = Geometry::Hull { points: &HULL };
        let level = [0.0, 0.0, 0.0, 1.0];
        let flat = super::collide(1, &cube([0.0, 0.49, 0.0], level), hull).expect("contact");
        assert_eq!(flat.count, 4);
        assert!(flat.contacts.iter().all(|contact| (contact.distance + 0.01).abs() < 1e-6));
        // Half inside the ground: every corner but the highest four is near.
        let sunk = super::collide(1, &cube([0.0, 0.0, 0.0], level), hull).expect("contact");
        assert!(sunk.contacts.iter().all(|contact| contact.distance < -0.4), "{sunk:?}");
    }

    #[test]
    fn a_slab_lies_on_its_broad_face_even_when_tilted() {
        let slab = Geometry::Box { half_extents: [1.0, 0.25, 0.5] };
        let flat = cube([0.0, 0.245, 0.0], [0.0, 0.0, 0.0, 1.0]);
        let found = super::collide(1, &flat, slab).expect("contact");
        assert_eq!(found.count, 4);
        // Half a degree about z lowers one end by 9 mm: all four corners are near.
        let tilted = cube([0.0, 0.25, 0.0], [0.0, 0.0, 0.004_363_3, 0.999_990_5]);
        let found = super::collide(1, &tilted, slab).expect("contact");
        assert_eq!(found.count, 4);
        let depths = found.contacts.map(|contact| contact.distance);
        assert!(depths.iter().filter(|depth| **depth < -0.008).count() == 2, "{depths:?}");
    }
}
