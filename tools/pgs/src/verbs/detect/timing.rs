//! Times the broad phase and the narrow phase.

use std::time::Duration;

use scene::{DetectionTimes, Scene};

/// The times of detection, and the number of pairs of the broad phase.
#[derive(Debug)]
pub(super) struct Timing {
    /// Of the detection that starts from nothing.
    pub(super) first: Phases,
    /// Of the detection after a time step, with everything kept.
    pub(super) next: Phases,
}

/// Median times of both phases, and the pairs between them.
#[derive(Debug)]
pub(super) struct Phases {
    pub(super) broad: Duration,
    pub(super) narrow: Duration,
    pub(super) pairs: usize,
}

impl Timing {
    /// Detects `runs` times; the scene keeps its poses and the collisions of the last detection.
    pub(super) fn measure(scene: &mut Scene, threads: u16, time_step: f32, runs: u32) -> Self {
        let here: Vec<_> = scene.bodies().iter().map(|body| body.pose).collect();
        let (mut first, mut next) = (Vec::new(), Vec::new());
        let (mut pairs, mut next_pairs) = (0, 0);
        for _ in 0..runs {
            // Forgets what earlier detections have kept.
            scene.set_threads(threads.into());
            scene.detect();
            first.push(scene.detection_times());
            pairs = scene.pairs().count();
            for body in scene.bodies_mut() {
                let velocity = body.velocity.linear;
                for (coordinate, speed) in body.pose.position.iter_mut().zip(velocity) {
                    *coordinate += speed * time_step;
                }
            }
            scene.detect();
            next.push(scene.detection_times());
            next_pairs = scene.pairs().count();
            for (body, pose) in scene.bodies_mut().iter_mut().zip(&here) {
                body.pose = *pose;
            }
        }
        scene.set_threads(threads.into());
        scene.detect();
        let phases = |times: &[DetectionTimes], pairs| Phases {
            broad: median(times, |times| times.broad),
            narrow: median(times, |times| times.narrow),
            pairs,
        };
        Self { first: phases(&first, pairs), next: phases(&next, next_pairs) }
    }
}

fn median(times: &[DetectionTimes], of: impl Fn(&DetectionTimes) -> Duration) -> Duration {
    let mut times: Vec<Duration> = times.iter().map(of).collect();
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use scene::SceneOptions;

    use super::*;

    #[test]
    fn poses_are_kept_and_pairs_are_counted_before_and_after_the_time_step() {
        let grid = "4x4x4".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
        let mut scene = Scene::new(&options).expect("a scene");
        // Body 5 flies away.
        scene.bodies_mut()[5].velocity.linear = [0.0, 300.0, 0.0];
        let before = scene.bodies().to_vec();
        let measured = Timing::measure(&mut scene, 1, 0.1, 3);
        assert_eq!(scene.bodies(), before);
        let of_five = scene.pairs().filter(|&(a, b)| a == 5 || b == 5).count();
        assert!(of_five > 0);
        assert_eq!(measured.first.pairs, scene.pairs().count());
        assert_eq!(measured.next.pairs, measured.first.pairs - of_five);
    }
}
