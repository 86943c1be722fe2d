//! This file tests steps that are packed while another is on the board, on a board that goes dead at
//! the first thing that the driver does wrong.

use std::cell::Cell;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use bitstream_model::interface::profile::Profile;
use bitstream_model::{BoardConfig, Direction, Fault as Injected, FaultKind, FaultPlan};

use super::life_tests::{Panicking, assert_works, windowed};
use super::tests::{bits, open, scene, undisturbed};
use crate::order::Order;
use crate::{
    Accelerator, Aftermath, Body, Cancellation, Collision, Error, Fault, InFlight, InputError,
    Prepared, Shape, StepParameters,
};

const CUBES: u32 = 20;
/// Of the other world.
const OTHER: u32 = 33;

fn parameters() -> StepParameters {
    StepParameters::default()
}

/// Starts a step of so many cubes.
fn submit(accelerator: &mut Accelerator, cubes: u32) -> InFlight<'_> {
    let (bodies, collisions) = scene(cubes);
    accelerator.submit(&bodies, &collisions, &parameters()).expect("a step that starts")
}

fn prepare(flight: &mut InFlight<'_>, cubes: u32) -> Prepared {
    let (bodies, collisions) = scene(cubes);
    flight.prepare(&bodies, &collisions, &parameters()).expect("a step that can be packed")
}

/// The results of a step of so many cubes are those of an undisturbed one.
fn assert_ends(flight: InFlight<'_>, cubes: u32, what: &str) {
    let (mut bodies, _) = scene(cubes);
    flight.wait(&mut bodies).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(bits(&bodies), undisturbed(cubes), "{what}");
}

/// A prepared step starts and gives the results of an undisturbed one.
fn assert_starts(accelerator: &mut Accelerator, prepared: &Prepared, cubes: u32, what: &str) {
    let flight = accelerator
        .start(prepared)
        .unwrap_or_else(|error| panic!("{what}: does not start: {error}"));
    assert_ends(flight, cubes, what);
}

fn refusal(started: Result<InFlight<'_>, Error>) -> InputError {
    match started.map(drop) {
        Err(Error::Input(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// Two worlds in turn, each with its own bodies, for so many steps; the bits of both at the end.
fn in_turn(
    accelerator: &mut Accelerator,
    sizes: [u32; 2],
    steps: usize,
    order: Option<Order>,
) -> [Vec<u32>; 2] {
    let parameters = StepParameters { order, ..parameters() };
    let mut worlds = sizes.map(scene);
    let [(bodies, collisions), _] = &worlds;
    let mut flight = accelerator.submit(bodies, collisions, &parameters).expect("a start");
    for step in 1..2 * steps {
        let [(left, left_collisions), (right, right_collisions)] = &mut worlds;
        let (now, next, collisions) = match step % 2 {
            1 => (left, right, right_collisions),
            _ => (right, left, left_collisions),
        };
        let prepared = flight.prepare(next, collisions, &parameters).expect("packed");
        let (report, started) = flight.wait_and_start(now, &prepared);
        report.expect("a good step");
        flight = started.expect("the next one starts");
    }
    flight.wait(&mut worlds[1].0).expect("the last one");
    worlds.map(|(bodies, _)| bits(&bodies))
}

#[test]
fn worlds_in_turn_give_the_bits_that_each_gives_alone() {
    for config in [
        BoardConfig::default(),
        windowed(),
        BoardConfig { profile: Profile::by_name("half").expect("it"), ..BoardConfig::default() },
    ] {
        for order in [None, Some(Order::HazardFree)] {
            let alone = [CUBES, OTHER].map(|cubes| {
                let (_, mut accelerator) = open(config);
                let (mut bodies, collisions) = scene(cubes);
                let parameters = StepParameters { order, ..parameters() };
                for _ in 0..4 {
                    accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
                }
                bits(&bodies)
            });
            let (board, mut accelerator) = open(config);
            let together = in_turn(&mut accelerator, [CUBES, OTHER], 4, order);
            assert!(together == alone, "{} {order:?}", config.profile.name);
            drop(accelerator);
            assert_eq!(board.violations(), []);
        }
    }
}

#[test]
fn the_next_step_is_on_the_board_while_results_are_read() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, _) = scene(CUBES);
    let mut flight = submit(&mut accelerator, CUBES);
    let next = prepare(&mut flight, OTHER);
    let (report, started) = flight.wait_and_start(&mut bodies, &next);
    assert_eq!(bits(&bodies), undisturbed(CUBES));
    assert!(board.is_running());
    let report = report.expect("a good step");
    assert_eq!((report.bodies, report.cycles.total), (u64::from(CUBES) + 1, 3_491));
    assert_ends(started.expect("it started"), OTHER, "the next");
    assert_eq!(board.violations(), []);
}

/// A step costs the same register accesses, whether it was prepared or not: one more if the number
/// of collisions is another than before.
#[test]
fn a_prepared_step_costs_39_accesses_and_preparing_none() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(CUBES);
    for _ in 0..2 {
        assert_ends(submit(&mut accelerator, CUBES), CUBES, "before");
    }
    let mut flight = submit(&mut accelerator, CUBES);
    let before = board.counts();
    let fewer = &collisions[1..];
    let prepared = flight.prepare(&bodies, fewer, &parameters()).expect("packed");
    assert_eq!(board.counts(), before, "nothing of the board is touched");
    let (report, started) = flight.wait_and_start(&mut bodies, &prepared);
    let last = started.expect("started").wait(&mut bodies).expect("a good step");
    for (report, accesses) in [(report.expect("a good step"), 38), (last, 39)] {
        assert_eq!(report.register_reads + report.register_writes, accesses);
        assert_eq!((report.doorbells, report.interrupts, report.descriptors), (9, 1, 44));
    }
    assert_eq!(board.violations(), []);
}

#[test]
fn preparing_at_any_moment_disturbs_nothing() {
    for clocks in [0, 50, 500, 2_000, 3_480, 200_000] {
        let (board, mut accelerator) = open(BoardConfig::default());
        let mut flight = submit(&mut accelerator, CUBES);
        board.cpu_port().pause(Duration::from_nanos(clocks * 1_000_000 / 275_000));
        let prepared = prepare(&mut flight, OTHER);
        assert_ends(flight, CUBES, "the first");
        assert_starts(&mut accelerator, &prepared, OTHER, "the second");
        assert_works(&board, &mut accelerator, "afterwards");
    }
}

#[test]
fn packing_longer_than_the_deadline_costs_no_step_that_is_done() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    board.cpu_port().pause(Duration::from_secs(10));
    assert_ends(flight, CUBES, "long done");
    assert_starts(&mut accelerator, &prepared, OTHER, "the next");
}

#[test]
fn a_prepared_step_outlives_the_other_however_that_ends() {
    type End = fn(InFlight<'_>);
    let ends: [(&str, End); 5] = [
        ("waited for", |flight| {
            flight.wait(&mut scene(CUBES).0).expect("a good step");
        }),
        ("dropped", |flight| drop(flight)),
        ("forgotten", |flight| {
            let _forgotten = ManuallyDrop::new(flight);
        }),
        ("given other bodies", |flight| {
            drop(flight.wait(&mut scene(3).0).expect_err("other bodies"));
        }),
        ("lost in a panic", |flight| {
            let panicked = catch_unwind(AssertUnwindSafe(|| {
                let _flight = flight;
                panic!("the caller's own code");
            }));
            panicked.expect_err("it panics");
        }),
    ];
    for (name, end) in ends {
        for clocks in [0_u64, 500, 3_000, 200_000] {
            let (board, mut accelerator) = open(BoardConfig::default());
            let mut flight = submit(&mut accelerator, CUBES);
            let prepared = prepare(&mut flight, OTHER);
            board.cpu_port().pause(Duration::from_nanos(clocks * 1_000_000 / 275_000));
            end(flight);
            assert_starts(&mut accelerator, &prepared, OTHER, name);
            // And again: its records are still there.
            assert_starts(&mut accelerator, &prepared, OTHER, name);
            assert_works(&board, &mut accelerator, name);
        }
    }
}

#[test]
fn a_prepared_step_that_is_never_started_costs_nothing() {
    let (board, mut accelerator) = open(BoardConfig::default());
    for cubes in [OTHER, 2, 90] {
        let mut flight = submit(&mut accelerator, CUBES);
        drop(prepare(&mut flight, cubes));
        assert_ends(flight, CUBES, "the other");
        assert_works(&board, &mut accelerator, "not started");
    }
    // With a step and a prepared one in the device's hands.
    let mut flight = submit(&mut accelerator, CUBES);
    let _prepared = prepare(&mut flight, OTHER);
    let _forgotten = ManuallyDrop::new(flight);
    drop(accelerator);
    assert_eq!(board.violations(), []);
    assert!(!board.is_running());
}

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

        // The prepared one fails, and is started again from the records that are there.
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

/// Wrong words are found when the next step is on the board, which is stopped and started again.
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
    // Its position overflows when it is integrated.
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
fn records_that_are_gone_are_refused_by_name() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (_, mut another) = open(BoardConfig::default());
    // Another was prepared in its place.
    let mut flight = submit(&mut accelerator, CUBES);
    let replaced = prepare(&mut flight, 5);
    let prepared = prepare(&mut flight, OTHER);
    assert_ends(flight, CUBES, "the first");
    assert_eq!(refusal(accelerator.start(&replaced)), InputError::NotPrepared);
    // It is not this accelerator's.
    assert_eq!(refusal(another.start(&prepared)), InputError::NotPrepared);
    // It stays while steps that are not prepared come and go, before it is started.
    assert_works(&board, &mut accelerator, "in between");
    assert_starts(&mut accelerator, &prepared, OTHER, "in between");
    // Now they take its place.
    assert_works(&board, &mut accelerator, "in its place");
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::NotPrepared);
    assert_works(&board, &mut accelerator, "refused");
}

#[test]
fn other_shapes_put_an_end_to_what_was_prepared() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    assert_ends(flight, CUBES, "the first");
    let one = [Shape::isotropic(1.0, 0.4)];
    // Refused ones change nothing.
    accelerator.set_shapes(&[]).expect_err("no shapes");
    assert_starts(&mut accelerator, &prepared, OTHER, "the same shapes");
    accelerator.set_shapes(&one).expect("it fits");
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::ShapesChanged);
    accelerator.set_shapes(&[Shape::STATIC, one[0]]).expect("they fit");
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::ShapesChanged);
    assert_works(&board, &mut accelerator, "other shapes");
}

#[test]
fn input_that_is_refused_leaves_both_steps() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    let (bodies, mut collisions) = scene(3);
    collisions[1].body_b = 4;
    let error = flight.prepare(&bodies, &collisions, &parameters()).expect_err("no body 4");
    assert!(error.is_input());
    assert_ends(flight, CUBES, "the first");
    assert_starts(&mut accelerator, &prepared, OTHER, "what was prepared before");
    assert_eq!(board.violations(), []);
}

#[test]
fn steps_of_any_size_are_prepared_beside_any_other() {
    // Short descriptors, so that rings grow too.
    let (board, mut accelerator) = open(BoardConfig { length_width: 8, ..BoardConfig::default() });
    let sizes = [1, 40, 3, 2, 90, 1, 91, 7, 7, 120];
    let mut flight = submit(&mut accelerator, sizes[0]);
    for pair in sizes.windows(2) {
        let [now, next] = pair else { panic!("two") };
        let prepared = prepare(&mut flight, *next);
        let (mut bodies, _) = scene(*now);
        let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
        ended.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
        assert_eq!(bits(&bodies), undisturbed(*now), "{now} cubes before {next}");
        flight = started.expect("rings grow between the two");
    }
    assert_ends(flight, 120, "the last");
    assert_eq!(board.violations(), []);
}

#[test]
fn a_step_with_nothing_to_stream_is_prepared_and_started() {
    // Where only live bodies are kept, a static body alone is nothing.
    let (board, mut accelerator) = open(windowed());
    let still = vec![scene(1).0[0]];
    let none: Vec<Collision> = Vec::new();
    let mut flight = accelerator.submit(&still, &none, &parameters()).expect("starts");
    let (mut bodies, collisions) = scene(CUBES);
    let next = flight.prepare(&bodies, &collisions, &parameters()).expect("packed");
    let (ended, started) = flight.wait_and_start(&mut still.clone(), &next);
    assert_eq!(ended.expect("nothing to do").doorbells, 0);
    let mut flight = started.expect("starts");
    let nothing = flight.prepare(&still, &none, &parameters()).expect("packed");
    let (ended, started) = flight.wait_and_start(&mut bodies, &nothing);
    ended.expect("a good step");
    started.expect("nothing to start").wait(&mut still.clone()).expect("nothing to do");
    drop(accelerator);
    assert_eq!(board.violations(), []);

    // Nothing in flight, something prepared, and nobody goes on.
    let (board, mut accelerator) = open(windowed());
    let mut flight = accelerator.submit(&still, &none, &parameters()).expect("starts");
    let _prepared = flight.prepare(&bodies, &collisions, &parameters()).expect("packed");
    drop(flight);
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn the_same_prepared_step_is_started_behind_itself() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    assert_ends(flight, CUBES, "the first");
    let flight = accelerator.start(&prepared).expect("starts");
    let (mut bodies, _) = scene(OTHER);
    let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
    ended.expect("a good step");
    assert_eq!(bits(&bodies), undisturbed(OTHER));
    assert_ends(started.expect("once more"), OTHER, "once more");
    assert_eq!(board.violations(), []);
}

#[test]
fn a_panic_in_any_call_while_preparing_leaves_the_step_in_flight() {
    for (config, order) in [
        (BoardConfig::default(), None),
        (BoardConfig::default(), Some(Order::HazardFree)),
        (windowed(), None),
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
            let left = Cell::new(calls);
            let (others, touching) = scene(3);
            let others = Panicking { inner: others, left: &left, commits: 0 };
            let touching = Panicking { inner: touching, left: &left, commits: 0 };
            let prepared = catch_unwind(AssertUnwindSafe(|| {
                flight.prepare(&others, &touching, &parameters).map(drop)
            }));
            flight.wait(&mut bodies).unwrap_or_else(|error| panic!("call {calls}: {error}"));
            assert_eq!(bits(&bodies), bits(&expected), "call {calls}");
            // Either whole or not at all.
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
        assert!(calls > 20, "{calls} calls");
        drop(accelerator);
        assert_eq!(board.violations(), []);
    }
}

/// Bodies that panic when results are stored, with the next step on the board.
#[test]
fn a_panic_while_results_are_stored_stops_the_next_step() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (inner, _): (Vec<Body>, _) = scene(CUBES);
    let mut reads = 0;
    loop {
        let mut flight = submit(&mut accelerator, CUBES);
        let prepared = prepare(&mut flight, OTHER);
        let left = Cell::new(reads);
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
    assert!(reads > 2 * CUBES, "{reads} calls");
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
