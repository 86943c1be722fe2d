//! Tests steps in flight that borrow nothing. The board goes dead at the driver's first mistake.

use std::time::Duration;

use bitstream_model::{BoardConfig, Direction, EmulatedBoard, Fault as Injected, FaultKind};

use super::fault::fault_of;
use super::life::{assert_works, naive};
use super::prepared::{CUBES, OTHER, assert_ends, prepare, submit};
use super::tampered::{Tamper, Tampered};
use super::{SHAPES, bits, open, scene};
use crate::error::Aftermath;
use crate::{Accelerator, Cancellation, Detached, Error, InputError, StepParameters, StepReport};

/// What an engine or a handle of another language keeps: the accelerator and its step.
#[derive(Debug)]
struct Owner {
    board: Accelerator,
    step: Option<Detached>,
}

impl Owner {
    fn with_a_step(mut board: Accelerator) -> Self {
        let step = Some(submit(&mut board, CUBES).detach());
        Self { board, step }
    }

    /// Waits for the step; returns the bits of its bodies, too.
    fn wait(&mut self) -> (Result<StepReport, Error>, Vec<u32>) {
        let (mut bodies, _) = scene(CUBES);
        let step = self.step.take().expect("a step");
        let result = self.board.attach(step).and_then(|flight| flight.wait(&mut bodies));
        (result, bits(&bodies))
    }
}

fn refusal(accelerator: &mut Accelerator, step: Detached) -> InputError {
    match accelerator.attach(step).map(drop) {
        Err(Error::Input(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// Whether the board moves beats while nobody calls the driver.
fn moves(board: &EmulatedBoard) -> bool {
    let moved = || board.counts().beats_read + board.counts().beats_written;
    let before = moved();
    board.cpu_port().pause(Duration::from_millis(1));
    moved() != before
}

#[test]
fn a_detached_step_ends_as_a_step_that_borrows() {
    let (board, accelerator) = open(BoardConfig::default());
    let mut owner = Owner::with_a_step(accelerator);
    let expected = {
        let (_, mut accelerator) = open(BoardConfig::default());
        let (mut bodies, _) = scene(CUBES);
        let report = submit(&mut accelerator, CUBES).wait(&mut bodies).expect("a good step");
        (report.cycles, report.register_reads, report.register_writes, bits(&bodies))
    };
    // The owner moves, also to another thread.
    let (result, bits) = std::thread::spawn(move || owner.wait()).join().expect("no panic");
    let report = result.expect("a good step");
    assert_eq!((report.cycles, report.register_reads, report.register_writes, bits), expected);
    assert_eq!(board.violations(), []);
}

#[test]
fn a_detached_step_that_is_dropped_is_stopped_by_the_next_call_or_with_the_accelerator() {
    for clocks in [0, 500, 200_000] {
        let (board, accelerator) = open(BoardConfig::default());
        let mut owner = Owner::with_a_step(accelerator);
        board.cpu_port().pause(Duration::from_nanos(clocks * 4));
        owner.step = None;
        assert_works(&board, &mut owner.board, "dropped");

        owner.step = Some(submit(&mut owner.board, CUBES).detach());
        drop(owner);
        assert!(!board.is_running() && !moves(&board), "the drop of the accelerator stops it");
        assert_eq!(board.violations(), []);
    }
}

#[test]
fn a_step_that_is_attached_and_dropped_is_stopped_at_once() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let step = submit(&mut accelerator, CUBES).detach();
    drop(accelerator.attach(step).expect("in flight"));
    assert!(!board.is_running() && !moves(&board));
    assert_works(&board, &mut accelerator, "stopped");
}

#[test]
fn a_detached_step_is_cancelled_as_any_other() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let cancellation = Cancellation::new();
    accelerator.set_cancellation(cancellation.clone());
    board.inject(Injected::new(FaultKind::Stall).on(3, Direction::S2mm));
    let mut owner = Owner::with_a_step(accelerator);
    cancellation.cancel();
    let (result, found) = owner.wait();
    let error = result.expect_err("cancelled");
    assert_eq!(fault_of(&error).name(), "cancelled");
    assert!(matches!(error, Error::Step { aftermath: Aftermath::Ready, .. }), "{error}");
    assert_eq!(found, bits(&scene(CUBES).0), "nothing changed");
    cancellation.clear();
    assert_works(&board, &mut owner.board, "cancelled");
}

#[test]
fn an_error_leaves_the_accelerator_with_its_owner() {
    let (board, accelerator) = open(BoardConfig::default());
    board.inject(Injected::new(FaultKind::DmaDecErr).on(2, Direction::Mm2s));
    let mut owner = Owner::with_a_step(accelerator);
    let (result, found) = owner.wait();
    let error = result.expect_err("a fault");
    assert!(error.may_retry(), "{error}");
    assert_eq!(found, bits(&scene(CUBES).0), "nothing changed");
    assert_works(&board, &mut owner.board, "a fault");
}

#[test]
fn what_is_not_in_flight_any_more_is_refused() {
    for config in [BoardConfig::default(), naive()] {
        let (board, mut accelerator) = open(config);
        let (bodies, collisions) = scene(CUBES);
        let stopped = submit(&mut accelerator, CUBES).detach();
        let going = submit(&mut accelerator, CUBES).detach();
        assert_eq!(refusal(&mut accelerator, stopped), InputError::NotInFlight);
        let flight = accelerator.attach(going).expect("a refusal stops no other step");
        let (mut found, mut expected) = (bodies.clone(), bodies.clone());
        flight.wait(&mut found).expect("a good step");
        let (_, mut undisturbed) = open(config);
        undisturbed.step(&mut expected, &collisions, &StepParameters::default()).expect("a step");
        assert_eq!(bits(&found), bits(&expected));

        let step = submit(&mut accelerator, CUBES).detach();
        accelerator.set_shapes(&SHAPES).expect("shapes that fit");
        assert_eq!(refusal(&mut accelerator, step), InputError::NotInFlight);

        // Input that is refused stops it, too.
        let step = submit(&mut accelerator, CUBES).detach();
        let wrong = StepParameters::default().with_time_step(0.0);
        accelerator.submit(&bodies, &collisions, &wrong).expect_err("no time step");
        assert_eq!(refusal(&mut accelerator, step), InputError::NotInFlight);

        let step = submit(&mut accelerator, CUBES).detach();
        let (_, mut other) = open(config);
        assert_eq!(refusal(&mut other, step), InputError::NotInFlight);
        assert_eq!(board.violations(), []);
    }
}

/// Where there is no body nothing is streamed, and the step ends without the board.
#[test]
fn a_detached_step_without_bodies_ends_once() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut none, collisions) = (Vec::new(), Vec::new());
    let submitted = |accelerator: &mut Accelerator| {
        let flight = accelerator.submit(&none, &collisions, &StepParameters::default());
        flight.expect("starts").detach()
    };
    let step = submitted(&mut accelerator);
    let next = submitted(&mut accelerator);
    assert_eq!(refusal(&mut accelerator, step), InputError::NotInFlight);
    let report = accelerator.attach(next).and_then(|flight| flight.wait(&mut none));
    assert_eq!(report.expect("a step without work").doorbells, 0);
    let (none, collisions): (Vec<crate::Body>, Vec<crate::Collision>) = (Vec::new(), Vec::new());
    let flight = accelerator.submit(&none, &collisions, &StepParameters::default());
    let step = flight.expect("starts").detach();
    submit(&mut accelerator, CUBES).wait(&mut scene(CUBES).0).expect("another step");
    assert_eq!(board.violations(), []);
    assert_eq!(refusal(&mut accelerator, step), InputError::NotInFlight);
}

#[test]
fn a_step_is_prepared_beside_a_detached_one() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let step = submit(&mut accelerator, CUBES).detach();
    let mut flight = accelerator.attach(step).expect("in flight");
    let prepared = prepare(&mut flight, OTHER);
    let step = flight.detach();
    let (mut bodies, _) = scene(CUBES);
    let flight = accelerator.attach(step).expect("in flight");
    let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
    ended.expect("a good step");
    let step = started.expect("it starts").detach();
    assert_ends(accelerator.attach(step).expect("in flight"), OTHER, "the next");
    assert_eq!(board.violations(), []);
}

#[test]
fn a_board_that_was_given_up_must_be_opened_again() {
    let (_, tampered, mut accelerator) = Tampered::open();
    let step = submit(&mut accelerator, CUBES).detach();
    // A reset that never ends.
    tampered.tamper(1, 0, Tamper::Set(1 << 2));
    let error = accelerator.set_shapes(&SHAPES).expect_err("it cannot be stopped");
    assert!(error.must_reopen(), "{error}");
    let error = accelerator.attach(step).map(drop).expect_err("given up");
    assert!(matches!(error, Error::MustReopen), "{error}");
}
