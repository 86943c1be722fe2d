//! Tests that one text opens any emulated board, with the driver's own types alone.
#![cfg(feature = "emulation")]

use std::error::Error as _;

use zynq_pgs::board::BoardKind;
use zynq_pgs::error::{BoardTextError, OpenError};
use zynq_pgs::model::{Bandwidth, ConfigError, EmulatedBoard};
use zynq_pgs::{
    Accelerator, BoardChoice, Error, OpenOptions, Shape, StepParameters, Velocity, emulation::Build,
};

use crate::common::{bits, row};

fn open(build: &str) -> Result<Accelerator, Error> {
    Accelerator::open(OpenOptions::emulated(build)?)
}

#[test]
fn a_text_opens_the_board_that_it_describes() {
    let text = "float,world,unchecked,length-width=14,address-width=32,threads=1";
    let board: BoardChoice = format!("emulated:{text}").parse().expect("a board");
    let by_choice = Accelerator::open(OpenOptions { board, ..OpenOptions::default() });
    for accelerator in [open(text), by_choice] {
        let accelerator = accelerator.expect("a board that opens");
        assert_eq!(accelerator.board().kind, BoardKind::Emulated);
        let can = accelerator.capabilities();
        let build: Build = text.parse().expect("a build");
        assert_eq!(can.variant, build.config().variant());
        assert!(!can.interlocked);
        assert_eq!((can.length_width, can.address_width), (14, 32));
    }
}

#[test]
fn every_profile_opens_by_its_name() {
    for name in Build::names("profile") {
        let accelerator = open(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(accelerator.capabilities().variant.profile.name, name);
    }
}

#[test]
fn each_opening_builds_a_board_of_its_own() {
    let options = OpenOptions::emulated("float").expect("a build");
    let falling = |_| Velocity { linear: [0.0, -1.0, 0.0], angular: [0.0; 3] };
    let (mut bodies, collisions) = row(5, 2.2, falling);
    let [mut left, mut right] = [options.clone(), options].map(|options| {
        let mut accelerator = Accelerator::open(options).expect("a board that opens");
        accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)]).expect("shapes");
        accelerator
    });
    let mut other = bodies.clone();
    let parameters = StepParameters::default();
    // Each has a step in flight, and neither sees the other's.
    let first = left.submit(&bodies, &collisions, &parameters).expect("it starts");
    let second = right.submit(&other, &collisions, &parameters).expect("it starts");
    first.wait(&mut bodies).expect("a step");
    second.wait(&mut other).expect("a step");
    assert_eq!(bits(&bodies), bits(&other));
}

#[test]
fn what_cannot_be_opened_says_why() {
    let error = open("float,quick").expect_err("no such option");
    assert!(matches!(error, Error::Open(OpenError::Text(BoardTextError::Build(_)))), "{error:?}");
    let cause = error.source().expect("a cause").to_string();
    assert!(cause.starts_with("\"quick\" is no option of a build: give one of "), "{cause}");

    let error = open("half,world").expect_err("a contradiction");
    let Error::Open(OpenError::Emulation(cause)) = error else { panic!("{error:?}") };
    assert!(matches!(cause, ConfigError::NoWorldInertia { .. }), "{cause}");
}

#[test]
fn a_board_that_is_built_by_hand_from_a_text_can_be_watched() {
    let build: Build = "float,bandwidth=unlimited".parse().expect("a build");
    let board = EmulatedBoard::new(build.config()).expect("a board");
    assert_eq!(board.config().bandwidth, Bandwidth::Unlimited);
    let board_choice = BoardChoice::Emulated(board.cpu_port());
    let options = OpenOptions { board: board_choice, ..OpenOptions::default() };
    drop(Accelerator::open(options).expect("it opens"));
    assert_eq!(board.violations(), []);
}
