//! Poses between two steps, for pictures at another rate than the steps.
//!
//! Source: thesis, section 2.1.1; Glenn Fiedler: "Fix your timestep!" (2004). Every step has the
//! same length. The time of a picture that no step has used yet remains for the next one, and the
//! picture shows the bodies that far on the way from the last step but one to the last.

use std::time::Duration;

use pgs_support::float_env::standard;
use zynq_pgs::Pose;

/// Tells how many steps are due, and how far between two steps a picture is.
#[derive(Debug, Clone, Copy)]
pub struct StepClock {
    time_step: Duration,
    remainder: Duration,
}

impl StepClock {
    /// Starts a clock for steps of this length; a length of zero counts as one nanosecond.
    #[must_use]
    pub fn new(time_step: Duration) -> Self {
        let time_step = time_step.max(Duration::from_nanos(1));
        Self { time_step, remainder: Duration::ZERO }
    }

    /// Adds the time since the last picture; returns the number of steps to take now, at most
    /// `most`. Time beyond them is dropped: a simulation that is slower than the clock falls behind
    /// instead of owing ever more steps.
    pub fn advance(&mut self, elapsed: Duration, most: u32) -> u32 {
        self.remainder = self.remainder.saturating_add(elapsed);
        let step = self.time_step.as_nanos();
        let due = self.remainder.as_nanos() / step;
        let rest = u64::try_from(self.remainder.as_nanos() % step).unwrap_or(0);
        self.remainder = Duration::from_nanos(rest);
        u32::try_from(due).map_or(most, |due| due.min(most))
    }

    /// The part of a step that remains, from 0 up to, and without, 1: the `fraction` for
    /// [`interpolate`].
    #[must_use]
    pub fn fraction(&self) -> f32 {
        #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let fraction = self.remainder.div_duration_f64(self.time_step) as f32;
        // Rounding must not reach the next step.
        fraction.min(1.0 - f32::EPSILON)
    }
}

/// The pose between two steps: the position on a straight line, the orientation on the shorter arc,
/// normalised. `fraction` is 0 before the step and 1 after it; other values are moved there.
#[must_use]
pub fn interpolate(before: &Pose, after: &Pose, fraction: f32) -> Pose {
    standard(|| between(before, after, fraction))
}

fn between(before: &Pose, after: &Pose, fraction: f32) -> Pose {
    let fraction = if fraction > 0.0 { fraction.min(1.0) } else { 0.0 };
    let rest = 1.0 - fraction;
    let [q, r] = [before.orientation, after.orientation];
    let cosine = ((q[0] * r[0] + q[1] * r[1]) + q[2] * r[2]) + q[3] * r[3];
    // q and -q are one orientation.
    let towards = if cosine < 0.0 { -fraction } else { fraction };
    let sum: [f32; 4] = std::array::from_fn(|k| rest * q[k] + towards * r[k]);
    let length = (((sum[0] * sum[0] + sum[1] * sum[1]) + sum[2] * sum[2]) + sum[3] * sum[3]).sqrt();
    Pose {
        position: std::array::from_fn(|k| rest * before.position[k] + fraction * after.position[k]),
        // Without a direction there is no arc.
        orientation: if length > 0.0 { sum.map(|value| value / length) } else { r },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pose turned by an angle about y.
    fn turned(position: [f32; 3], angle: f32) -> Pose {
        Pose { position, orientation: [0.0, (0.5 * angle).sin(), 0.0, (0.5 * angle).cos()] }
    }

    fn near(found: Pose, expected: Pose, tolerance: f32) {
        let numbers = |pose: Pose| pose.position.into_iter().chain(pose.orientation);
        for (one, other) in numbers(found).zip(numbers(expected)) {
            assert!((one - other).abs() < tolerance, "{found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn the_ends_are_the_two_steps_and_the_middle_is_halfway() {
        let before = turned([1.0, 2.0, 3.0], 0.2);
        let after = turned([3.0, 2.0, -1.0], 1.0);
        near(interpolate(&before, &after, 0.0), before, 1e-6);
        near(interpolate(&before, &after, 1.0), after, 1e-6);
        near(interpolate(&before, &after, 0.5), turned([2.0, 2.0, 1.0], 0.6), 1e-6);
        // A step turns a body by at most 45 degrees: within 0.1 degrees of an even turn.
        let after = turned([3.0, 2.0, -1.0], 0.2 + std::f32::consts::FRAC_PI_4);
        let quarter = turned([1.5, 2.0, 2.0], 0.2 + 0.25 * std::f32::consts::FRAC_PI_4);
        near(interpolate(&before, &after, 0.25), quarter, 2e-3);
    }

    #[test]
    fn the_shorter_arc_is_taken_and_the_length_stays_one() {
        let before = turned([0.0; 3], 0.1);
        let mut after = turned([0.0; 3], 0.5);
        after.orientation = after.orientation.map(|value| -value);
        near(interpolate(&before, &after, 0.5), turned([0.0; 3], 0.3), 1e-6);
        let [x, y, z, w] = interpolate(&before, &after, 0.3).orientation;
        assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-6);
    }

    #[test]
    fn fractions_beyond_a_step_and_quaternions_without_a_direction_are_caught() {
        let (before, after) = (turned([0.0; 3], 0.0), turned([1.0; 3], 0.4));
        for fraction in [-1.0, f32::NAN] {
            near(interpolate(&before, &after, fraction), before, 1e-6);
        }
        near(interpolate(&before, &after, f32::INFINITY), after, 1e-6);
        let nothing = Pose { orientation: [0.0; 4], ..before };
        near(interpolate(&nothing, &nothing, 0.5), nothing, 1e-6);
    }

    #[test]
    fn thirty_steps_a_second_give_sixty_pictures() {
        let mut clock = StepClock::new(Duration::from_millis(32));
        let picture = Duration::from_millis(16);
        let shown: Vec<_> = (0..4).map(|_| (clock.advance(picture, 8), clock.fraction())).collect();
        assert_eq!(shown.iter().map(|(steps, _)| *steps).collect::<Vec<_>>(), [0, 1, 0, 1]);
        for ((_, fraction), expected) in shown.iter().zip([0.5, 0.0, 0.5, 0.0]) {
            assert!((fraction - expected).abs() < 1e-6, "{shown:?}");
        }
    }

    #[test]
    fn a_slow_simulation_does_not_owe_ever_more_steps() {
        let mut clock = StepClock::new(Duration::from_millis(10));
        assert_eq!(clock.advance(Duration::from_millis(105), 3), 3);
        assert!((clock.fraction() - 0.5).abs() < 1e-6);
        assert_eq!(clock.advance(Duration::from_millis(5), 3), 1);
        assert_eq!(clock.advance(Duration::MAX, 3), 3);
        assert_eq!(StepClock::new(Duration::ZERO).advance(Duration::from_secs(1), 7), 7);
        assert!(clock.fraction() < 1.0);
    }
}
