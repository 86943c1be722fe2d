//! Figure 4.13: bodies alive in each slot of the thesis' sorted order.

use zynq_pgs::order::{IssueWindow, Order, OrderError, OrderInput, Orderer, Schedule};

use super::report::live_curve;
use crate::estimate::thesis::BODIES;
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::permutation::body_by_body::{self, Ties};
use crate::study::recorded::{MOST_ALIVE, MOST_ALIVE_PERCENT};
use pgs_command::numbers::grouped;

/// Ranges of slots; a curve shows the maximum of each.
const RANGES: usize = 400;

/// The largest number of each range of slots.
fn thinned(alive: &[u32]) -> Vec<(f64, f64)> {
    let each = alive.len().div_ceil(RANGES).max(1);
    let mut from = 0.0;
    let mut points = Vec::new();
    for range in alive.chunks(each) {
        points.push((from, f64::from(range.iter().copied().max().unwrap_or(0))));
        from += f64::from(u32::try_from(range.len()).unwrap_or(u32::MAX));
    }
    points
}

/// The thesis' number and share, and the share that its numbers give.
fn recorded_share() -> String {
    let [most, bodies] = [MOST_ALIVE.into(), BODIES].map(grouped);
    let share = 100.0 * f64::from(MOST_ALIVE) / BODIES as f64;
    format!("{most} of {bodies} ({MOST_ALIVE_PERCENT} %; {most} / {bodies} is {share:.2} %)")
}

/// Adds the figure of a step, which the driver has checked; `step` names it.
pub(super) fn add(
    part: &mut Part,
    input: &OrderInput<'_>,
    window: IssueWindow,
    step: &str,
) -> Result<(), OrderError> {
    let thesis =
        |ties| -> Schedule { body_by_body::order(input, ties).into_iter().map(Some).collect() };
    let mut orderer = Orderer::new();
    let mut ours = |order| orderer.order(input, order, window).cloned();
    let (mut series, mut most) = (Vec::new(), Vec::new());
    for (name, schedule) in [
        ("as given", ours(Order::AsGiven)?),
        ("Algorithm 3, ties by the lowest index", thesis(Ties::LowestIndex)),
        ("Algorithm 3, ties by the oldest", thesis(Ties::Oldest)),
        ("Algorithm 3, ties by the newest", thesis(Ties::Newest)),
        ("hazard-free (ours)", ours(Order::HazardFree)?),
    ] {
        let alive = live_curve(&schedule, input, window);
        let largest = grouped(alive.iter().copied().max().unwrap_or(0).into());
        most.push(format!("{largest} ({})", name.replace("Algorithm 3, ", "")));
        series.push(Series::new(name, Drawn::Line, thinned(&alive)));
    }
    let ends = series.iter().flat_map(|series| series.points.last()).map(|at| at.0);
    let (end, recorded) = (ends.fold(1.0, f64::max), f64::from(MOST_ALIVE));
    let name = format!("{}, the thesis' largest", grouped(MOST_ALIVE.into()));
    series.push(Series::new(name, Drawn::Dashes, vec![(0.0, recorded), (end, recorded)]));
    let figure = Figure::new(
        ("figure-4-13", "§4.7, Figure 4.13"),
        "Bodies to keep on chip along the sorted collisions",
        lines(Axis::linear("issue slot"), Axis::log("bodies alive"), &series),
        format!(
            "A body is alive from its first collision to its last. The step is {step}; the thesis' \
             own is not published, and its Algorithm 3 does not say how ties are broken.",
        ),
    );
    let moving = input.moving.iter().filter(|moving| **moving).count();
    let subject = format!("most bodies alive of {}", grouped(moving as u64));
    let mut row = figure.row(subject, recorded_share(), most[1..].join("; "));
    row.thesis += ", Algorithm 3";
    part.figure(figure, [row]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recorded_share_is_printed_beside_the_one_that_its_numbers_give() {
        assert_eq!(recorded_share(), "1,528 of 38,880 (3.85 %; 1,528 / 38,880 is 3.93 %)");
    }

    #[test]
    fn a_thinned_curve_keeps_the_largest_of_each_range() {
        let alive: Vec<u32> = (0..1000).map(|k| if k == 501 { 77 } else { 1 }).collect();
        let points = thinned(&alive);
        assert_eq!(points.len(), 334);
        assert_eq!(points.iter().filter(|point| point.1 > 1.0).count(), 1);
    }
}
