//! Times the two broad phases and the narrow phase.

use std::time::Duration;

use scene::{BroadPhase, DetectionTimes, Scene};

/// The time of one broad phase, and its pairs.
#[derive(Debug)]
pub(super) struct Timing {
    pub(super) broad_phase: BroadPhase,
    /// Median time of the search that starts from nothing.
    pub(super) first: Duration,
    /// Median time of the search after a time step, with everything kept.
    pub(super) next: Duration,
    /// Median time of the narrow phase.
    pub(super) narrow: Duration,
    pub(super) pairs: Vec<(u32, u32)>,
    pub(super) next_pairs: Vec<(u32, u32)>,
}

impl Timing {
    /// Detects `runs` times; the scene keeps its poses and the collisions of the last detection.
    pub(super) fn measure(
        scene: &mut Scene,
        broad_phase: BroadPhase,
        time_step: f32,
        runs: u32,
    ) -> Self {
        let here: Vec<_> = scene.bodies().iter().map(|body| body.pose).collect();
        let (mut first, mut next) = (Vec::new(), Vec::new());
        let (mut pairs, mut next_pairs) = (Vec::new(), Vec::new());
        for _ in 0..runs {
            // Forgets what earlier detections have kept.
            scene.set_broad_phase(broad_phase);
            scene.detect();
            first.push(scene.detection_times());
            pairs = scene.pairs().collect();
            for body in scene.bodies_mut() {
                let velocity = body.velocity.linear;
                for (coordinate, speed) in body.pose.position.iter_mut().zip(velocity) {
                    *coordinate += speed * time_step;
                }
            }
            scene.detect();
            next.push(scene.detection_times());
            next_pairs = scene.pairs().collect();
            for (body, pose) in scene.bodies_mut().iter_mut().zip(&here) {
                body.pose = *pose;
            }
        }
        scene.detect();
        Self {
            broad_phase,
            first: median(&first, |times| times.broad),
            next: median(&next, |times| times.broad),
            narrow: median(&first, |times| times.narrow),
            pairs,
            next_pairs,
        }
    }

    /// Whether both broad phases found the same pairs, at the start and after the time step.
    pub(super) fn finds_the_lists_of(&self, other: &Self) -> bool {
        self.pairs == other.pairs && self.next_pairs == other.next_pairs
    }

    /// The name for people and programs.
    pub(super) const fn name(&self) -> &'static str {
        match self.broad_phase {
            BroadPhase::Grid => "grid",
            BroadPhase::Sweep => "sweep",
        }
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
    fn poses_are_kept_and_both_broad_phases_find_one_list() {
        let grid = "4x4x4".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
        let mut scene = Scene::new(&options).expect("a scene");
        scene.bodies_mut()[5].velocity.linear = [0.0, 300.0, 0.0];
        let before = scene.bodies().to_vec();
        let measured = [BroadPhase::Grid, BroadPhase::Sweep]
            .map(|broad_phase| Timing::measure(&mut scene, broad_phase, 0.1, 3));
        assert_eq!(scene.bodies(), before);
        assert!(measured[0].finds_the_lists_of(&measured[1]));
        // Body 5 has flown away.
        let with_five = |pairs: &[(u32, u32)]| pairs.iter().any(|&(a, b)| a == 5 || b == 5);
        assert!(with_five(&measured[0].pairs) && !with_five(&measured[0].next_pairs));
        let other = Timing {
            next_pairs: Vec::new(),
            ..Timing::measure(&mut scene, BroadPhase::Grid, 0.1, 1)
        };
        assert!(!other.finds_the_lists_of(&measured[1]));
    }
}
