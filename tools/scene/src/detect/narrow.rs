//! This file finds where two bodies touch.
//!
//! parry3d computes the contact manifold in the frame of its first shape, which is our body A. Its
//! normal points from A to B, ours from B to A; its distances mean the same. Of two boxes the manifold
//! is computed [here](super::boxes), with the same bits.

use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::details::contact_manifold_cuboid_cuboid;
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d::shape::{Ball, Capsule, Cuboid, PackedFeatureId, Shape};
use zynq_pgs::{Body, CONTACT_POINTS, Collision, Contact};

use super::boxes::{self, Touch};
use super::points::Points;
use super::reduce::reduce;
use super::{Geometries, MARGIN};
use crate::Geometry;

/// How far from 1 the length of a normal may be: rounding is far below, a broken pose above.
const NORMAL_TOLERANCE: f32 = 5e-4;

/// Points nearer to each other than this are one, m². Pieces of a line are cut off in equal points
/// where only one is left.
const SAME_POINT: f32 = 1e-8;

/// What rounding may make of two equal distances, m.
const SAME_DEPTH: f32 = 1e-4;

/// The narrow phase, with its buffers.
#[derive(Debug)]
pub(super) struct Narrow {
    manifold: ContactManifold<(), ()>,
    points: Points,
}

/// Whose frame a point is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Frame {
    A,
    B,
}

impl Default for Narrow {
    fn default() -> Self {
        Self { manifold: ContactManifold::new(), points: Points::default() }
    }
}

impl Narrow {
    /// The collision of the bodies `a` and `b` of `bodies`, if there is one.
    pub(super) fn collide(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        (a, b): (u32, u32),
    ) -> Option<Collision> {
        let body_a = bodies.get(usize::try_from(a).ok()?)?;
        let body_b = bodies.get(usize::try_from(b).ok()?)?;
        let (pose_a, pose_b) = (pose(body_a), pose(body_b));
        let (geometry_a, geometry_b) = (geometries.of(body_a)?, geometries.of(body_b)?);
        let b_in_a = pose_a.inv_mul(&pose_b);
        self.points.clear();
        let (axis, frame) = match self.touch_boxes(&b_in_a, geometry_a, geometry_b) {
            Touch::Apart => return None,
            Touch::Along(axis) => (axis, Frame::A),
            Touch::Unknown => (self.ask_parry(&b_in_a, geometry_a, geometry_b)?, Frame::B),
        };
        let candidates = self.points.candidates();
        if candidates.is_empty() {
            return None;
        }
        let normal = -(pose_a.rotation * Vector::from_array(axis));
        let error = (normal.length() - 1.0).abs();
        if error > NORMAL_TOLERANCE || error.is_nan() {
            return None;
        }

        let (chosen, count) = reduce(candidates, axis);
        let on_b = self.points.on_b();
        let mut on_b = chosen.map(|index| on_b.get(index).copied().unwrap_or_default());
        if frame == Frame::A {
            on_b = boxes::in_b(&b_in_a, on_b);
        }
        let mut contacts = [Contact::default(); CONTACT_POINTS];
        for (place, contact) in contacts.iter_mut().enumerate().take(count) {
            let point = pose_b * Vector::from_array(on_b[place]);
            if !point.is_finite() {
                return None;
            }
            let distance = candidates[chosen[place]].distance;
            *contact = Contact { point: point.to_array(), distance };
        }
        // At most four.
        let count = u32::try_from(count).ok()?;
        Some(Collision { body_a: a, body_b: b, normal: normal.to_array(), count, contacts })
    }
}

impl Narrow {
    /// Takes the points of two boxes, on B in the frame of A.
    fn touch_boxes(&mut self, b_in_a: &Pose, a: Geometry, b: Geometry) -> Touch {
        let (Geometry::Box { half_extents: a }, Geometry::Box { half_extents: b }) = (a, b) else {
            return Touch::Unknown;
        };
        boxes::touch(b_in_a, a, b, &mut self.points)
    }

    /// Takes the points of two geometries from parry, on B in its own frame; the axis, from A to B in the
    /// frame of A. `None` if parry does not know the pair.
    fn ask_parry(&mut self, b_in_a: &Pose, a: Geometry, b: Geometry) -> Option<[f32; 3]> {
        let curved = self.parry(b_in_a, a, b)?;
        let Self { manifold, points } = self;
        for point in &manifold.points {
            let same = |other: &[f32; 3]| {
                Vector::from_array(*other).distance_squared(point.local_p2) < SAME_POINT
            };
            if curved && points.on_b().iter().any(same) {
                continue;
            }
            points.take(point.local_p1.to_array(), point.local_p2.to_array(), point.dist);
        }
        Some(manifold.local_n1.to_array())
    }

    /// Has parry compute the manifold of two geometries; whether one has a curved side.
    fn parry(&mut self, b_in_a: &Pose, a: Geometry, b: Geometry) -> Option<bool> {
        // Without points and normals of an earlier pair parry starts afresh, so that a result
        // depends on the two poses alone.
        let manifold = &mut self.manifold;
        manifold.clear();
        manifold.local_n1 = Vector::ZERO;
        manifold.local_n2 = Vector::ZERO;
        if let (Geometry::Box { half_extents: a }, Geometry::Box { half_extents: b }) = (a, b) {
            let (a, b) = (Cuboid::new(Vector::from_array(a)), Cuboid::new(Vector::from_array(b)));
            contact_manifold_cuboid_cuboid(b_in_a, &a, &b, MARGIN, manifold);
            return Some(false);
        }
        with_shape(a, |a| {
            with_shape(b, |b| {
                let parry = DefaultQueryDispatcher;
                parry.contact_manifold_convex_convex(b_in_a, a, b, None, None, MARGIN, manifold)
            })
        })
        .ok()?;
        // To the points of two features parry adds the nearest one, last and without a feature.
        // Where a capsule lies flat that is any point of a line whose ends are there already.
        if let [others @ .., nearest] = &self.manifold.points[..]
            && nearest.fid1 == PackedFeatureId::UNKNOWN
            && others.iter().any(|other| other.dist <= nearest.dist + SAME_DEPTH)
        {
            self.manifold.points.pop();
        }
        Some(true)
    }
}

/// Hands parry's shape of that geometry to `then`.
fn with_shape<R>(geometry: Geometry, then: impl FnOnce(&dyn Shape) -> R) -> R {
    match geometry {
        Geometry::Box { half_extents } => then(&Cuboid::new(Vector::from_array(half_extents))),
        Geometry::Sphere { radius } => then(&Ball::new(radius)),
        Geometry::Capsule { half_height, radius } => then(&Capsule::new_y(half_height, radius)),
    }
}

fn pose(body: &Body) -> Pose {
    Pose::from_parts(
        Vector::from_array(body.pose.position),
        Rotation::from_array(body.pose.orientation),
    )
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "of boxes along the axes the normal is exact")]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    const LEVEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    fn cube(position: [f32; 3], orientation: [f32; 4]) -> Body {
        Body { pose: Pose { position, orientation }, velocity: Velocity::default(), shape: 1 }
    }

    fn collide(a: Body, b: Body) -> Option<Collision> {
        let cubes = Geometries(&[None, Some(Geometry::CUBE)]);
        Narrow::default().collide(&[a, b], cubes, (0, 1))
    }

    #[test]
    fn the_normal_points_b_in_a_and_the_points_lie_on_b() {
        // B on A, 5 mm deep.
        let a = cube([10.0, 3.0, 0.0], LEVEL);
        let b = cube([11.0, 4.995, 0.8], LEVEL);
        let found = collide(a, b).expect("contact");
        assert_eq!((found.body_a, found.body_b, found.count), (0, 1, 4));
        assert_eq!(found.normal, [0.0, -1.0, 0.0]);
        for contact in found.contacts {
            assert!((contact.distance + 0.005).abs() < 1e-5, "{contact:?}");
            // The underside of B; the point on A's surface is c + d n, its top at y = 4.
            assert!((contact.point[1] - 3.995).abs() < 1e-5, "{contact:?}");
            assert!((contact.point[1] - contact.distance - 4.0).abs() < 1e-5, "{contact:?}");
            // Where the faces overlap.
            assert!((9.999..11.001).contains(&contact.point[0]), "{contact:?}");
            assert!((-0.201..1.001).contains(&contact.point[2]), "{contact:?}");
        }
        // The other way round the normal turns and the points lie on the other cube.
        let found = collide(b, a).expect("contact");
        assert_eq!(found.normal, [0.0, 1.0, 0.0]);
        assert!(found.contacts.iter().all(|c| (c.point[1] - 4.0).abs() < 1e-5), "{found:?}");
    }

    #[test]
    fn a_cube_turned_by_45_degrees_touches_another_in_four_points_of_its_octagon() {
        let turn = [0.0, 0.382_683_43, 0.0, 0.923_879_5];
        let a = cube([0.0, 1.0, 0.0], LEVEL);
        let b = cube([0.0, 2.99, 0.0], turn);
        let found = collide(a, b).expect("contact");
        assert_eq!(found.count, 4);
        // parry gives the eight corners of the octagon in which the faces overlap, at the radius
        // 1 / cos 22.5 degrees. The four are opposites in pairs, the pairs at right angles.
        let radius = 1.082_392_2_f32;
        let planar = found.contacts.map(|contact| [contact.point[0], contact.point[2]]);
        for [x, z] in planar {
            assert!(((x * x + z * z).sqrt() - radius).abs() < 1e-4, "{found:?}");
        }
        let sum = planar.iter().fold([0.0, 0.0], |s: [f32; 2], p| [s[0] + p[0], s[1] + p[1]]);
        assert!(sum[0].abs() < 1e-4 && sum[1].abs() < 1e-4, "{found:?}");
        let corner = |i: usize, j: usize| planar[i][0] * planar[j][0] + planar[i][1] * planar[j][1];
        assert!((corner(0, 1) + radius * radius).abs() < 1e-3, "{found:?}");
        assert!(corner(0, 2).abs() < 1e-3 && corner(0, 3).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_cube_exactly_on_another_touches_it_in_its_four_corners() {
        let found =
            collide(cube([0.0, 1.0, 0.0], LEVEL), cube([0.0, 3.0, 0.0], LEVEL)).expect("contact");
        assert_eq!(found.count, 4);
        for (x, z) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            let here = |c: &Contact| (c.point[0] - x).abs() < 1e-5 && (c.point[2] - z).abs() < 1e-5;
            assert!(found.contacts.iter().any(here), "({x}, {z}): {found:?}");
        }
    }

    #[test]
    fn the_margin_is_kept_at_two_centimetres() {
        let a = cube([0.0, 1.0, 0.0], LEVEL);
        let found = collide(a, cube([0.5, 3.0199, 0.5], LEVEL)).expect("within the margin");
        assert!(found.contacts.iter().all(|c| c.distance > 0.0 && c.distance <= MARGIN));
        assert!(collide(a, cube([0.5, 3.0201, 0.5], LEVEL)).is_none());
    }

    #[test]
    fn stacked_cubes_have_the_contact_that_bullet_finds() {
        // Bullet's vectors, scene `two_cubes`, collision 1.
        let a = cube(
            [0.250_276_68, 0.994_702_9, -0.499_972_02],
            [-6.372_234e-5, -0.000_124_026_96, -0.000_107_972_42, 1.0],
        );
        let b = cube(
            [0.645_283_4, 2.989_992_4, -0.695_435_1],
            [-0.000_229_805_8, 0.001_554_238_3, -0.000_130_734_36, 0.999_998_75],
        );
        // Bullet gives one corner of the overlap twice and leaves one out.
        let bullet: [[f32; 4]; 4] = [
            [1.248_292_3, 1.991_913, -1.497_404_5, -0.004_895_148],
            [1.250_292_7, 1.990_293_9, 0.303_148_15, -0.004_295_349],
            [-0.351_863_92, 1.990_714, 0.308_128_3, -0.004_221_797],
            [1.250_739_8, 1.989_464_3, -1.499_850_7, -0.004_895_091],
        ];
        let found = collide(a, b).expect("contact");
        assert_eq!(found.count, 4);
        for (ours, theirs) in found.normal.iter().zip([-0.000_260_754, -1.0, 0.000_460_017_4]) {
            assert!((ours - theirs).abs() < 1e-3, "{found:?}");
        }
        for [x, y, z, distance] in bullet {
            let near = |c: &Contact| {
                (c.point[0] - x).abs() < 5e-3
                    && (c.point[1] - y).abs() < 5e-3
                    && (c.point[2] - z).abs() < 5e-3
                    && (c.distance - distance).abs() < 1e-3
            };
            assert!(found.contacts.iter().any(near), "({x}, {y}, {z}) is none of {found:?}");
        }
    }

    #[test]
    fn crossed_edges_touch_in_one_point() {
        // A on an edge along z, B above it on an edge along x: both turned by 45 degrees.
        let (sin, cos) = (0.382_683_43, 0.923_879_5);
        let a = cube([0.0; 3], [0.0, 0.0, sin, cos]);
        let b = cube([0.0, 2.82, 0.0], [sin, 0.0, 0.0, cos]);
        let found = collide(a, b).expect("contact");
        assert!((found.normal[1] + 1.0).abs() < 1e-4, "{found:?}");
        assert_eq!(found.count, 1);
        let contact = found.contacts[0];
        assert!((contact.distance + 0.008_427).abs() < 1e-3, "{found:?}");
        assert!(contact.point[0].abs() < 1e-3 && contact.point[2].abs() < 1e-3, "{found:?}");
    }

    const SPHERE: Geometry = Geometry::Sphere { radius: 0.5 };
    const CAPSULE: Geometry = Geometry::Capsule { half_height: 0.6, radius: 0.4 };

    /// The collision of two bodies of these geometries, and that of the two the other way round.
    fn pair(a: (Geometry, Body), b: (Geometry, Body)) -> Option<[Collision; 2]> {
        let shaped = |(_, body): (Geometry, Body), shape| Body { shape, ..body };
        let bodies = [shaped(a, 0), shaped(b, 1)];
        let outlines = [Some(a.0), Some(b.0)];
        let mut narrow = Narrow::default();
        let mut of = |pair| narrow.collide(&bodies, Geometries(&outlines), pair);
        match (of((0, 1)), of((1, 0))) {
            (Some(found), Some(reverse)) => Some([found, reverse]),
            (None, None) => None,
            other => panic!("one way only: {other:?}"),
        }
    }

    #[test]
    fn spheres_touch_in_one_point_between_their_centres() {
        let b = (SPHERE, cube([0.0, 1.99, 0.0], LEVEL));
        let [found, reverse] = pair((SPHERE, cube([0.0, 1.0, 0.0], LEVEL)), b).expect("contact");
        assert_eq!((found.count, found.normal), (1, [0.0, -1.0, 0.0]));
        assert_eq!(reverse.normal, [0.0, 1.0, 0.0]);
        assert!((found.contacts[0].distance + 0.01).abs() < 1e-6, "{found:?}");
        assert!((found.contacts[0].point[1] - 1.49).abs() < 1e-6, "{found:?}");
        assert!((reverse.contacts[0].point[1] - 1.5).abs() < 1e-6, "{reverse:?}");
        assert!(pair((SPHERE, cube([0.0, 0.969, 0.0], LEVEL)), b).is_none());
    }

    #[test]
    fn a_sphere_on_a_box_touches_its_face_edge_or_corner() {
        let a = (Geometry::CUBE, cube([0.0; 3], LEVEL));
        let on = |position| pair(a, (SPHERE, cube(position, LEVEL)));
        let [face, _] = on([0.3, 1.495, -0.2]).expect("face");
        assert_eq!(face.count, 1);
        assert!((face.normal[1] + 1.0).abs() < 1e-6, "{face:?}");
        assert!((face.contacts[0].distance + 0.005).abs() < 1e-5, "{face:?}");
        // Beyond a corner, along its diagonal: 0.49 m away.
        let beyond = 1.0 + 0.49 / 3.0_f32.sqrt();
        let [corner, _] = on([beyond; 3]).expect("corner");
        assert!((corner.contacts[0].distance + 0.01).abs() < 1e-5, "{corner:?}");
        assert!(corner.normal.iter().all(|n| (n + 3.0_f32.sqrt().recip()).abs() < 1e-5));
    }

    #[test]
    fn a_capsule_lies_on_a_box_with_both_ends_and_stands_on_one() {
        let half = 0.5_f32.sqrt();
        let a = (Geometry::CUBE, cube([0.0; 3], LEVEL));
        // A quarter turn about x lays it along z.
        let [lying, _] =
            pair(a, (CAPSULE, cube([0.0, 1.39, 0.0], [half, 0.0, 0.0, half]))).expect("lying");
        assert_eq!(lying.count, 2, "{lying:?}");
        for contact in &lying.contacts[..2] {
            assert!((contact.distance + 0.01).abs() < 1e-4, "{lying:?}");
            assert!((contact.point[1] - 0.99).abs() < 1e-4, "{lying:?}");
            assert!((contact.point[2].abs() - 0.6).abs() < 1e-4, "{lying:?}");
        }
        let [standing, _] = pair(a, (CAPSULE, cube([0.0, 1.99, 0.0], LEVEL))).expect("standing");
        assert_eq!(standing.count, 1, "{standing:?}");
        assert!((standing.contacts[0].distance + 0.01).abs() < 1e-4, "{standing:?}");
        // Its round end reaches a corner's diagonal no farther than its radius.
        let beyond = 1.0 + 0.43 / 3.0_f32.sqrt();
        let far = cube([beyond, beyond + 0.6, beyond], LEVEL);
        assert!(pair(a, (CAPSULE, far)).is_none());
    }

    #[test]
    fn capsules_and_spheres_touch_where_they_are_nearest() {
        let half = 0.5_f32.sqrt();
        let a = (CAPSULE, cube([0.0; 3], [half, 0.0, 0.0, half]));
        // Crossed: one along z, the other along x above it.
        let crossed = cube([0.0, 0.79, 0.3], [0.0, 0.0, half, half]);
        let [found, _] = pair(a, (CAPSULE, crossed)).expect("crossed");
        assert_eq!(found.count, 1);
        assert!((found.contacts[0].distance + 0.01).abs() < 1e-5, "{found:?}");
        assert!((found.contacts[0].point[2] - 0.3).abs() < 1e-5, "{found:?}");
        let [found, _] = pair(a, (SPHERE, cube([0.0, 0.0, 1.49], LEVEL))).expect("sphere");
        assert_eq!(found.count, 1);
        assert!((found.normal[2] + 1.0).abs() < 1e-5, "{found:?}");
        assert!((found.contacts[0].distance + 0.01).abs() < 1e-5, "{found:?}");
    }
}
