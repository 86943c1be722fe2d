//! Builds a scene from given poses.

use pgs_support::float_env::standard;
use zynq_pgs::Body;

use crate::build::{CUBE_SHAPE, STATIC_SHAPE, Scene, at_rest, cube};
use crate::{GROUND_HALF_EXTENT, SceneError};

/// How far the length of a unit quaternion may lie from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

impl Scene {
    /// Builds a scene of cubes from bodies with any poses and velocities. Body 0 is the ground; the
    /// others get the shape of [`SceneOptions::default`](crate::SceneOptions::default), whatever
    /// theirs is.
    ///
    /// # Errors
    /// [`SceneError::Ground`] if body 0 is not where the ground is; [`SceneError::Pose`] if a
    /// position is not finite or an orientation is no unit quaternion.
    pub fn of_cubes(bodies: &[Body]) -> Result<Self, SceneError> {
        standard(|| Self::build_of_cubes(bodies))
    }

    fn build_of_cubes(bodies: &[Body]) -> Result<Self, SceneError> {
        let [ground, cubes @ ..] = bodies else {
            return Err(SceneError::Ground { found: None });
        };
        check_poses(bodies)?;
        let expected = at_rest([0.0, -GROUND_HALF_EXTENT, 0.0], STATIC_SHAPE).pose;
        if ground.pose != expected {
            return Err(SceneError::Ground { found: Some(ground.pose) });
        }
        let cubes = cubes.iter().map(|body| Body { shape: CUBE_SHAPE, ..*body }).collect();
        Ok(Self::on_ground(&[cube()], cubes))
    }
}

/// Refuses positions that are not finite and orientations that are no unit quaternions.
fn check_poses(bodies: &[Body]) -> Result<(), SceneError> {
    for (body, Body { pose, .. }) in bodies.iter().enumerate() {
        let refused =
            |what, found: &[f32]| Err(SceneError::Pose { body, what, found: found.to_vec() });
        if !pose.position.iter().all(|value| value.is_finite()) {
            return refused("a finite position", &pose.position);
        }
        let [x, y, z, w] = pose.orientation;
        let length = (((x * x + y * y) + z * z) + w * w).sqrt();
        // False for a NaN.
        let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
        if !is_unit {
            return refused("an orientation of length 1", &pose.orientation);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneOptions;

    fn scene(grid: &str) -> Scene {
        let grid = grid.parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        Scene::new(&options).expect("a scene")
    }

    #[test]
    fn cubes_of_any_pose_touch_as_in_the_scene_they_come_from() {
        let mut expected = scene("4x3x4");
        let mut bodies = expected.bodies().to_vec();
        bodies[1].shape = 7;
        let mut found = Scene::of_cubes(&bodies).expect("a scene");
        assert_eq!(found.detect(), expected.detect());
        assert!(found.pairs().eq(expected.pairs()) && found.pairs().count() > 30);
    }

    #[test]
    fn bodies_without_a_ground_or_a_pose_are_refused() {
        let bodies = scene("1x1x1").bodies().to_vec();
        let refused = |change: &dyn Fn(&mut Vec<Body>)| {
            let mut bodies = bodies.clone();
            change(&mut bodies);
            Scene::of_cubes(&bodies).expect_err("a refusal").to_string()
        };
        let said = refused(&|bodies| bodies.clear());
        assert!(said.contains("found no bodies"), "{said}");
        let said = refused(&|bodies| bodies.swap(0, 1));
        assert!(said.contains("expected body 0") && said.contains("[1.0, 1.0, 1.0]"), "{said}");
        let said = refused(&|bodies| bodies[1].pose.position[2] = f32::NAN);
        assert!(said.contains("body 1") && said.contains("finite position"), "{said}");
        let said = refused(&|bodies| bodies[1].pose.orientation[3] = 0.5);
        assert!(said.contains("body 1") && said.contains("length 1"), "{said}");
    }
}
