//! Measures how far results deviate from the original ones: the thesis' measure and ours.
//!
//! | measure | over | a component whose original is 0 |
//! |---|---|---|
//! | relative deviation, \|new - original\| / \|original\| (eq. 4.1) | the others | is left out, and counted |
//! | share within 1 % | all components | is within if the new one is 0 too |
//! | absolute difference, \|new - original\| | all components | counts like any other |

use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use zynq_pgs::{Body, Shape};

/// Relative deviation up to which two numbers count as the same.
const ONE_PERCENT: f64 = 0.01;

/// How new numbers deviate from the original ones, component by component.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Deviation {
    /// Components compared.
    pub(crate) components: u64,
    /// Components whose original is 0.
    pub(crate) zeros: u64,
    /// Components whose original is 0 and whose new value is not.
    pub(crate) zeros_moved: u64,
    /// Mean relative deviation where the original is not 0.
    pub(crate) mean: f64,
    /// Largest relative deviation where the original is not 0.
    pub(crate) largest: f64,
    /// Components whose original is not 0 and that deviate by less than 1 %.
    pub(crate) under: u64,
    /// Components that differ by at most 1 % of the original, among all.
    pub(crate) within: u64,
    /// Mean absolute difference.
    pub(crate) mean_absolute: f64,
    /// Largest absolute difference.
    pub(crate) largest_absolute: f64,
}

impl Deviation {
    /// Compares pairs (original, new) of finite numbers.
    pub(crate) fn of(pairs: impl IntoIterator<Item = (f32, f32)>) -> Self {
        let mut found = Self::default();
        let (mut relative_sum, mut absolute_sum) = (0.0, 0.0);
        for (original, new) in pairs {
            let original = f64::from(original);
            let difference = (f64::from(new) - original).abs();
            found.components += 1;
            absolute_sum += difference;
            raise_to(&mut found.largest_absolute, difference);
            if difference <= ONE_PERCENT * original.abs() {
                found.within += 1;
            }
            if original == 0.0 {
                found.zeros += 1;
                found.zeros_moved += u64::from(difference > 0.0);
                continue;
            }
            let relative = difference / original.abs();
            relative_sum += relative;
            raise_to(&mut found.largest, relative);
            found.under += u64::from(relative < ONE_PERCENT);
        }
        found.mean = mean(relative_sum, found.nonzero());
        found.mean_absolute = mean(absolute_sum, found.components);
        found
    }

    /// Components whose original is not 0.
    fn nonzero(&self) -> u64 {
        self.components - self.zeros
    }

    /// Share of the components whose original is not 0 that deviate by less than 1 %.
    pub(crate) fn under_share(&self) -> f64 {
        share(self.under, self.nonzero())
    }

    /// Share of all components that are within 1 %.
    pub(crate) fn within_share(&self) -> f64 {
        share(self.within, self.components)
    }

    /// For programs; relative numbers in percent.
    pub(crate) fn to_json(self) -> Value {
        json!({
            "components": self.components,
            "original_zero": self.zeros,
            "original_zero_new_not": self.zeros_moved,
            "relative_mean_percent": self.mean * 100.0,
            "relative_largest_percent": self.largest * 100.0,
            "under_1_percent_share": self.under_share(),
            "within_1_percent_share": self.within_share(),
            "absolute_mean": self.mean_absolute,
            "absolute_largest": self.largest_absolute,
        })
    }
}

impl Serialize for Deviation {
    /// As [`to_json`](Self::to_json).
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// The deviations between two states of the same bodies, for moving bodies only.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(crate) struct StateDeviation {
    pub(crate) position: Deviation,
    #[serde(rename = "linear_velocity")]
    pub(crate) linear: Deviation,
    #[serde(rename = "angular_velocity")]
    pub(crate) angular: Deviation,
}

impl StateDeviation {
    /// Compares `new` with `original`; `moving` marks the moving bodies.
    pub(crate) fn of(original: &[Body], new: &[Body], moving: &[bool]) -> Self {
        let of =
            |field: fn(&Body) -> [f32; 3]| Deviation::of(components(original, new, moving, field));
        Self {
            position: of(|body| body.pose.position),
            linear: of(|body| body.velocity.linear),
            angular: of(|body| body.velocity.angular),
        }
    }
}

/// The share of the moving bodies' position components that a step did not change: the bits after
/// the step equal the bits sent to the board. `carried` rounds a number as the board's streams do.
pub(crate) fn unmoved_share(
    before: &[Body],
    after: &[Body],
    moving: &[bool],
    carried: impl Fn(f32) -> f32,
) -> f64 {
    let (mut components, mut unmoved) = (0, 0);
    for (before, after) in pairs(before, after, moving) {
        for (before, after) in before.pose.position.iter().zip(after.pose.position) {
            components += 1;
            unmoved += u64::from(carried(*before).to_bits() == after.to_bits());
        }
    }
    mean(unmoved as f64, components)
}

/// Whether each body can move.
pub(crate) fn moving(bodies: &[Body], shapes: &[Shape]) -> Vec<bool> {
    let moves = |body: &Body| {
        let shape = usize::try_from(body.shape).ok().and_then(|index| shapes.get(index));
        shape.is_some_and(|shape| shape.inverse_mass != 0.0)
    };
    bodies.iter().map(moves).collect()
}

/// The pairs (original, new) of the moving bodies' components.
pub(crate) fn components<'a>(
    original: &'a [Body],
    new: &'a [Body],
    moving: &'a [bool],
    field: fn(&Body) -> [f32; 3],
) -> impl Iterator<Item = (f32, f32)> + 'a {
    pairs(original, new, moving)
        .flat_map(move |(original, new)| field(original).into_iter().zip(field(new)))
}

fn pairs<'a>(
    a: &'a [Body],
    b: &'a [Body],
    moving: &'a [bool],
) -> impl Iterator<Item = (&'a Body, &'a Body)> {
    a.iter().zip(b).zip(moving).filter_map(|(pair, moving)| moving.then_some(pair))
}

fn raise_to(most: &mut f64, value: f64) {
    if value > *most {
        *most = value;
    }
}

/// The mean; 0 for an empty sum.
fn mean(sum: f64, count: u64) -> f64 {
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// The share; 1 for an empty whole.
pub(crate) fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 1e-6, "{found} for {wanted}");
    }

    #[test]
    fn the_measure_is_that_of_the_thesis() {
        // 0.5 %, 2 % and 0 % of the original.
        let d = Deviation::of([(2.0, 2.01), (-100.0, -98.0), (7.0, 7.0)]);
        near(d.mean, (0.005 + 0.02) / 3.0);
        near(d.largest, 0.02);
        near(d.under_share(), 2.0 / 3.0);
        near(d.within_share(), 2.0 / 3.0);
        near(d.mean_absolute, 2.01 / 3.0);
        near(d.largest_absolute, 2.0);
        assert_eq!((d.components, d.zeros), (3, 0));
    }

    #[test]
    fn exactly_one_percent_is_within_and_not_under() {
        let d = Deviation::of([(100.0, 101.0)]);
        assert_eq!((d.under, d.within), (0, 1));
    }

    #[test]
    fn a_zero_is_left_out_of_what_is_relative_and_within_only_as_zero() {
        let d = Deviation::of([(0.0, 0.0), (-0.0, 0.0), (0.0, 3.0), (1.0, 1.0)]);
        assert_eq!((d.components, d.zeros, d.zeros_moved), (4, 3, 1));
        near(d.mean, 0.0);
        near(d.under_share(), 1.0);
        near(d.within_share(), 0.75);
        near(d.largest_absolute, 3.0);
    }

    #[test]
    fn nothing_deviates_from_nothing() {
        let d = Deviation::of([]);
        near(d.under_share(), 1.0);
        near(d.within_share(), 1.0);
        near(d.mean + d.mean_absolute, 0.0);
    }

    fn body(position: [f32; 3], linear: [f32; 3]) -> Body {
        Body {
            pose: Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity { linear, angular: [1.0; 3] },
            shape: 0,
        }
    }

    #[test]
    fn only_moving_bodies_are_compared() {
        let a = [body([0.0; 3], [0.0; 3]), body([1.0, 2.0, 3.0], [1.0; 3])];
        let b = [body([9.0; 3], [0.0; 3]), body([1.0, 2.0, 3.03], [1.0, 2.0, 1.0])];
        let moving = [false, true];
        let state = StateDeviation::of(&a, &b, &moving);
        assert_eq!([state.position.components, state.linear.components], [3, 3]);
        near(state.position.largest, 0.01);
        near(state.linear.within_share(), 2.0 / 3.0);
        near(state.angular.within_share(), 1.0);
        near(unmoved_share(&a, &b, &moving, |number| number), 2.0 / 3.0);
        near(unmoved_share(&a, &b, &moving, |number| number + 0.03), 1.0 / 3.0);
        near(unmoved_share(&a, &b, &[false, false], |number| number), 0.0);
    }

    proptest! {
        #[test]
        fn numbers_do_not_deviate_from_themselves(
            numbers in prop::collection::vec(-1e30_f32..1e30, 0..50)
        ) {
            let d = Deviation::of(numbers.iter().map(|&number| (number, number)));
            prop_assert_eq!((d.under, d.within, d.zeros_moved), (d.nonzero(), d.components, 0));
            let sum = d.mean + d.largest + d.mean_absolute + d.largest_absolute;
            prop_assert_eq!(sum.to_bits(), 0.0_f64.to_bits());
        }
    }
}
