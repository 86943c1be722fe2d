//! Builds a pile of several shapes and masses.

use pgs_support::float_env::standard;
use zynq_pgs::{Body, Shape};

use crate::build::{at_rest, check_drop};
use crate::{Geometry, Grid, Scene, SceneError, hull};
use pgs_support::random::SplitMix64;

/// The corners of the hulls.
const HULL: [[f32; 3]; 12] = hull::cuboctahedron([0.9, 0.5, 0.6]);

/// The kinds of bodies: geometry, and mass in kg. The inertia differs between axes except for cubes
/// and spheres.
const KINDS: [(Geometry, f32); 12] = [
    (Geometry::Box { half_extents: [0.6; 3] }, 1.0),
    (Geometry::Box { half_extents: [0.6; 3] }, 3.0),
    (Geometry::Sphere { radius: 0.6 }, 0.5),
    (Geometry::Sphere { radius: 0.6 }, 2.0),
    (Geometry::Box { half_extents: [0.5, 0.25, 1.0] }, 1.0),
    (Geometry::Box { half_extents: [0.5, 0.25, 1.0] }, 2.0),
    (Geometry::Capsule { half_height: 0.6, radius: 0.4 }, 1.0),
    (Geometry::Capsule { half_height: 0.6, radius: 0.4 }, 4.0),
    (Geometry::Cylinder { half_height: 0.5, radius: 0.5 }, 1.0),
    (Geometry::Cylinder { half_height: 0.5, radius: 0.5 }, 3.0),
    (Geometry::Hull { points: &HULL }, 1.0),
    (Geometry::Hull { points: &HULL }, 2.0),
];

/// Frictions of the ground and of the kinds: cubes grip, spheres and capsules slide.
pub const SHAPE_FRICTIONS: [f32; 1 + KINDS.len()] =
    [0.8, 0.9, 0.9, 0.3, 0.3, 0.6, 0.6, 0.2, 0.2, 0.5, 0.5, 0.7, 0.7];

/// Distance between the centres of neighbours, m: no two bodies touch in any orientation.
const SPACING: f32 = 2.4;

/// The options of a pile of several shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapesOptions {
    /// Number of bodies along each axis.
    pub grid: Grid,
    /// Height above the ground at the start, m, of the lowest point that the largest body could
    /// reach in the lowest layer.
    pub drop: f32,
    /// Seed of every body's shape, mass and orientation.
    pub seed: u64,
}

impl Default for ShapesOptions {
    fn default() -> Self {
        Self { grid: Grid::default(), drop: 5.0, seed: 1 }
    }
}

impl Scene {
    /// Builds a pile of cubes, spheres, boxes, capsules, cylinders and convex hulls of several
    /// masses, at rest: on a lattice about the origin, each layer half a distance beside the one
    /// below, with random shapes and orientations. The same seed gives the same bits everywhere.
    ///
    /// All but cubes and spheres have no isotropic inertia: only a bitstream with world inertia
    /// takes them.
    ///
    /// # Errors
    ///
    /// [`SceneError::Drop`] if the drop is negative, not a number or above
    /// [`DROP_MAX`](crate::DROP_MAX). [`SceneError::Shape`] does not happen with the kinds above.
    pub fn of_shapes(options: &ShapesOptions) -> Result<Self, SceneError> {
        standard(|| Self::build_of_shapes(options))
    }

    fn build_of_shapes(options: &ShapesOptions) -> Result<Self, SceneError> {
        let drop = check_drop(options.drop)?;
        let mut random = SplitMix64::new(options.seed);
        let (x, y, z) = (options.grid.x(), options.grid.y(), options.grid.z());
        let centred =
            |index: u16, count: u16| SPACING * (f32::from(index) - 0.5 * (f32::from(count) - 1.0));
        let mut bodies: Vec<Body> = Vec::new();
        for i in 0..x {
            for j in 0..y {
                let shift = 0.5 * SPACING * f32::from(j & 1);
                for k in 0..z {
                    let position = [
                        centred(i, x) + shift,
                        SPACING * (0.5 + f32::from(j)) + drop,
                        centred(k, z) + shift,
                    ];
                    // Shape 0 is the ground's; the number of kinds is small.
                    let kind = u32::try_from(random.below(KINDS.len())).unwrap_or(0);
                    let mut body = at_rest(position, 1 + kind);
                    body.pose.orientation = orientation(&mut random);
                    bodies.push(body);
                }
            }
        }
        let kinds = KINDS.iter().map(|&(geometry, mass)| Ok((geometry.shape(mass)?, geometry)));
        let kinds = kinds.collect::<Result<Vec<(Shape, Geometry)>, SceneError>>()?;
        Ok(Self::on_ground(&kinds, bodies))
    }
}

/// A unit quaternion, uniformly distributed.
fn orientation(random: &mut SplitMix64) -> [f32; 4] {
    loop {
        let q = [(); 4].map(|()| random.sign());
        let squared = ((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3];
        // Accepts points in the ball that are not so near its centre that rounding decides the
        // direction. Three in ten points of the cube around it are in the ball.
        if (0.01..=1.0).contains(&squared) {
            let length = squared.sqrt();
            return q.map(|value| value / length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MARGIN;
    use crate::fixtures::{bits, digest};

    fn scene(grid: &str, drop: f32, seed: u64) -> Scene {
        let grid = grid.parse().expect("a grid");
        Scene::of_shapes(&ShapesOptions { grid, drop, seed }).expect("a scene")
    }

    #[test]
    fn every_kind_is_there_and_two_thirds_of_them_are_not_isotropic() {
        let scene = scene("10x10x10", 0.0, 1);
        assert_eq!(scene.shapes().len(), 13);
        assert_eq!(scene.geometries().len(), 13);
        assert_eq!(scene.bodies().len(), 1001);
        for kind in 1..13 {
            let count = scene.bodies().iter().filter(|body| body.shape == kind).count();
            assert!((50..120).contains(&count), "{count} of kind {kind}");
        }
        let turned = |shape: &&Shape| {
            shape.inverse_inertia.iter().any(|k| k.to_bits() != shape.inverse_inertia[0].to_bits())
        };
        assert_eq!(scene.shapes().iter().filter(turned).count(), 8);
        let names: Vec<_> = scene.geometries().iter().flatten().map(Geometry::name).collect();
        let expected = ["cube", "sphere", "box", "capsule", "cylinder", "hull"];
        assert_eq!(names, expected.map(|name| [name, name]).concat());
    }

    #[test]
    fn a_seed_is_a_scene() {
        let bits = |seed| -> Vec<u32> {
            scene("3x3x3", 1.0, seed)
                .bodies()
                .iter()
                .flat_map(|b| b.pose.orientation.map(f32::to_bits).into_iter().chain([b.shape]))
                .collect()
        };
        assert_eq!(bits(1), bits(1));
        assert_ne!(bits(1), bits(2));
    }

    #[test]
    fn orientations_have_length_one() {
        for body in scene("6x6x6", 1.0, 7).bodies() {
            let [x, y, z, w] = body.pose.orientation.map(f64::from);
            let length = (((x * x + y * y) + z * z) + w * w).sqrt();
            assert!((length - 1.0).abs() < 1e-6, "{body:?}");
        }
    }

    #[test]
    fn nothing_touches_before_it_has_fallen() {
        assert!(scene("6x4x6", 0.1, 3).detect().is_empty());
        for (geometry, _) in KINDS {
            let radius = geometry.bounding_radius();
            assert!(2.0 * radius + MARGIN < SPACING, "{geometry:?}");
            // The assumption of the broad phase's cells.
            assert!(radius <= Geometry::CUBE.bounding_radius(), "{geometry:?}");
        }
    }

    #[test]
    fn a_drop_that_no_scene_starts_from_is_refused() {
        let options = ShapesOptions { drop: -1.0, ..ShapesOptions::default() };
        assert!(matches!(Scene::of_shapes(&options), Err(SceneError::Drop { .. })));
    }

    /// Signed distance of a point from the surface of a body, m.
    fn outside(scene: &Scene, body: u32, point: [f32; 3]) -> f32 {
        let body = scene.bodies()[usize::try_from(body).expect("small")];
        let shape = usize::try_from(body.shape).expect("small");
        let geometry = scene.geometries()[shape].expect("not the ground");
        let rows = crate::rotation::matrix(body.pose.orientation);
        let arm = [0, 1, 2].map(|k| point[k] - body.pose.position[k]);
        let [x, y, z] =
            [0, 1, 2].map(|k| rows[0][k] * arm[0] + rows[1][k] * arm[1] + rows[2][k] * arm[2]);
        let length = |x: f32, y: f32, z: f32| (x * x + y * y + z * z).sqrt();
        match geometry {
            Geometry::Sphere { radius } => length(x, y, z) - radius,
            Geometry::Capsule { half_height, radius } => {
                length(x, y - y.clamp(-half_height, half_height), z) - radius
            }
            Geometry::Cylinder { half_height, radius } => {
                let [dx, dy] = [length(x, 0.0, z) - radius, y.abs() - half_height];
                length(dx.max(0.0), dy.max(0.0), 0.0) + dx.max(dy).min(0.0)
            }
            Geometry::Hull { points } => {
                let hull = hull::polyhedron(points).expect("a hull");
                let point = parry3d::math::Vector::new(x, y, z);
                let above = hull.faces().iter().map(|face| {
                    let corner = hull.vertices_adj_to_face()[face.first_vertex_or_edge as usize];
                    face.normal.dot(point - hull.points()[corner as usize])
                });
                above.fold(f32::NEG_INFINITY, f32::max)
            }
            Geometry::Box { half_extents: [hx, hy, hz] } => {
                let [dx, dy, dz] = [x.abs() - hx, y.abs() - hy, z.abs() - hz];
                let inside = dx.max(dy).max(dz).min(0.0);
                length(dx.max(0.0), dy.max(0.0), dz.max(0.0)) + inside
            }
        }
    }

    /// The scene, compressed until everything touches: as in a pile, or deeper.
    fn pressed(seed: u64) -> Scene {
        let mut scene = scene("7x7x7", 0.0, seed);
        for body in &mut scene.bodies_mut()[1..] {
            body.pose.position = body.pose.position.map(|value| value * 0.495);
        }
        scene
    }

    /// How far parry's points may be inside a slanted capsule or edge, m.
    const NEAR: f32 = 0.05;

    #[test]
    fn contact_points_lie_on_body_b_and_steps_take_them() {
        let mut scene = pressed(5);
        let collisions = scene.detect().to_vec();
        let grounded = crate::ground_pairs(&collisions);
        assert!(grounded > 20 && collisions.len() > 300, "{grounded} of {}", collisions.len());
        assert!(collisions.is_sorted_by_key(|c| (c.body_a, c.body_b)));
        let mut shallow = 0;
        let mut kinds = std::collections::BTreeSet::new();
        for c in &collisions {
            assert!((1..=4).contains(&c.count), "{c:?}");
            let [x, y, z] = c.normal;
            assert!(((x * x + y * y + z * z).sqrt() - 1.0).abs() < 1e-3, "{c:?}");
            let shape = |body| scene.bodies()[usize::try_from(body).expect("small")].shape;
            kinds.insert((shape(c.body_a).div_ceil(2), shape(c.body_b).div_ceil(2)));
            for contact in &c.contacts[..usize::try_from(c.count).expect("small")] {
                assert!(contact.distance.is_finite() && contact.distance <= MARGIN, "{c:?}");
                // With deep overlap, the nearest sides are not opposite ones.
                if c.contacts.iter().any(|contact| contact.distance < -0.1) {
                    continue;
                }
                let off = outside(&scene, c.body_b, contact.point);
                assert!(off.abs() < NEAR, "{off} m off the surface of B: {c:?}");
                shallow += 1;
                if c.body_a != crate::GROUND {
                    let [x, y, z] =
                        [0, 1, 2].map(|k| contact.point[k] + contact.distance * c.normal[k]);
                    let off = outside(&scene, c.body_a, [x, y, z]);
                    assert!(off.abs() < NEAR, "{off} m off the surface of A: {c:?}");
                }
            }
        }
        assert!(shallow > 100, "{shallow}");
        // The ground and six kinds of bodies, each with each of the six.
        assert_eq!(kinds.len(), 42, "{kinds:?}");
    }

    #[test]
    fn the_bits_are_the_same_in_every_build_and_on_every_architecture() {
        let mut scene = pressed(5);
        // The second time with used buffers.
        scene.detect();
        let inertias = scene.shapes().iter().flat_map(|shape| shape.inverse_inertia);
        let words: Vec<u32> = inertias.map(f32::to_bits).collect();
        let found = digest(words.into_iter().chain(bits(scene.detect())));
        assert_eq!(found, "72b54e17599f7ac4");
    }
}
