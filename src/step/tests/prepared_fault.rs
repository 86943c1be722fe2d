//! Tests prepared steps where the board, the results or the caller's code fails.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicU32;

use bitstream_model::{BoardConfig, Direction, Fault as Injected, FaultKind, FaultPlan};

use super::life::{Panicking, assert_works, naive};
use super::prepared::{CUBES, OTHER, assert_ends, assert_starts, parameters, prepare, submit};
use super::{bits, open, scene};
use crate::error::Aftermath;
use crate::order::Order;
use crate::{Body, Cancellation, Error, Fault, InputError, StepParameters};

#[test]
fn a_step_that_fails_on_the_board_leaves_the_prepared_one() {
    let faults = [
        Injected::new(FaultKind::Stall).on(1, Direction::Mm2s),
        Injected::new(FaultKind::DmaDecErr).on(2, Direction::S2mm),
        Injected::new(FaultKind::Stall).on(3, Direction::S2mm),
    ];
    for fault in faults {
        let (board, mut accelerator) = open(BoardConfig::default());
        board.inject(fault);
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        let (mut bodies, _) = scene(CUBES);
        let error = flight.wait(&mut bodies).expect_err("a fault");
        assert!(error.may_retry() && bits(&bodies) == bits(&scene(CUBES).0), "{error}");
        assert_starts(&mut accelerator, &prepared, OTHER, "after a fault");

        // The same in one call.
        board.inject(fault);
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
        assert!(ended.expect_err("a fault").may_retry());
        assert_eq!(bits(&bodies), bits(&scene(CUBES).0));
        assert_ends(started.expect("the board was reset"), OTHER, "after a fault");

        // The prepared step fails, and starts again from the records that are still in memory.
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        assert_ends(flight, CUBES, "the first");
        board.inject(fault);
        let (mut other, _) = scene(OTHER);
        let error = accelerator.start(&prepared).expect("starts").wait(&mut other);
        assert!(error.expect_err("a fault").may_retry());
        assert_starts(&mut accelerator, &prepared, OTHER, "again");
        assert_works(&board, &mut accelerator, "afterwards");
    }
}

/// The driver finds wrong words when the next step is on the board; it stops that step and starts
/// it again.
#[test]
fn results_that_arrived_wrong_are_told_and_the_next_step_is_started_again() {
    for plan in ["corrupt=1@dma0.s2mm", "corrupt=1@dma0.mm2s,phase=contact2"] {
        let (board, mut accelerator) = open(BoardConfig::default());
        board.inject(plan.parse::<FaultPlan>().expect("a plan"));
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        let (mut bodies, _) = scene(CUBES);
        let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
        let error = ended.expect_err("the sums differ");
        assert!(matches!(error.fault(), Some(Fault::Checksum { .. })), "{plan}: {error}");
        assert!(error.may_retry() && bits(&bodies) == bits(&scene(CUBES).0));
        assert_ends(started.expect("started again"), OTHER, plan);
        assert_works(&board, &mut accelerator, plan);
    }
}

#[test]
fn results_that_are_not_finite_do_not_disturb_the_next_step() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(CUBES);
    // The position overflows in the integration.
    bodies[7].pose.position[0] = f32::MAX;
    bodies[7].velocity.linear[0] = f32::MAX;
    let before = bits(&bodies);
    let long = StepParameters { time_step: 1.0, ..parameters() };
    let mut flight = accelerator.submit(&bodies, &collisions, &long).expect("starts");
    let prepared = prepare(&mut flight, OTHER);
    let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
    let error = ended.expect_err("not finite");
    assert!(
        matches!(&error, Error::Step { fault, aftermath: Aftermath::Untouched, .. }
            if matches!(**fault, Fault::NotFinite { body: 7 })),
        "{error}"
    );
    assert_eq!(bits(&bodies), before);
    assert_ends(started.expect("undisturbed"), OTHER, "the next");
    assert_works(&board, &mut accelerator, "not finite");
}

#[test]
fn a_panic_in_any_call_while_preparing_leaves_the_step_in_flight() {
    for (config, order) in [
        (BoardConfig::default(), None),
        (BoardConfig::default(), Some(Order::HazardFree)),
        (naive(), None),
    ] {
        let (board, mut accelerator) = open(config);
        let parameters = StepParameters { order, ..parameters() };
        let (mut expected, collisions) = scene(CUBES);
        accelerator.step(&mut expected, &collisions, &parameters).expect("a good step");
        let mut calls = 0;
        loop {
            let (mut bodies, collisions) = scene(CUBES);
            let mut flight = accelerator.submit(&bodies, &collisions, &parameters).expect("starts");
            let kept = flight.prepare(&bodies, &collisions, &parameters).expect("packed");
            let left = AtomicU32::new(calls);
            let (others, touching) = scene(3);
            let others = Panicking { inner: others, left: &left, commits: 0 };
            let touching = Panicking { inner: touching, left: &left, commits: 0 };
            let prepared = catch_unwind(AssertUnwindSafe(|| {
                flight.prepare(&others, &touching, &parameters).map(drop)
            }));
            flight.wait(&mut bodies).unwrap_or_else(|error| panic!("call {calls}: {error}"));
            assert_eq!(bits(&bodies), bits(&expected), "call {calls}");
            // The step commits all results or none.
            match accelerator.start(&kept) {
                Ok(flight) => {
                    let (mut bodies, _) = scene(CUBES);
                    flight.wait(&mut bodies).expect("a good step");
                    assert_eq!(bits(&bodies), bits(&expected), "call {calls}");
                }
                Err(error) => {
                    let refused = matches!(error, Error::Input(InputError::NotPrepared));
                    assert!(refused, "call {calls}: {error}");
                }
            }
            if prepared.is_ok() {
                break;
            }
            calls += 1;
        }
        assert!(calls > 10, "{calls} calls");
        drop(accelerator);
        assert_eq!(board.violations(), []);
    }
}

/// Bodies panic while results are stored, with the next step on the board.
#[test]
fn a_panic_while_results_are_stored_stops_the_next_step() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (inner, _): (Vec<Body>, _) = scene(CUBES);
    let mut reads = 0;
    loop {
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        let left = AtomicU32::new(reads);
        let mut bodies = Panicking { inner: inner.clone(), left: &left, commits: 0 };
        let stored = catch_unwind(AssertUnwindSafe(|| {
            let (ended, _started) = flight.wait_and_start(&mut bodies, &prepared);
            ended.expect("nothing else is wrong");
        }));
        let what = format!("a panic at call {reads}");
        assert_starts(&mut accelerator, &prepared, OTHER, &what);
        if stored.is_ok() {
            break;
        }
        reads += 1;
    }
    // Every body is stored; only static ones are read.
    assert!(reads > CUBES, "{reads} calls");
    assert_works(&board, &mut accelerator, "panics");
}

#[test]
fn what_was_cancelled_is_not_started_and_stays_prepared() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let cancellation = Cancellation::new();
    accelerator.set_cancellation(cancellation.clone());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    cancellation.cancel();
    let (mut bodies, _) = scene(CUBES);
    let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
    for error in [ended.map(drop).expect_err("cancelled"), started.map(drop).expect_err("too")] {
        assert!(matches!(error.fault(), Some(Fault::Cancelled)), "{error}");
    }
    assert!(!board.is_running());
    assert_eq!(bits(&bodies), bits(&scene(CUBES).0));
    cancellation.clear();
    assert_starts(&mut accelerator, &prepared, OTHER, "when it may be");
    assert_works(&board, &mut accelerator, "cancelled");
}

#[test]
fn a_board_that_cannot_be_reset_starts_nothing_and_frees_nothing() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    board.inject(Injected::new(FaultKind::PowerLost));
    let (mut bodies, _) = scene(CUBES);
    let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
    assert!(ended.expect_err("nothing answers").must_reopen());
    assert!(started.map(drop).expect_err("nothing answers").must_reopen());
    assert!(accelerator.start(&prepared).map(drop).expect_err("given up").must_reopen());
    assert_eq!(bits(&bodies), bits(&scene(CUBES).0));
    drop(accelerator);
    assert_eq!(board.violations(), []);
}
