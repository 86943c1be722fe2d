//! The poses of a run so far, at some of its steps.

use scene::Scene;
use zynq_pgs_view::{Recording, ViewError};

use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::options::solver::time_of;

/// The poses of a run so far.
#[derive(Debug)]
pub(super) struct Film {
    recording: Recording,
    /// Frames of a step, at most one.
    a_step: f64,
    time_step: f32,
}

impl Film {
    /// Begins with the scene at its start.
    pub(super) fn new(scene: &Scene, a_step: f64, time_step: f32) -> Result<Self> {
        let recording = Recording::new(scene.bodies(), scene.geometries());
        let mut film = Self { recording, a_step, time_step };
        film.end(0, scene)?;
        Ok(film)
    }

    /// Adds the frame that may be due after `steps` steps.
    pub(super) fn step(&mut self, steps: u32, scene: &Scene) -> Result<()> {
        // A share such as a third is no number of the machine's.
        let frames = |steps: u32| (f64::from(steps) * self.a_step + 1e-6).floor();
        if frames(steps) > frames(steps.saturating_sub(1)) {
            self.end(steps, scene)
        } else {
            Ok(())
        }
    }

    /// Adds the scene after `steps` steps, once.
    pub(super) fn end(&mut self, steps: u32, scene: &Scene) -> Result<()> {
        let time = time_of(f64::from(steps), self.time_step);
        self.recording.add(steps, time, scene.bodies()).map_err(not_shown)
    }

    /// The length of a step, s.
    pub(super) fn time_step(&self) -> f32 {
        self.time_step
    }

    pub(super) fn recording(&self) -> &Recording {
        &self.recording
    }
}

/// A frame that no file shows.
fn not_shown(error: ViewError) -> Failure {
    Failure::new(Cause::Output, error).next("give fewer --steps, or leave out --poses and --view")
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::SceneOptions;

    const TIME_STEP: f32 = 1.0 / 60.0;

    /// Films five steps; a cube falls by 1 m in each. Returns the steps, the time and the fall of
    /// every frame.
    fn frames(a_step: f64) -> Vec<(u32, f32, f32)> {
        let grid = "1x1x1".parse().expect("a grid");
        let options = SceneOptions { grid, ..SceneOptions::default() };
        let mut scene = Scene::new(&options).expect("a scene");
        let begin = scene.bodies()[1].pose.position[1];
        let mut film = Film::new(&scene, a_step, TIME_STEP).expect("finite poses");
        for step in 1..=5 {
            scene.bodies_mut()[1].pose.position[1] -= 1.0;
            film.step(step, &scene).expect("finite poses");
        }
        film.end(5, &scene).expect("finite poses");
        let frames = film.recording().frames().iter();
        frames.map(|one| (one.step, one.time, begin - one.poses[0].position[1])).collect()
    }

    fn assert_near(found: &[(u32, f32, f32)], expected: &[(u32, f32)]) {
        let steps: Vec<u32> = found.iter().map(|(steps, ..)| *steps).collect();
        assert_eq!(steps, expected.iter().map(|(steps, _)| *steps).collect::<Vec<_>>());
        for ((_, time, fall), (_, passed)) in found.iter().zip(expected) {
            assert!((time - passed * TIME_STEP).abs() < 1e-6, "{found:?}");
            assert!((fall - passed).abs() < 1e-4, "{found:?}");
        }
    }

    #[test]
    fn frames_are_steps_and_the_last() {
        assert_near(&frames(0.5), &[(0, 0.0), (2, 2.0), (4, 4.0), (5, 5.0)]);
        assert_near(&frames(1.0 / 3.0), &[(0, 0.0), (3, 3.0), (5, 5.0)]);
        // 24 of a second, of 60 steps.
        assert_near(&frames(0.4), &[(0, 0.0), (3, 3.0), (5, 5.0)]);
        assert_eq!(frames(2.0).len(), 6);
    }
}
