//! Tests steps that are packed while another is on the board. The board goes dead at the driver's
//! first mistake.

use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use bitstream_model::BoardConfig;
use pgs_interface::profile::Profile;

use super::life::{assert_works, naive};
use super::{bits, open, scene, undisturbed};
use crate::board::bank::Bank;
use crate::order::Order;
use crate::{Accelerator, Collision, Error, InFlight, InputError, Prepared, Shape, StepParameters};

pub(crate) const CUBES: u32 = 20;
/// Number of cubes in the other world.
pub(crate) const OTHER: u32 = 33;

pub(crate) fn parameters() -> StepParameters {
    StepParameters::default()
}

/// Starts a step of `cubes` cubes.
pub(crate) fn submit(accelerator: &mut Accelerator, cubes: u32) -> InFlight<'_> {
    let (bodies, collisions) = scene(cubes);
    accelerator.submit(&bodies, &collisions, &parameters()).expect("a step that starts")
}

pub(crate) fn prepare(flight: &mut InFlight<'_>, cubes: u32) -> Prepared {
    let (bodies, collisions) = scene(cubes);
    flight.prepare(&bodies, &collisions, &parameters()).expect("a step that can be packed")
}

/// Checks that a step of `cubes` cubes ends with the results of an undisturbed one.
pub(crate) fn assert_ends(flight: InFlight<'_>, cubes: u32, what: &str) {
    let (mut bodies, _) = scene(cubes);
    flight.wait(&mut bodies).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(bits(&bodies), undisturbed(cubes), "{what}");
}

/// Checks that a prepared step starts, and that its results equal an undisturbed step's.
pub(crate) fn assert_starts(
    accelerator: &mut Accelerator,
    prepared: &Prepared,
    cubes: u32,
    what: &str,
) {
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

/// Steps two worlds in turn, each with its own bodies, `steps` times. Returns the bits of both at
/// the end.
fn alternate(
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
        naive(),
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
            let together = alternate(&mut accelerator, [CUBES, OTHER], 4, order);
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
    assert_eq!((report.bodies, report.cycles.total), (u64::from(CUBES) + 1, 3_827));
    assert_ends(started.expect("it started"), OTHER, "the next");
    assert_eq!(board.violations(), []);
}

#[test]
fn the_second_bank_has_no_memory_before_a_step_is_prepared() {
    let (_, mut accelerator) = open(BoardConfig::default());
    assert_ends(submit(&mut accelerator, CUBES), CUBES, "the first");
    let banks = |accelerator: &Accelerator| Bank::BOTH.map(|bank| accelerator.device.holds(bank));
    assert_eq!(banks(&accelerator), [true, false]);
    let mut flight = submit(&mut accelerator, CUBES);
    drop(prepare(&mut flight, 1));
    drop(flight);
    assert_eq!(banks(&accelerator), [true, true]);
}

/// A prepared step costs the same register accesses as any other: one more if the number of
/// collisions differs from the step before.
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
    for clocks in [0, 50, 500, 2_000, 3_816, 200_000] {
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
            // It starts once more: its records are still there.
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
    // The device holds the buffers of a step and of a prepared one.
    let mut flight = submit(&mut accelerator, CUBES);
    let _prepared = prepare(&mut flight, OTHER);
    let _forgotten = ManuallyDrop::new(flight);
    drop(accelerator);
    assert_eq!(board.violations(), []);
    assert!(!board.is_running());
}

#[test]
fn records_that_are_gone_are_refused_by_name() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (_, mut another) = open(BoardConfig::default());
    // Another step was prepared in its place.
    let mut flight = submit(&mut accelerator, CUBES);
    let replaced = prepare(&mut flight, 5);
    let prepared = prepare(&mut flight, OTHER);
    assert_ends(flight, CUBES, "the first");
    assert_eq!(refusal(accelerator.start(&replaced)), InputError::NotPrepared);
    // It belongs to another accelerator.
    assert_eq!(refusal(another.start(&prepared)), InputError::NotPrepared);
    // It stays while steps that are not prepared come and go, before it is started.
    assert_works(&board, &mut accelerator, "in between");
    assert_starts(&mut accelerator, &prepared, OTHER, "in between");
    // After its start they take its place.
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
    // Refused shapes change nothing.
    accelerator.set_shapes(&[]).expect_err("no shapes");
    assert_starts(&mut accelerator, &prepared, OTHER, "the same shapes");
    accelerator.set_shapes(&one).expect("it fits");
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::ShapesChanged);
    accelerator.set_shapes(&[Shape::STATIC, one[0]]).expect("they fit");
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::ShapesChanged);
    assert_works(&board, &mut accelerator, "other shapes");
}

#[test]
fn input_that_is_refused_leaves_the_step_in_flight() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut flight = submit(&mut accelerator, CUBES);
    let prepared = prepare(&mut flight, OTHER);
    let (bodies, mut collisions) = scene(3);
    collisions[1].body_b = 4;
    let error = flight.prepare(&bodies, &collisions, &parameters()).expect_err("no body 4");
    assert!(error.is_input());
    assert_ends(flight, CUBES, "the first");
    // Packing found the error after it had begun to fill the buffers.
    assert_eq!(refusal(accelerator.start(&prepared)), InputError::NotPrepared);
    assert_eq!(board.violations(), []);
}

#[test]
fn steps_of_any_size_are_prepared_beside_any_other() {
    // Short descriptors, so that the rings grow too.
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
    let (board, mut accelerator) = open(BoardConfig::default());
    let mut still: Vec<crate::Body> = Vec::new();
    let none: Vec<Collision> = Vec::new();
    let mut flight = accelerator.submit(&still, &none, &parameters()).expect("starts");
    let (mut bodies, collisions) = scene(CUBES);
    let next = flight.prepare(&bodies, &collisions, &parameters()).expect("packed");
    let (ended, started) = flight.wait_and_start(&mut still, &next);
    assert_eq!(ended.expect("nothing to do").doorbells, 0);
    let mut flight = started.expect("starts");
    let nothing = flight.prepare(&still, &none, &parameters()).expect("packed");
    let (ended, started) = flight.wait_and_start(&mut bodies, &nothing);
    ended.expect("a good step");
    started.expect("nothing to start").wait(&mut still).expect("nothing to do");
    drop(accelerator);
    assert_eq!(board.violations(), []);

    // With no step in flight and one prepared, the caller stops.
    let (board, mut accelerator) = open(BoardConfig::default());
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
