//! Compares the extensions of interface 1.2 with the direct solver, bit for bit, and holds a board of
//! version 1.1 against a driver of 1.2.
#![cfg(feature = "emulation")]

use crate::common::direct::direct_step;
use crate::common::random_scene::{scene, shapes};
use crate::common::{bits, open_with, ordered};
use bitstream_model::BoardConfig;
use bitstream_model::interface::control;
use bitstream_model::interface::extension::Extensions;
use bitstream_model::interface::profile::{FLOAT, Inertia, NAIVE};
use zynq_pgs::order::Order;
use zynq_pgs::{Body, Collision, Shape, StepParameters};

/// The boards whose bits are the direct solver's: f32 with absolute records, world inertia; with the
/// short cuts of the emulation and without.
fn boards() -> Vec<BoardConfig> {
    let mut boards = Vec::new();
    for profile in [&FLOAT, &NAIVE] {
        for (shortcuts, lanes, threads) in
            [(false, false, 1), (true, false, 1), (true, true, 1), (true, true, 2)]
        {
            let inertia = Inertia::World;
            boards.push(BoardConfig {
                profile,
                inertia,
                shortcuts,
                lanes,
                threads,
                ..BoardConfig::default()
            });
        }
    }
    boards
}

/// Takes two steps on every board and directly; the bits must be the same.
fn compare(
    scene: &(Vec<Body>, Vec<Collision>),
    shapes: &[Shape],
    parameters: &StepParameters,
) -> Vec<u32> {
    let (bodies, collisions) = scene;
    let mut expected = bodies.clone();
    for _ in 0..2 {
        direct_step(&mut expected, collisions, shapes, parameters);
    }
    for config in boards() {
        let (board, mut accelerator) = open_with(config, None, shapes);
        let mut found = bodies.clone();
        for _ in 0..2 {
            accelerator
                .step(&mut found, collisions, parameters)
                .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
        }
        assert_eq!(bits(&found), bits(&expected), "{config:?}");
        assert_eq!(board.violations(), []);
    }
    bits(&expected)
}

#[test]
fn the_spin_damping_is_the_argument() {
    let (scene, shapes) = (scene(7), shapes());
    let with = |share| {
        let mut parameters = ordered(Order::AsGiven);
        parameters.spin_damping = share;
        compare(&scene, &shapes, &parameters)
    };
    let [off, bullet, strong] = [0.0, 0.1, 0.75].map(with);
    assert!(off != bullet && bullet != strong);
}

/// A board of interface version 1.1.
fn old() -> BoardConfig {
    let mut config = BoardConfig { extensions: Extensions::NONE, ..BoardConfig::default() };
    config.inertia = Inertia::World;
    config.quirks.version = 0x0001_0001;
    config
}

#[test]
fn a_board_of_version_1_1_takes_the_steps_that_it_knows() {
    let ((bodies, collisions), shapes) = (scene(3), shapes());
    let parameters = ordered(Order::AsGiven);
    let mut expected = bodies.clone();
    direct_step(&mut expected, &collisions, &shapes, &parameters);
    let (board, mut accelerator) = open_with(old(), None, &shapes);
    assert_eq!(accelerator.capabilities().version, (1, 1));
    let mut found = bodies;
    accelerator.step(&mut found, &collisions, &parameters).expect("no extension is asked for");
    assert_eq!(bits(&found), bits(&expected));
    // A strict board dies of an access to a register that it lacks.
    assert_eq!(board.violations(), []);
}

#[test]
fn a_board_of_version_1_1_refuses_each_extension_by_name() {
    let ((bodies, collisions), shapes) = (scene(3), shapes());
    let (board, mut accelerator) = open_with(old(), None, &shapes);
    let mut parameters = StepParameters::default();
    parameters.spin_damping = 0.0;
    let mut found = bodies.clone();
    let error = accelerator.step(&mut found, &collisions, &parameters).expect_err("version 1.1");
    assert!(error.is_input());
    assert!(error.to_string().starts_with("the spin damping is 0, and this bitstream"), "{error}");
    assert_eq!(bits(&found), bits(&bodies), "nothing has changed");
    assert_eq!(board.violations(), []);
}

/// A driver of version 1.1 writes no argument of an extension: the values after a reset are the
/// values of version 1.1.
#[test]
fn arguments_of_extensions_begin_at_the_values_of_version_1_1() {
    assert_eq!(control::SPIN_DAMPING.reset, 0.1_f32.to_bits());
}
