//! Steps in flight: submitted, prepared, cancelled.

use std::ptr::{from_ref, null, null_mut};

use zynq_pgs_c::*;

use crate::support::*;

#[test]
fn submit_and_wait_are_a_step_and_one_step_is_in_flight() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all) = (arrays(&mut crates), collisions(&all));
    assert_eq!(open.wait(&bodies), Status::Sequence);
    assert!(open.text().contains("zpgs_submit"), "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Ok, "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Sequence);
    assert_eq!(open.step(&bodies, &all, &defaults()), Status::Sequence);
    assert_eq!(open.set_shapes(&SHAPES), Status::Sequence);
    assert_eq!(made!(zpgs_wait(open.0, null(), null_mut())), Status::NullPointer);
    assert_eq!(open.wait(&bodies), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
    assert_eq!(open.submit(&arrays(&mut crates), &all), Status::Ok, "and closed in flight");
}

#[test]
fn a_step_is_prepared_while_another_is_in_flight() {
    let (open, all) = (Open::new("emulated:float"), [collision()]);
    let (mut left, mut right) = (world(), world());
    let (all, parameters) = (collisions(&all), defaults());
    let prepare = |bodies: &BodyArrays| {
        made!(zpgs_prepare(open.0, from_ref(bodies), from_ref(&all), from_ref(&parameters)))
    };
    let wait_and_start = |bodies: &BodyArrays| {
        let mut started = Status::Panic;
        let (report, out) = (null_mut(), &raw mut started);
        (made!(zpgs_wait_and_start(open.0, from_ref(bodies), report, out)), started)
    };
    let refused = (Status::Sequence, Status::Sequence);
    assert_eq!(prepare(&arrays(&mut right)), Status::Sequence);
    assert_eq!(made!(zpgs_start(open.0)), Status::Sequence);
    assert!(open.text().contains("zpgs_prepare"), "{}", open.text());
    assert_eq!(open.submit(&arrays(&mut left), &all), Status::Ok, "{}", open.text());
    assert_eq!(wait_and_start(&arrays(&mut left)), refused, "nothing is prepared");
    assert_eq!(prepare(&arrays(&mut right)), Status::Ok, "{}", open.text());
    assert_eq!(made!(zpgs_start(open.0)), Status::Sequence, "a step is in flight");
    assert_eq!(wait_and_start(&arrays(&mut left)), (Status::Ok, Status::Ok), "{}", open.text());
    assert_eq!(left, stepped());
    assert_eq!(open.wait(&arrays(&mut right)), Status::Ok, "{}", open.text());
    assert_eq!(right, stepped());
    // Its records are still there.
    let mut again = world();
    assert_eq!(made!(zpgs_start(open.0)), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut again)), Status::Ok, "{}", open.text());
    assert_eq!(again, stepped());
    assert_eq!(wait_and_start(&arrays(&mut again)), refused, "none is in flight");
    // A start that is refused leaves the results of the step before in place.
    let (mut left, mut right) = (world(), world());
    assert_eq!(open.submit(&arrays(&mut left), &all), Status::Ok, "{}", open.text());
    assert_eq!(prepare(&arrays(&mut right)), Status::Ok, "{}", open.text());
    open.cancel();
    let (done, started) = wait_and_start(&arrays(&mut left));
    assert_eq!((done, started), (Status::Cancelled, Status::Cancelled), "{}", open.text());
    assert_eq!((left, right), (world(), world()));
    assert_eq!(open.wait(&arrays(&mut right)), Status::Sequence, "no step is in flight");
}

#[test]
fn a_cancellation_ends_one_step() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all) = (arrays(&mut crates), collisions(&all));
    open.cancel();
    assert_eq!(open.step(&bodies, &all, &defaults()), Status::Cancelled);
    assert!(open.text().contains("cancel"), "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Ok, "{}", open.text());
    open.cancel();
    assert_eq!(open.wait(&bodies), Status::Cancelled);
    assert_eq!(crates, world());
    assert_eq!(open.step(&arrays(&mut crates), &all, &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
}
