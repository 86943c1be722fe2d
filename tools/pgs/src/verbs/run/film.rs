//! The poses of a run so far: at some of its steps, or in a rhythm of their own.

use std::time::Duration;

use scene::{Scene, StepClock, interpolate};
use zynq_pgs::Body;
use zynq_pgs_view::{Recording, ViewError};

use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::options::solver::time_of;

/// Part of a step that counts as none: the clock counts nanoseconds.
const WHOLE: f32 = 1e-3;

/// When a frame is due.
#[derive(Debug)]
pub(super) enum Rhythm {
    /// After every N-th step.
    Steps(u32),
    /// In simulated time, between two steps where it falls there.
    Time(Box<FrameClock>),
}

/// Frames in simulated time.
#[derive(Debug)]
pub(super) struct FrameClock {
    clock: StepClock,
    interval: Duration,
    /// Steps before the next frame; the clock has the part of a step after them.
    steps: u32,
    /// The bodies after the last step.
    before: Vec<Body>,
}

impl Rhythm {
    /// N frames a simulated second.
    pub(super) fn in_time(frames: u16, time_step: f32, scene: &Scene) -> Self {
        // A time step that is none is refused by the first step.
        let time_step = Duration::try_from_secs_f32(time_step).unwrap_or_default();
        let interval = Duration::from_secs(1) / u32::from(frames);
        let mut clock = StepClock::new(time_step);
        let steps = clock.advance(interval, u32::MAX);
        let before = scene.bodies().to_vec();
        Self::Time(Box::new(FrameClock { clock, interval, steps, before }))
    }
}

impl FrameClock {
    /// The next frame, if it lies before this number of steps: the steps before it, the part of a
    /// step after them, and its bodies.
    fn next(&mut self, steps: u32, bodies: &[Body]) -> Option<(u32, f32, Vec<Body>)> {
        if self.steps >= steps {
            return None;
        }
        let (before, fraction) = (self.steps, self.clock.fraction());
        self.steps = self.steps.saturating_add(self.clock.advance(self.interval, u32::MAX));
        if fraction < WHOLE {
            return Some((before, 0.0, self.before.clone()));
        }
        if fraction > 1.0 - WHOLE {
            return Some((before + 1, 0.0, bodies.to_vec()));
        }
        let between = |(before, after): (&Body, &Body)| Body {
            pose: interpolate(&before.pose, &after.pose, fraction),
            ..*after
        };
        Some((before, fraction, self.before.iter().zip(bodies).map(between).collect()))
    }
}

/// The poses of a run so far.
#[derive(Debug)]
pub(super) struct Film {
    recording: Recording,
    rhythm: Rhythm,
    time_step: f32,
}

impl Film {
    /// Begins with the scene at its start.
    pub(super) fn new(scene: &Scene, rhythm: Rhythm, time_step: f32) -> Result<Self> {
        let recording = Recording::new(scene.bodies(), scene.geometries());
        let mut film = Self { recording, rhythm, time_step };
        film.add(0, 0.0, scene.bodies())?;
        Ok(film)
    }

    /// Adds the frames that are due after `steps` steps.
    pub(super) fn step(&mut self, steps: u32, scene: &Scene) -> Result<()> {
        match &mut self.rhythm {
            Rhythm::Steps(every) if steps.is_multiple_of(*every) => {
                self.add(steps, 0.0, scene.bodies())
            }
            Rhythm::Steps(_) => Ok(()),
            Rhythm::Time(frames) => {
                let due: Vec<_> =
                    std::iter::from_fn(|| frames.next(steps, scene.bodies())).collect();
                frames.before.clear();
                frames.before.extend_from_slice(scene.bodies());
                due.into_iter().try_for_each(|(steps, part, bodies)| self.add(steps, part, &bodies))
            }
        }
    }

    /// Adds the scene after the last step.
    pub(super) fn end(&mut self, steps: u32, scene: &Scene) -> Result<()> {
        self.add(steps, 0.0, scene.bodies())
    }

    /// The length of a step, s.
    pub(super) fn time_step(&self) -> f32 {
        self.time_step
    }

    pub(super) fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Adds bodies some steps, and a part of one, after the start.
    fn add(&mut self, steps: u32, part: f32, bodies: &[Body]) -> Result<()> {
        let time = time_of(f64::from(steps) + f64::from(part), self.time_step);
        self.recording.add(steps, time, bodies).map_err(not_shown)
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
    fn frames(rhythm: impl Fn(&Scene) -> Rhythm) -> Vec<(u32, f32, f32)> {
        let grid = "1x1x1".parse().expect("a grid");
        let options = SceneOptions { grid, ..SceneOptions::default() };
        let mut scene = Scene::new(&options).expect("a scene");
        let begin = scene.bodies()[1].pose.position[1];
        let mut film = Film::new(&scene, rhythm(&scene), TIME_STEP).expect("finite poses");
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
    fn frames_of_steps_are_steps_and_the_last() {
        assert_near(&frames(|_| Rhythm::Steps(2)), &[(0, 0.0), (2, 2.0), (4, 4.0), (5, 5.0)]);
    }

    #[test]
    fn frames_in_time_lie_between_two_steps() {
        let found = frames(|scene| Rhythm::in_time(25, TIME_STEP, scene));
        assert_near(&found, &[(0, 0.0), (2, 2.4), (4, 4.8), (5, 5.0)]);
        let found = frames(|scene| Rhythm::in_time(150, TIME_STEP, scene));
        let expected: Vec<_> =
            [0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6, 4.0, 4.4, 4.8, 5.0]
                .into_iter()
                .zip([0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5])
                .map(|(passed, steps)| (steps, passed))
                .collect();
        assert_near(&found, &expected);
        // One frame a step.
        let found = frames(|scene| Rhythm::in_time(60, TIME_STEP, scene));
        let expected = [(0, 0.0), (1, 1.0), (2, 2.0), (3, 3.0), (4, 4.0), (5, 5.0)];
        assert_near(&found, &expected);
    }
}
