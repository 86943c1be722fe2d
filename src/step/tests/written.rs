//! Tests steps whose collisions are written one after the other. The board goes dead at the
//! driver's first mistake.

use std::panic::{AssertUnwindSafe, catch_unwind};

use bitstream_model::BoardConfig;
use pgs_interface::profile::{PROFILES, Profile};

use super::{bits, open, scene};
use crate::order::Order;
use crate::validate::Excess;
use crate::{
    Accelerator, Body, Collision, Error, InputError, Prepared, StepParameters, Velocity, Writer,
};

/// More than three blocks of records.
const CUBES: u32 = 100;

fn parameters() -> StepParameters {
    StepParameters { order: Some(Order::AsGiven), ..StepParameters::default() }
}

fn push_all(collisions: &[Collision]) -> impl FnOnce(&mut Writer<'_>) {
    |records| collisions.iter().for_each(|it| records.push(it))
}

/// Packs a step, and writes all its collisions.
fn write(
    accelerator: &mut Accelerator,
    bodies: &[Body],
    collisions: &[Collision],
) -> Result<Prepared, Error> {
    accelerator.write(bodies, collisions.len(), &parameters(), push_all(collisions))
}

fn refusal(written: Result<Prepared, Error>) -> InputError {
    match written {
        Err(Error::Input(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// Checks that the next step is undisturbed.
fn assert_works(accelerator: &mut Accelerator, what: &str) {
    let (mut bodies, collisions) = scene(CUBES);
    accelerator.step(&mut bodies, &collisions, &parameters()).expect(what);
    let (_, mut fresh) = open(BoardConfig::default());
    let (mut expected, _) = scene(CUBES);
    fresh.step(&mut expected, &collisions, &parameters()).expect("a step");
    assert_eq!(bits(&bodies), bits(&expected), "{what}");
}

#[test]
fn written_collisions_are_those_given_at_once() {
    for profile in PROFILES {
        let (board, mut accelerator) = open(BoardConfig { profile, ..BoardConfig::default() });
        let (given, collisions) = scene(CUBES);
        assert!(collisions.len() > 90, "more than three blocks");
        // Fewer than announced, at the borders of blocks of records too.
        for count in [0, 1, 29, 30, 31, 60, 61, collisions.len()] {
            let what = format!("{} {count}", profile.name);
            let collisions = &collisions[..count];
            let mut expected = given.clone();
            let at_once = accelerator.step(&mut expected, collisions, &parameters()).expect(&what);
            let mut bodies = given.clone();
            let written = accelerator.write(&bodies, 2 * count + 3, &parameters(), |records| {
                for (index, collision) in collisions.iter().enumerate() {
                    assert_eq!(records.len(), index);
                    records.push(collision);
                }
                assert!(!records.is_refused());
                assert_eq!(records.is_empty(), count == 0);
            });
            let written = written.expect(&what);
            let report = accelerator.start(&written).expect(&what).wait(&mut bodies).expect(&what);
            assert_eq!(bits(&bodies), bits(&expected), "{what}");
            assert_eq!(
                (report.collisions, report.bytes_to_device, report.cycles, report.impulse_sum),
                (count as u64, at_once.bytes_to_device, at_once.cycles, at_once.impulse_sum),
                "{what}"
            );
            // The step starts once more.
            let mut again = given.clone();
            accelerator.start(&written).expect(&what).wait(&mut again).expect(&what);
            assert_eq!(bits(&again), bits(&expected), "{what}");
        }
        drop(accelerator);
        assert_eq!(board.violations(), []);
    }
}

#[test]
fn what_is_refused_is_what_is_refused_at_once() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (bodies, collisions) = scene(CUBES);
    let wrong: [fn(&mut Collision); 4] = [
        |it| it.normal = [0.0; 3],
        |it| it.count = 5,
        |it| it.body_a = 7_777,
        |it| it.contacts[0].point[1] = f32::NAN,
    ];
    for index in [0, 29, 30, 47, collisions.len() - 1] {
        for spoil in wrong {
            let mut collisions = collisions.clone();
            spoil(&mut collisions[index]);
            // The driver names the first of several errors, and writes none of the collisions
            // behind it.
            collisions.iter_mut().skip(index + 1).for_each(spoil);
            let expected = accelerator.step(&mut bodies.clone(), &collisions, &parameters());
            let expected = expected.expect_err("refused").to_string();
            let found = refusal(write(&mut accelerator, &bodies, &collisions)).to_string();
            assert!(expected.ends_with(&found), "{found:?} instead of {expected:?}");
        }
    }
    let mut spoilt = bodies.clone();
    spoilt[3].pose.orientation = [0.0; 4];
    let mut reached = false;
    let written = accelerator.write(&spoilt, 9, &parameters(), |_| reached = true);
    assert!(matches!(refusal(written), InputError::Orientation { body: 3, .. }));
    assert!(!reached, "the narrow phase does not run after refused bodies");
    assert_works(&mut accelerator, "after refusals");
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn nothing_is_written_beyond_what_was_announced() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (bodies, collisions) = scene(CUBES);
    for announced in [0, 1, 30, 45] {
        let written = accelerator.write(&bodies, announced, &parameters(), |records| {
            collisions.iter().take(announced).for_each(|it| records.push(it));
            assert!(!records.is_refused());
            collisions.iter().skip(announced).for_each(|it| records.push(it));
            assert!(records.is_refused());
            assert_eq!(records.len(), announced);
        });
        assert_eq!(refusal(written), InputError::MoreThanAnnounced { announced });
        // The driver names an earlier error first.
        let written = accelerator.write(&bodies, announced, &parameters(), |records| {
            let none = Collision { count: 0, ..collisions[0] };
            collisions.iter().for_each(|it| records.push(if announced == 45 { &none } else { it }));
        });
        match refusal(written) {
            InputError::ContactCount { collision: 0, .. } => assert_eq!(announced, 45),
            other => assert_eq!(other, InputError::MoreThanAnnounced { announced }),
        }
    }
    let written = accelerator.write(&bodies, 1 << 30, &parameters(), |_| {});
    assert!(matches!(refusal(written).excess(), Some(Excess::TooManyCollisions { .. })));
    assert_works(&mut accelerator, "after too many");
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn what_needs_all_collisions_at_once_is_refused() {
    let (bodies, collisions) = scene(CUBES);
    let verified = StepParameters { verify_order: true, ..parameters() };
    let ordered = StepParameters { order: Some(Order::HazardFree), ..parameters() };
    for parameters in [verified, ordered] {
        let (_, mut accelerator) = open(BoardConfig::default());
        let written = accelerator.write(&bodies, 999, &parameters, push_all(&collisions));
        assert_eq!(refusal(written), InputError::WrittenInOrder);
    }
}

#[test]
fn a_step_is_written_while_another_is_on_the_board() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut left, left_collisions) = scene(CUBES);
    let (mut right, right_collisions) = scene(33);
    let mut expected = [left.clone(), right.clone()];
    accelerator.step(&mut expected[0], &left_collisions, &parameters()).expect("a step");
    accelerator.step(&mut expected[1], &right_collisions, &parameters()).expect("a step");

    let mut flight = accelerator.submit(&left, &left_collisions, &parameters()).expect("starts");
    let refused = flight.write(&right, 0, &parameters(), push_all(&right_collisions));
    assert!(matches!(refusal(refused), InputError::MoreThanAnnounced { announced: 0 }));
    let next = flight.write(&right, 999, &parameters(), push_all(&right_collisions));
    let (report, started) = flight.wait_and_start(&mut left, &next.expect("written"));
    report.expect("a good step");
    started.expect("starts").wait(&mut right).expect("a good step");
    assert_eq!([left, right].map(|it| bits(&it)), expected.map(|it| bits(&it)));
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn a_panic_of_the_narrow_phase_leaves_no_step_behind() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (bodies, collisions) = scene(CUBES);
    let kept = write(&mut accelerator, &bodies, &collisions).expect("written");
    for count in [0, 1, 30, 77] {
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let _ = accelerator.write(&bodies, 999, &parameters(), |records| {
                collisions.iter().take(count).for_each(|it| records.push(it));
                panic!("the caller's");
            });
        }));
        assert!(panicked.is_err());
        let started = accelerator.start(&kept).map(drop);
        assert!(matches!(started, Err(Error::Input(InputError::NotPrepared))), "{started:?}");
        assert_works(&mut accelerator, "after a panic");
    }
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn a_written_step_makes_way_for_one_that_is_given_at_once() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (bodies, collisions) = scene(CUBES);
    let written = write(&mut accelerator, &bodies, &collisions).expect("written");
    assert_works(&mut accelerator, "in its place");
    let started = accelerator.start(&written).map(drop);
    assert!(matches!(started, Err(Error::Input(InputError::NotPrepared))), "{started:?}");
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

/// Each step has its own set of static bodies.
#[test]
fn worlds_with_other_static_bodies_do_not_mix() {
    for name in ["float", "half"] {
        let profile = Profile::by_name(name).expect("a profile");
        let (board, mut accelerator) = open(BoardConfig { profile, ..BoardConfig::default() });
        let (left, collisions) = scene(40);
        // Static and falling bodies have changed places; sixteen bits do not hold these positions.
        let mut right: Vec<Body> = left.iter().map(|body| Body { shape: 1, ..*body }).collect();
        for body in &mut right {
            body.pose.position = body.pose.position.map(|at| (at / 64.0) + 0.1);
        }
        for at in [3, 40] {
            right[at] = Body { velocity: Velocity::default(), shape: 0, ..right[at] };
        }
        let none: [Collision; 0] = [];
        let mut expected = [left.clone(), right.clone()];
        accelerator.step(&mut expected[0], &collisions, &parameters()).expect("a step");
        accelerator.step(&mut expected[1], &none[..], &parameters()).expect("a step");
        for at in [3, 40] {
            assert_eq!(expected[1][at], right[at], "it stands");
        }
        assert_ne!(expected[1][0], right[0], "it falls");

        let mut found = [left.clone(), right.clone()];
        let mut flight = accelerator.submit(&left, &collisions, &parameters()).expect("starts");
        let next = flight.write(&right, 0, &parameters(), |_| {}).expect("written");
        let (report, started) = flight.wait_and_start(&mut found[0], &next);
        report.expect("a good step");
        let mut flight = started.expect("starts");
        let again = flight.prepare(&left, &collisions, &parameters()).expect("packed");
        let (report, started) = flight.wait_and_start(&mut found[1], &again);
        report.expect("a good step");
        let mut third = left.clone();
        started.expect("starts").wait(&mut third).expect("a good step");
        assert_eq!(found.each_ref().map(|it| bits(it)), expected.each_ref().map(|it| bits(it)));
        assert_eq!(bits(&third), bits(&expected[0]), "{name}");
        drop(accelerator);
        assert_eq!(board.violations(), []);
    }
}
