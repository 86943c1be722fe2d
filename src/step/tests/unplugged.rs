//! Takes the logic away under an open driver: on hardware the next access to a register would hang
//! the processor. The emulated board still answers, and counts the accesses.

use std::mem::ManuallyDrop;

use std::sync::Arc;
use std::time::Duration;

use bitstream_model::{Direction as Side, EmulatedBoard, Fault as Injected, FaultKind};

use super::fault::{CUBES, fault_of};
use super::tampered::Tampered;
use super::{SHAPES, scene, step};
use crate::{
    Accelerator, Aftermath, Cancellation, Error, Fault, InFlight, PlatformError, StepParameters,
};

fn accesses(board: &EmulatedBoard) -> u64 {
    board.counts().register_reads + board.counts().register_writes
}

/// A board on which a step has succeeded.
fn at_work() -> (EmulatedBoard, Arc<Tampered>, Accelerator) {
    let (board, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    (board, tampered, accelerator)
}

fn submit(accelerator: &mut Accelerator) -> InFlight<'_> {
    let (bodies, collisions) = scene(CUBES);
    let parameters = StepParameters::default();
    accelerator.submit(&bodies, &collisions, &parameters).expect("a step that starts")
}

/// Takes the logic away, and checks that `act` and everything after it touch no register and free
/// no memory, which the engines may still reach.
#[track_caller]
fn unplug(
    (board, tampered, mut accelerator): (EmulatedBoard, Arc<Tampered>, Accelerator),
    act: impl FnOnce(&mut Accelerator) -> Option<Error>,
) {
    tampered.wires().unplugged = true;
    tampered.wires().released.clear();
    let before = accesses(&board);
    if let Some(error) = act(&mut accelerator) {
        assert!(matches!(fault_of(&error), Fault::Platform(PlatformError::Lost { .. })), "{error}");
        assert!(error.must_reopen() && error.diagnosis().is_none(), "{error}");
    }
    assert!(matches!(step(&mut accelerator, 2 * CUBES).0, Err(error) if error.must_reopen()));
    assert!(matches!(accelerator.set_shapes(&SHAPES), Err(Error::MustReopen)));
    drop(accelerator);
    assert_eq!(accesses(&board), before);
    assert!(tampered.wires().released.is_empty());
    assert_eq!(board.violations(), []);
}

#[test]
fn a_step_asks_before_its_first_register() {
    unplug(at_work(), |accelerator| step(accelerator, CUBES).0.err());
}

/// Larger rings would stop the channels first.
#[test]
fn a_step_asks_before_it_stops_a_channel() {
    let (board, tampered, mut accelerator) = at_work();
    tampered.wires().unplugged = true;
    let before = accesses(&board);
    let error = step(&mut accelerator, 100 * CUBES).0.expect_err("it went away");
    assert!(matches!(fault_of(&error), Fault::Platform(PlatformError::Lost { .. })), "{error}");
    assert!(error.must_reopen());
    assert_eq!(accesses(&board), before);
}

#[test]
fn shapes_are_not_written() {
    unplug(at_work(), |accelerator| accelerator.set_shapes(&SHAPES).err());
}

#[test]
fn a_step_in_flight_is_given_up() {
    unplug_in_flight(|flight| flight.wait(&mut scene(CUBES).0).err());
    unplug_in_flight(|flight| {
        drop(flight);
        None
    });
    unplug_in_flight(|flight| {
        // Not dropped: the caller has forgotten it.
        let _forgotten = ManuallyDrop::new(flight);
        None
    });
}

/// As [`unplug`], with a step in flight.
#[track_caller]
fn unplug_in_flight(act: impl FnOnce(InFlight<'_>) -> Option<Error>) {
    let (board, tampered, mut accelerator) = at_work();
    let flight = submit(&mut accelerator).detach();
    unplug((board, tampered, accelerator), |accelerator| {
        act(accelerator.attach(flight).expect("in flight"))
    });
}

#[test]
fn a_step_that_was_cancelled_is_not_stopped() {
    let (board, tampered, mut accelerator) = at_work();
    let cancellation = Cancellation::new();
    accelerator.set_cancellation(cancellation.clone());
    let flight = submit(&mut accelerator).detach();
    unplug((board, tampered, accelerator), |accelerator| {
        cancellation.cancel();
        accelerator.attach(flight).expect("in flight").wait(&mut scene(CUBES).0).err()
    });
}

#[test]
fn a_board_that_is_closed_is_not_stopped() {
    let (board, tampered, mut accelerator) = at_work();
    let flight = submit(&mut accelerator).detach();
    tampered.wires().unplugged = true;
    tampered.wires().released.clear();
    let before = accesses(&board);
    drop((flight, accelerator));
    assert_eq!(accesses(&board), before);
    assert!(tampered.wires().released.is_empty());
}

/// A fault is seen, and the logic goes away before the diagnosis.
#[test]
fn a_fault_is_neither_diagnosed_nor_cleared() {
    let (board, tampered, mut accelerator) = at_work();
    board.inject(Injected::new(FaultKind::DmaSlvErr).on(0, Side::Mm2s));
    tampered.wires().unplug_after = 1;
    let flight = submit(&mut accelerator);
    let before = accesses(&board);
    let error = flight.wait(&mut scene(CUBES).0).expect_err("a fault, and nobody to ask");
    assert!(matches!(fault_of(&error), Fault::Platform(PlatformError::Lost { .. })), "{error}");
    assert!(matches!(error, Error::Step { aftermath: Aftermath::MustReopen, .. }));
    drop(accelerator);
    assert_eq!(accesses(&board) - before, 8, "the status of each channel, which showed the fault");
}

/// The line stays masked in a storm of interrupts.
#[test]
fn a_storm_of_interrupts_does_not_hide_it() {
    let (board, tampered, mut accelerator) = at_work();
    board.inject(Injected::new(FaultKind::Stall).on(0, Side::Mm2s));
    tampered.wires().storm = u32::MAX;
    tampered.wires().unplug_after = 30;
    let (mut bodies, collisions) = scene(CUBES);
    let deadline = Some(Duration::from_secs(10));
    let parameters = StepParameters { deadline, ..StepParameters::default() };
    let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("it went away");
    assert!(matches!(fault_of(&error), Fault::Platform(PlatformError::Lost { .. })), "{error}");
}
