//! Measures how far results deviate from the original ones: the thesis' measure and ours.
//!
//! | measure | over | a component whose original is 0 |
//! |---|---|---|
//! | relative deviation, \|new - original\| / \|original\| (eq. 4.1) | the others | is left out, and counted |
//! | share within 1 % | all components | is within if the new one is 0 too |
//! | absolute difference, \|new - original\| | all components | counts like any other |

use zynq_pgs::{Body, Shape};

use crate::table::{Cell, Table, text};

/// Relative deviation up to which two numbers count as the same.
const ONE_PERCENT: f64 = 0.01;

/// How new numbers deviate from the original ones, component by component.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Deviation {
    /// Components compared.
    pub(crate) components: u64,
    /// Components whose original is 0.
    pub(crate) zeros: u64,
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
}

/// The deviations between two states of the same bodies, for moving bodies only.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct StateDeviation {
    pub(crate) position: Deviation,
    pub(crate) linear: Deviation,
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

/// The relative deviations of the components whose original is not 0, percent, in ascending order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Deviations(Vec<f64>);

/// Powers of ten by quarters of the exponent.
const QUARTERS: [f64; 4] =
    [1.0, 1.778_279_410_038_922_8, 3.162_277_660_168_379_5, 5.623_413_251_903_491];
/// Decades of a curve from 1e-6 %: an f32 changes by 6e-6 % at least.
const DECADES: [f64; 12] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5];
/// Deviations of a table, percent.
const EDGES: [(&str, &str, f64); 7] = [
    ("below_1e_4_percent", "below\n1e-4 %", 1e-4),
    ("below_1e_3_percent", "\n1e-3 %", 1e-3),
    ("below_1e_2_percent", "\n0.01 %", 0.01),
    ("below_1e_1_percent", "\n0.1 %", 0.1),
    ("below_1_percent", "\n1 %", 1.0),
    ("below_10_percent", "\n10 %", 10.0),
    ("below_100_percent", "\n100 %", 100.0),
];

impl Deviations {
    /// Of pairs (original, new) of finite numbers.
    pub(crate) fn of(pairs: impl IntoIterator<Item = (f32, f32)>) -> Self {
        let pairs = pairs.into_iter().map(|(original, new)| (f64::from(original), f64::from(new)));
        let pairs = pairs.filter(|(original, _)| *original != 0.0);
        let percent = pairs.map(|(original, new)| (new - original).abs() / original.abs() * 100.0);
        let mut all: Vec<f64> = percent.collect();
        all.sort_unstable_by(f64::total_cmp);
        Self(all)
    }

    /// All of several ones.
    pub(crate) fn merged<'a>(each: impl Iterator<Item = &'a Self>) -> Self {
        let mut all: Vec<f64> = each.flat_map(|one| one.0.iter().copied()).collect();
        all.sort_unstable_by(f64::total_cmp);
        Self(all)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The share of the numbers that deviate by less, percent.
    fn below_edge(&self, edge: f64) -> f64 {
        let below = self.0.partition_point(|deviation| *deviation < edge);
        100.0 * below as f64 / (self.0.len() as f64).max(1.0)
    }

    /// The shares of the numbers that deviate by less, four points a decade, up to all of them.
    pub(crate) fn below(&self) -> Vec<(f64, f64)> {
        let edges = DECADES.iter().flat_map(|decade| QUARTERS.map(|quarter| decade * quarter));
        let points: Vec<_> = edges.map(|edge| (edge, self.below_edge(edge))).collect();
        let some = points.iter().filter(|(edge, _)| self.0.last().is_some_and(|most| edge <= most));
        let needed = some.count() + 1;
        points.into_iter().take(needed).collect()
    }

    /// A table with a row for each of these.
    pub(crate) fn table(rows: &[(&str, &Self)]) -> Table {
        let columns: Vec<_> =
            [("of", "of")].into_iter().chain(EDGES.map(|(key, head, _)| (key, head))).collect();
        let title = "Positions after the last step that deviate by less, % of them";
        let mut table = Table::with_columns("positions", title, &columns);
        for (name, of) in rows.iter().filter(|(_, of)| !of.is_empty()) {
            let shares = EDGES.map(|(.., edge)| Cell::Number(of.below_edge(edge), 4));
            table.row([text(*name)].into_iter().chain(shares));
        }
        table
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
        assert_eq!((d.components, d.zeros), (4, 3));
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

    #[test]
    fn shares_below_rise_to_all_numbers_and_leave_out_zeros() {
        let found = Deviations::of([(1.0, 1.0), (0.0, 5.0), (1.0, 1.005), (1.0, 1.5)]);
        let points = found.below();
        assert!(points.windows(2).all(|pair| pair[0].1 <= pair[1].1));
        let at =
            |edge: f64| points.iter().find(|point| point.0 >= edge * 0.999).expect("an edge").1;
        near(at(0.1), 100.0 / 3.0);
        near(at(1.0), 200.0 / 3.0);
        near(points.last().expect("an edge").1, 100.0);
        assert_eq!(Deviations::merged([&found, &found].into_iter()).below(), points);
        assert_eq!(Deviations::of([(0.0, 1.0)]).below(), [(1e-6, 0.0)]);
    }

    proptest! {
        #[test]
        fn numbers_do_not_deviate_from_themselves(
            numbers in prop::collection::vec(-1e30_f32..1e30, 0..50)
        ) {
            let d = Deviation::of(numbers.iter().map(|&number| (number, number)));
            prop_assert_eq!((d.under, d.within), (d.nonzero(), d.components));
            let sum = d.mean + d.largest + d.mean_absolute + d.largest_absolute;
            prop_assert_eq!(sum.to_bits(), 0.0_f64.to_bits());
        }
    }
}
