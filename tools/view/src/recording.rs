//! Keeps the poses of the moving bodies at some steps of a run.

use scene::Geometry;
use zynq_pgs::{Body, Pose};

use crate::error::ViewError;
use crate::kinds::Kinds;

/// Whether a file can show a pose: it is finite, and its orientation a direction.
fn is_shown(pose: &Pose) -> bool {
    let turned = pose.orientation.iter().any(|value| value.abs() > 0.0);
    turned && pose.position.iter().chain(&pose.orientation).all(|value| value.is_finite())
}

/// The poses after one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The number of steps taken before; 0 is the start.
    pub step: u32,
    /// The simulated time, s.
    pub time: f32,
    /// The pose of each moving body.
    pub poses: Vec<Pose>,
}

/// Place of a body that no frame has shown.
const ORIGIN: Pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };

/// The poses of the moving bodies at some steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The index of each moving body in the scene.
    bodies: Vec<usize>,
    /// The different geometries.
    geometries: Vec<Geometry>,
    /// The index of each moving body's geometry.
    kinds: Vec<usize>,
    frames: Vec<Frame>,
}

impl Recording {
    /// Begins a recording of the bodies that have a geometry; `geometries` has one for each shape.
    #[must_use]
    pub fn new(bodies: &[Body], geometries: &[Option<Geometry>]) -> Self {
        let Kinds { geometries, of_body } = Kinds::of(bodies, geometries);
        let moving = of_body.iter().enumerate().filter_map(|(index, kind)| Some((index, (*kind)?)));
        let (bodies, kinds) = moving.unzip();
        Self { bodies, geometries, kinds, frames: vec![] }
    }

    /// Adds a frame after `step` steps, or between that step and the next; does nothing if the last
    /// frame has its time. A body that `bodies` lacks stays where it was.
    ///
    /// # Errors
    /// [`ViewError::Pose`], [`ViewError::Time`]: not finite. The recording is as it was.
    pub fn add(&mut self, step: u32, time: f32, bodies: &[Body]) -> Result<(), ViewError> {
        if self.frames.last().is_some_and(|frame| frame.time.to_bits() == time.to_bits()) {
            return Ok(());
        }
        let frame = self.alone(step, time, bodies)?;
        self.frames.push(frame);
        Ok(())
    }

    /// The frame that [`add`](Self::add) adds.
    pub(crate) fn alone(&self, step: u32, time: f32, bodies: &[Body]) -> Result<Frame, ViewError> {
        if !time.is_finite() {
            return Err(ViewError::Time { step, found: time });
        }
        let last = self.frames.last().map(|frame| frame.poses.as_slice()).unwrap_or_default();
        let was = |place: usize| last.get(place).copied().unwrap_or(ORIGIN);
        let pose = |(place, index): (usize, &usize)| {
            let pose = bodies.get(*index).map_or_else(|| was(place), |body| body.pose);
            is_shown(&pose).then_some(pose).ok_or(ViewError::Pose { step, body: *index, pose })
        };
        let poses = self.bodies.iter().enumerate().map(pose).collect::<Result<_, _>>()?;
        Ok(Frame { step, time, poses })
    }

    /// The number of moving bodies.
    #[must_use]
    pub fn bodies(&self) -> usize {
        self.bodies.len()
    }

    /// The different geometries of the bodies.
    #[must_use]
    pub fn geometries(&self) -> &[Geometry] {
        &self.geometries
    }

    /// The index of each body's geometry.
    #[must_use]
    pub fn kinds(&self) -> &[usize] {
        &self.kinds
    }

    /// The frames, in the order of time.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }
}

/// A small recording for tests: cubes that fall and turn.
#[cfg(test)]
pub(crate) fn fixture(frames: u32) -> Recording {
    use scene::{Scene, ShapesOptions};
    let grid = "3x2x3".parse().expect("a grid");
    let mut scene = Scene::of_shapes(&ShapesOptions { grid, drop: 1.0, seed: 4 }).expect("a scene");
    let mut recording = Recording::new(scene.bodies(), scene.geometries());
    for step in 0..frames {
        let time = 0.1 * f32::from(u16::try_from(step).expect("few"));
        recording.add(step, time, scene.bodies()).expect("finite poses");
        for (index, body) in scene.bodies_mut()[1..].iter_mut().enumerate() {
            if index > 2 {
                let Pose { position, orientation } = &mut body.pose;
                position[1] -= 0.5 * time;
                position[0] += 0.01 * f32::from(u16::try_from(index).expect("few"));
                // A turn about x by 2 atan(0.1).
                let [x, y, z, w] = *orientation;
                let turned = [x + 0.1 * w, y - 0.1 * z, z + 0.1 * y, w - 0.1 * x];
                *orientation = turned.map(|value| value / 1.01_f32.sqrt());
            }
        }
    }
    recording
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::TooLarge;

    #[test]
    fn the_ground_is_left_out_and_equal_geometries_are_one() {
        let recording = fixture(3);
        assert_eq!(recording.bodies(), 18);
        let names: Vec<_> = recording.geometries().iter().map(Geometry::name).collect();
        let mut once = names.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(names.len(), once.len(), "{names:?}");
        assert!(recording.kinds().iter().all(|kind| *kind < names.len()));
    }

    #[test]
    fn a_time_is_recorded_once() {
        let mut recording = fixture(3);
        assert_eq!(recording.frames().len(), 3);
        recording.add(2, 0.2, &[]).expect("no frame");
        assert_eq!(recording.frames().len(), 3);
        // Bodies that are missing stay where they were.
        recording.add(3, 0.3, &[]).expect("finite poses");
        assert_eq!(recording.frames()[3].poses, recording.frames()[2].poses);
    }

    #[test]
    fn a_pose_that_is_not_finite_is_refused_and_named() {
        let scene = scene::Scene::new(&scene::SceneOptions::default()).expect("a scene");
        let mut recording = Recording::new(scene.bodies(), scene.geometries());
        let mut bodies = scene.bodies().to_vec();
        recording.add(0, 0.0, &bodies).expect("finite poses");
        for wrong in [
            |pose: &mut Pose| pose.position[1] = f32::NAN,
            |pose: &mut Pose| pose.position[2] = f32::INFINITY,
            |pose: &mut Pose| pose.orientation[3] = f32::NEG_INFINITY,
            |pose: &mut Pose| pose.orientation = [0.0; 4],
        ] {
            let whole = bodies[2].pose;
            wrong(&mut bodies[2].pose);
            let refused = recording.add(1, 0.1, &bodies);
            assert!(
                matches!(refused, Err(ViewError::Pose { step: 1, body: 2, .. })),
                "{refused:?}"
            );
            bodies[2].pose = whole;
        }
        let refused = recording.add(1, f32::NAN, &bodies);
        assert!(matches!(refused, Err(ViewError::Time { step: 1, .. })), "{refused:?}");
        assert_eq!(recording.frames().len(), 1);
    }

    #[test]
    fn a_size_beyond_32_bits_is_refused_with_a_way_out() {
        assert_eq!(TooLarge::check("a part", 7), Ok(7));
        let said = TooLarge::check("a part", 1 << 32).expect_err("too large").to_string();
        assert!(said.contains("a part, found 4294967296: record fewer frames"), "{said}");
    }
}
