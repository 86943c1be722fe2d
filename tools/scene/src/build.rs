//! Builds the scene and holds its bodies and collisions.

use pgs_support::float_env::standard;
use zynq_pgs::{Body, Collision, Pose, Shape, Velocity};

use crate::detect::{DetectionTimes, Detector, Geometries};
use crate::{CUBE_HALF_EXTENT, GROUND, GROUND_HALF_EXTENT, Geometry, Grid, SceneError};

/// Largest drop, m.
pub const DROP_MAX: f32 = 1000.0;

/// Distance between the centres of neighbours in a layer, m.
const SPACING: f32 = 2.2;

/// Indices into the shape table.
pub(crate) const STATIC_SHAPE: u32 = 0;
pub(crate) const CUBE_SHAPE: u32 = 1;

/// The inverse inertia of the cubes about every axis, 1/(kg m²): Bullet's value on registering the
/// cube, 0.36761099. Bullet enlarges the box by its margin, and takes the full size in place of half
/// of it; a textbook has 1.5.
const CUBE_INVERSE_INERTIA: f32 = f32::from_bits(0x3EBC_3782);

/// The options of a scene. The default is the thesis' scene, dropped from 5 m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneOptions {
    /// Cubes along each axis.
    pub grid: Grid,
    /// Height of the lowest layer's underside above the ground at the start, m.
    pub drop: f32,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self { grid: Grid::default(), drop: 5.0 }
    }
}

/// Bodies above a plane: cubes of 1 kg, or [several shapes](Self::of_shapes).
///
/// Body 0 is the ground: a static box whose top is the plane y = 0. The other bodies follow in the
/// order of x, then y, then z, with z the fastest.
///
/// Detection keeps contacts of bodies that hardly move against each other, so that the collisions
/// depend a little on earlier poses. A clone goes on as the scene itself would.
#[derive(Debug, Clone)]
pub struct Scene {
    shapes: Vec<Shape>,
    /// The geometry of each shape; none for the ground.
    geometries: Vec<Option<Geometry>>,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    /// The friction of each shape; none if all pairs have the same.
    frictions: Vec<f32>,
    detector: Detector,
}

impl Scene {
    /// Builds the scene of cubes, at rest.
    ///
    /// # Errors
    /// [`SceneError::Drop`] if the drop is negative, not a number or above [`DROP_MAX`].
    pub fn new(options: &SceneOptions) -> Result<Self, SceneError> {
        standard(|| Self::build(options))
    }

    fn build(options: &SceneOptions) -> Result<Self, SceneError> {
        let drop = check_drop(options.drop)?;
        let mut bodies = Vec::new();
        for i in 0..options.grid.x() {
            for j in 0..options.grid.y() {
                let shift = f32::from((j + 1) & 1);
                for k in 0..options.grid.z() {
                    let position = [
                        shift + SPACING * f32::from(i),
                        (CUBE_HALF_EXTENT + 2.0 * f32::from(j)) + drop,
                        shift + SPACING * f32::from(k),
                    ];
                    bodies.push(at_rest(position, CUBE_SHAPE));
                }
            }
        }
        Ok(Self::on_ground(&[cube()], bodies))
    }

    /// Puts `bodies` on the ground; their shapes are numbered from 1 in the order of `kinds`.
    pub(crate) fn on_ground(kinds: &[(Shape, Geometry)], bodies: Vec<Body>) -> Self {
        let ground = at_rest([0.0, -GROUND_HALF_EXTENT, 0.0], STATIC_SHAPE);
        Self {
            shapes: std::iter::once(Shape::STATIC).chain(kinds.iter().map(|kind| kind.0)).collect(),
            geometries: std::iter::once(None).chain(kinds.iter().map(|k| Some(k.1))).collect(),
            bodies: std::iter::once(ground).chain(bodies).collect(),
            collisions: Vec::new(),
            frictions: Vec::new(),
            detector: Detector::default(),
        }
    }

    /// The geometry of each shape; none for the ground.
    #[must_use]
    pub fn geometries(&self) -> &[Option<Geometry>] {
        &self.geometries
    }

    /// The shape table: shape 0 is static, the others move.
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The bodies, mutable.
    #[must_use]
    pub fn bodies_mut(&mut self) -> &mut [Body] {
        &mut self.bodies
    }

    /// The collisions of the last [`detect`](Self::detect); none before the first.
    #[must_use]
    pub fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// The number of collisions with the ground, which come first.
    #[must_use]
    pub fn ground_pairs(&self) -> usize {
        self.collisions.partition_point(|collision| collision.body_a == GROUND)
    }

    /// The input of a step: the bodies, and the collisions of the last [`detect`](Self::detect).
    #[must_use]
    pub fn parts_mut(&mut self) -> (&mut [Body], &[Collision]) {
        (&mut self.bodies, &self.collisions)
    }

    /// Sets the number of threads for detection, the caller's included; no result depends on it.
    /// The next detection starts from nothing.
    /// The default is the machine's number, up to eight.
    pub fn set_threads(&mut self, threads: usize) {
        self.detector.set_threads(threads.max(1));
    }

    /// Detects the collisions of the current poses, sorted by body A, then body B.
    ///
    /// Pairs up to [`MARGIN`](crate::MARGIN) apart are collisions, too. The ground is always body
    /// A; of two other bodies, A has the lower index. A body whose pose is not finite collides with
    /// nothing, and a step refuses it.
    pub fn detect(&mut self) -> &[Collision] {
        let Self { geometries, bodies, collisions, detector, frictions, .. } = self;
        standard(|| {
            detector.detect(bodies, Geometries(geometries), collisions);
            let friction_of = |body: u32| {
                let shape = bodies.get(body as usize).map(|body| body.shape as usize);
                shape.and_then(|shape| frictions.get(shape)).copied()
            };
            for collision in &mut *collisions {
                let both = friction_of(collision.body_a).zip(friction_of(collision.body_b));
                if let Some((a, b)) = both {
                    *collision = collision.with_friction((a * b).sqrt());
                }
            }
        });
        collisions
    }

    /// The times of the last [`detect`](Self::detect).
    #[must_use]
    pub fn detection_times(&self) -> DetectionTimes {
        self.detector.times()
    }

    /// The pairs of bodies that the broad phase of the last [`detect`](Self::detect) found: their
    /// bounding boxes are at most 2.1 cm apart along each axis. The lower index comes first, the
    /// list is sorted, and the ground has no part in it.
    pub fn pairs(&self) -> impl Iterator<Item = (u32, u32)> {
        standard(|| self.detector.pairs().collect::<Vec<_>>()).into_iter()
    }

    /// Gives each collision a friction of its own from now on: the geometric mean of the frictions
    /// of both shapes, one for each of [`shapes`](Self::shapes).
    pub fn set_frictions(&mut self, frictions: &[f32]) {
        self.frictions = frictions.to_vec();
    }
}

/// Refuses a drop that no scene can start from.
pub(crate) fn check_drop(drop: f32) -> Result<f32, SceneError> {
    match (0.0..=DROP_MAX).contains(&drop) {
        true => Ok(drop),
        false => Err(SceneError::Drop { found: drop, most: DROP_MAX }),
    }
}

/// The cubes' shape.
pub(crate) fn cube() -> (Shape, Geometry) {
    (Shape::isotropic(1.0, CUBE_INVERSE_INERTIA), Geometry::CUBE)
}

/// A body at rest, with its axes along the world's.
pub(crate) fn at_rest(position: [f32; 3], shape: u32) -> Body {
    Body {
        pose: Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(grid: &str, drop: f32) -> Scene {
        let grid = grid.parse().expect("a grid");
        Scene::new(&SceneOptions { grid, drop }).expect("a scene")
    }

    #[test]
    fn cubes_follow_the_ground_with_z_fastest_then_y_then_x() {
        let scene = scene("2x2x2", 5.0);
        let positions: Vec<[f32; 3]> = scene.bodies().iter().map(|b| b.pose.position).collect();
        assert_eq!(
            positions,
            [
                [0.0, -400.0, 0.0],
                [1.0, 6.0, 1.0],
                [1.0, 6.0, 3.2],
                [0.0, 8.0, 0.0],
                [0.0, 8.0, 2.2],
                [3.2, 6.0, 1.0],
                [3.2, 6.0, 3.2],
                [2.2, 8.0, 0.0],
                [2.2, 8.0, 2.2],
            ]
        );
        assert_eq!(scene.bodies()[0].shape, STATIC_SHAPE);
        assert!(scene.bodies()[1..].iter().all(|body| body.shape == CUBE_SHAPE));
        assert_eq!(scene.shapes()[0], Shape::STATIC);
        assert_eq!(scene.shapes()[1].inverse_inertia.map(f32::to_bits), [0x3EBC_3782; 3]);
    }

    #[test]
    fn a_drop_that_no_scene_starts_from_is_refused() {
        for drop in [-1.0, 1000.5, f32::INFINITY, f32::NAN] {
            let options = SceneOptions { drop, ..SceneOptions::default() };
            assert!(matches!(Scene::new(&options), Err(SceneError::Drop { .. })), "{drop}");
        }
    }

    /// A cube of one layer lies on four of the next, except at the borders: along a side of n
    /// cubes, n neighbours have the same number and n - 1 have the next one.
    fn pairs_of_the_lattice(x: usize, y: usize, z: usize) -> usize {
        (y - 1) * (2 * x - 1) * (2 * z - 1)
    }

    #[test]
    fn the_lattice_touches_layer_on_layer() {
        for (grid, expected) in
            [("1x1x1", 0), ("5x4x3", pairs_of_the_lattice(5, 4, 3)), ("12x10x12", 9 * 23 * 23)]
        {
            assert_eq!(scene(grid, 5.0).detect().len(), expected, "{grid}");
        }
        // Without a drop the lowest layer lies on the ground.
        let mut scene = scene("5x4x3", 0.0);
        assert_eq!(scene.detect().len(), 15 + pairs_of_the_lattice(5, 4, 3));
        assert_eq!(scene.ground_pairs(), 15);
        assert_eq!(crate::ground_pairs(scene.collisions()), 15);
    }

    #[test]
    fn the_scene_of_the_thesis_starts_with_146189_pairs() {
        let mut scene = Scene::new(&SceneOptions::default()).expect("a scene");
        let collisions = scene.detect();
        assert_eq!(collisions.len(), 146_189);
        assert_eq!(pairs_of_the_lattice(36, 30, 36), 146_189);
        assert!(collisions.iter().all(|c| c.count == 4));
    }

    #[test]
    fn a_dropped_pile_meets_the_ground_in_step_62() {
        // Free fall as the accelerator integrates it: position first, then gravity.
        let mut scene = scene("3x3x3", 5.0);
        let time_step = 1.0_f32 / 60.0;
        let mut first = None;
        for step in 1..=62 {
            if first.is_none() && crate::ground_pairs(scene.detect()) > 0 {
                first = Some(step);
            }
            for body in &mut scene.bodies_mut()[1..] {
                body.pose.position[1] += body.velocity.linear[1] * time_step;
                body.velocity.linear[1] += -9.8 * time_step;
            }
        }
        assert_eq!(first, Some(62));
    }
}
