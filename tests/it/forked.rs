//! Tests that an accelerator belongs to the process that opened it: a forked child is refused,
//! frees memory of its own alone, and disturbs neither its parent's board nor a step on it.
#![cfg(feature = "emulation")]

use bitstream_model::interface::address_map::MEMORY_BASE;
use bitstream_model::remote::Server;
use pgs_interface::message::MEMORY_UNIT;
use pgs_support::in_forked_child;
use zynq_pgs::{Accelerator, Body, Collision, Error, InFlight, Shape, StepParameters, Velocity};

use crate::common::{bits, open_with, row};
use crate::served::Served;
use bitstream_model::BoardConfig;

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];

/// A row of cubes on the ground, long enough that threads share the packing.
fn scene() -> (Vec<Body>, Vec<Collision>) {
    row(6_200, 2.2, |x| Velocity { linear: [0.1, -1.0 - x * 1e-3, 0.0], angular: [0.0; 3] })
}

fn step(accelerator: &mut Accelerator) -> Result<Vec<u32>, Error> {
    let (mut bodies, collisions) = scene();
    accelerator.step(&mut bodies, &collisions, &StepParameters::default())?;
    Ok(bits(&bodies))
}

/// Whether a call was refused because it came from a forked child, with the number of the parent.
fn is_refused<T>(called: &Result<T, Error>, parent: u32) -> bool {
    let Err(error) = called else { return false };
    let text = error.to_string();
    matches!(error, Error::OtherProcess { opener } if *opener == parent)
        && text.contains(&parent.to_string())
        && text.contains("after the fork")
}

/// Every call of an accelerator without a step in flight.
fn all_refused(accelerator: &mut Accelerator, parent: u32) -> bool {
    let (mut bodies, collisions) = scene();
    let parameters = StepParameters::default();
    let mut wrote = false;
    // One by one: each may give out a step that borrows the accelerator.
    let shapes = is_refused(&accelerator.set_shapes(&SHAPES), parent);
    let stepped = is_refused(&accelerator.step(&mut bodies, &collisions, &parameters), parent);
    let submitted = is_refused(&accelerator.submit(&bodies, &collisions, &parameters), parent);
    let written = accelerator.write(&bodies, 1, &parameters, |_| wrote = true);
    let written = is_refused(&written, parent) && !wrote;
    shapes && stepped && submitted && written && bits(&bodies) == bits(&scene().0)
}

/// Both boards of a process: an emulated one, whose threads a child does not have, and a served
/// one, whose socket and lock a child shares.
fn each_board(test: impl Fn(&mut dyn FnMut() -> Accelerator, &bitstream_model::EmulatedBoard)) {
    let config = BoardConfig { threads: 2, ..BoardConfig::default() };
    let (board, accelerator) = open_with(config, Some(2), &SHAPES);
    let mut once = Some(accelerator);
    test(&mut || once.take().expect("opened once"), &board);
    let mut served = Served::new(config);
    let board = served.board.clone();
    test(&mut || served.open(), &board);
    served.stop();
}

#[test]
fn a_forked_child_is_refused_and_drops_and_the_parent_steps_on() {
    each_board(|open, board| {
        let parent = std::process::id();
        let mut accelerator = Some(open());
        let first = step(accelerator.as_mut().expect("open")).expect("a good step");
        let in_child = || {
            let Some(mut accelerator) = accelerator.take() else { return 1 };
            let refused = all_refused(&mut accelerator, parent);
            drop(accelerator);
            if refused { 7 } else { 2 }
        };
        assert_eq!(in_forked_child(in_child), Some(7));
        let again = step(accelerator.as_mut().expect("still open")).expect("a good step");
        assert_eq!(first, again);
        drop(accelerator);
        assert!(board.violations().is_empty(), "{:?}", board.violations());
    });
}

/// A child that stops the step would reset the parent's board.
#[test]
fn a_step_in_flight_goes_on_whatever_a_forked_child_does_with_it() {
    let acts: [fn(InFlight<'_>, u32) -> bool; 4] = [
        |step, parent| is_refused(&step.wait(&mut scene().0), parent),
        |step, _| {
            drop(step);
            true
        },
        |mut step, parent| {
            let (bodies, collisions) = scene();
            let parameters = StepParameters::default();
            let prepared = step.prepare(&bodies, &collisions, &parameters);
            let written = step.write(&bodies, 1, &parameters, |_| {});
            is_refused(&prepared, parent) && is_refused(&written, parent)
        },
        |step, _| {
            drop(step.detach());
            true
        },
    ];
    each_board(|open, board| {
        let parent = std::process::id();
        let mut accelerator = open();
        let expected = step(&mut accelerator).expect("a good step");
        for act in acts {
            let (mut bodies, collisions) = scene();
            let parameters = StepParameters::default();
            let flight = accelerator.submit(&bodies, &collisions, &parameters).expect("a start");
            let mut flight = Some(flight);
            let in_child = || match flight.take() {
                Some(flight) => u8::from(act(flight, parent)),
                None => 2,
            };
            assert_eq!(in_forked_child(in_child), Some(1));
            flight.expect("still in flight").wait(&mut bodies).expect("a good step");
            assert_eq!(bits(&bodies), expected);
        }
        drop(accelerator);
        assert!(board.violations().is_empty(), "{:?}", board.violations());
    });
}

#[test]
fn prepared_and_detached_steps_are_refused_in_a_forked_child_alone() {
    each_board(|open, board| {
        let parent = std::process::id();
        let mut accelerator = open();
        let (mut bodies, collisions) = scene();
        let parameters = StepParameters::default();
        let mut flight = accelerator.submit(&bodies, &collisions, &parameters).expect("a start");
        let prepared = flight.prepare(&bodies, &collisions, &parameters).expect("prepared");
        let mut detached = Some(flight.detach());
        let in_child = || {
            let started = is_refused(&accelerator.start(&prepared), parent);
            let Some(detached) = detached.take() else { return 1 };
            let attached = is_refused(&accelerator.attach(detached), parent);
            if started && attached { 7 } else { 2 }
        };
        assert_eq!(in_forked_child(in_child), Some(7));
        let flight = accelerator.attach(detached.expect("still there")).expect("in flight");
        let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
        ended.expect("a good step");
        let first = bits(&bodies);
        let mut bodies = scene().0;
        started.expect("a start").wait(&mut bodies).expect("a good step");
        assert_eq!(bits(&bodies), first);
        drop(accelerator);
        assert!(board.violations().is_empty(), "{:?}", board.violations());
    });
}

/// The way that the refusal names.
#[test]
fn a_forked_child_opens_a_board_of_its_own() {
    let (_, mut accelerator) = open_with(BoardConfig::default(), None, &SHAPES);
    let expected = step(&mut accelerator).expect("a good step");
    let in_child = || {
        let (_, mut own) = open_with(BoardConfig::default(), None, &SHAPES);
        if step(&mut own).is_ok_and(|found| found == expected) { 7 } else { 1 }
    };
    assert_eq!(in_forked_child(in_child), Some(7));
}

/// A server without its socket would go on, and no driver could find it.
#[test]
fn a_server_keeps_its_socket_when_a_forked_child_drops_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let socket = folder.path().join("board");
    let memory = MEMORY_BASE..MEMORY_BASE + MEMORY_UNIT;
    let server = Server::bind(BoardConfig::default(), memory, &socket, None);
    let mut server = Some(server.expect("served"));
    let in_child = || {
        drop(server.take());
        7
    };
    assert_eq!(in_forked_child(in_child), Some(7));
    assert!(socket.exists());
    drop(server);
    assert!(!socket.exists());
}
