//! Measures every order of the collisions at every depth.

use scene::SplitMix64;
use zynq_pgs::order::{Checker, IssueWindow, Order, OrderError, OrderInput, Orderer, Schedule};

use super::cost;
use super::report::OrderReport;
use super::source::Source;
use crate::permutation::body_by_body::{self, Ties};
use crate::permutation::{Making, colours, shuffled};

/// Seed of the random order; any number does.
const SEED: u64 = 20_260_101;

/// An order at a depth.
pub(super) struct Row {
    pub(super) order: String,
    pub(super) depth: u32,
    pub(super) report: OrderReport,
    /// Host time of making the order, ns a collision; none if the order is given.
    pub(super) host_ns: Option<f64>,
}

/// All measurements.
pub(super) struct Measured {
    pub(super) rows: Vec<Row>,
    /// Host time of verifying the hazard-free schedule of the last depth, ns a collision.
    pub(super) verify_ns: f64,
}

/// The origin of an order.
enum Kind {
    Made(Order),
    /// Made here, the same at every depth.
    Permuted(Making),
    /// A given order, the same at every depth.
    Fixed(Schedule),
}

/// Measures all orders, for every window.
pub(super) fn measure(
    source: &Source,
    windows: &[IssueWindow],
    runs: u32,
) -> Result<Measured, OrderError> {
    let input = source.input();
    let mut rows = Vec::new();
    let mut verify_ns = 0.0;
    let mut orderer = Orderer::new();
    // The driver's check of the input, which the orders made here need.
    for window in windows.iter().take(1) {
        orderer.order(&input, Order::AsGiven, *window)?;
    }
    for (name, kind) in kinds(source) {
        let mut schedule = Schedule::default();
        let mut host_ns = None;
        for (place, window) in windows.iter().copied().enumerate() {
            match &kind {
                Kind::Fixed(fixed) => schedule.clone_from(fixed),
                Kind::Permuted(making) => {
                    if place == 0 {
                        let cost = || {
                            schedule = in_order(making(&input));
                            Ok(())
                        };
                        host_ns = Some(cost::per_collision(&input, runs, cost)?);
                    }
                }
                Kind::Made(order) => {
                    // Only orders without hazards depend on the depth.
                    if place == 0 || order.is_hazard_free() {
                        let cost = || orderer.order(&input, *order, window).map(|_| ());
                        host_ns = Some(cost::per_collision(&input, runs, cost)?);
                        schedule.clone_from(orderer.schedule());
                    }
                    if *order == Order::HazardFree {
                        verify_ns = verified(&schedule, &input, window, runs)?;
                    }
                }
            }
            let report = OrderReport::measure(&schedule, &input, window);
            rows.push(Row { order: name.clone(), depth: window.depth(), report, host_ns });
        }
    }
    Ok(Measured { rows, verify_ns })
}

/// Measures the verification of a schedule, which must pass.
fn verified(
    schedule: &Schedule,
    input: &OrderInput<'_>,
    window: IssueWindow,
    runs: u32,
) -> Result<f64, OrderError> {
    let mut checker = Checker::new();
    cost::per_collision(input, runs, || checker.verify(schedule, input, window))
}

/// The schedule of a permutation.
fn in_order(order: Vec<u32>) -> Schedule {
    order.into_iter().map(Some).collect()
}

fn kinds(source: &Source) -> Vec<(String, Kind)> {
    let input = source.input();
    let colours = colours::order(&input).1;
    let mut kinds = vec![("as given".to_owned(), Kind::Made(Order::AsGiven))];
    if let Some(order) = &source.gpu_order {
        kinds.push(("Bullet's GPU batches".to_owned(), Kind::Fixed(in_order(order.clone()))));
    }
    let random = shuffled(&mut SplitMix64::new(SEED), input.pairs.len());
    let thesis: [(&str, Making); 3] = [
        ("thesis, lowest index", |input| body_by_body::order(input, Ties::LowestIndex)),
        ("thesis, oldest", |input| body_by_body::order(input, Ties::Oldest)),
        ("thesis, newest", |input| body_by_body::order(input, Ties::Newest)),
    ];
    kinds.push(("random".to_owned(), Kind::Fixed(in_order(random))));
    kinds.extend(thesis.map(|(name, making)| (name.to_owned(), Kind::Permuted(making))));
    kinds.extend([
        (format!("{colours} colours"), Kind::Permuted(|input| colours::order(input).0)),
        ("interleaved".to_owned(), Kind::Made(Order::Interleaved)),
        ("hazard-free".to_owned(), Kind::Made(Order::HazardFree)),
    ]);
    kinds
}
