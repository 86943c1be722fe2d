//! Compares what a step can ask for beside the plain solver with the direct solver, bit for bit:
//! the spin damping, static bodies that move, frictions of pairs, streamed masses.
#![cfg(feature = "emulation")]

use crate::common::direct::direct_step;
use crate::common::random_scene::{scene, shapes};
use crate::common::{bits, open_with, ordered, row};
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, NAIVE, Profile};
use bitstream_model::{BoardConfig, Direction, Fault, FaultKind};
use zynq_pgs::order::Order;
use zynq_pgs::{Body, Collision, Shape, StepParameters, Velocity};

/// The boards whose bits are the direct solver's: f32 with absolute records; by the reference
/// and by the fast way.
fn boards(shapes: &[Shape]) -> Vec<BoardConfig> {
    let mut boards = Vec::new();
    let isotropic = shapes.iter().all(Shape::is_isotropic);
    let inertia = if isotropic { Inertia::Isotropic } else { Inertia::World };
    let built = |profile: &&Profile| profile.inertias().contains(&inertia);
    for profile in [&FLOAT, &NAIVE].into_iter().filter(built) {
        for (fast, threads) in [(false, 1), (true, 1), (true, 2)] {
            let mut config = BoardConfig { profile, inertia, ..BoardConfig::default() };
            (config.fast, config.threads) = (fast, threads);
            boards.push(config);
        }
    }
    boards
}

/// Shapes of any inertia, and the same with equal components, which have f32 alone.
fn both_inertias() -> [Vec<Shape>; 2] {
    let isotropic = |shape: Shape| Shape::isotropic(shape.inverse_mass, shape.inverse_inertia[0]);
    [shapes().to_vec(), shapes().map(isotropic).to_vec()]
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
    for config in boards(shapes) {
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
    let scene = scene(7);
    let with = |share| {
        let mut parameters = ordered(Order::AsGiven);
        parameters.spin_damping = share;
        both_inertias().map(|shapes| compare(&scene, &shapes, &parameters))
    };
    let [off, bullet, strong] = [0.0, 0.1, 0.75].map(with);
    assert!(off != bullet && bullet != strong);
}

/// The scene with a fifth of its bodies without a mass, half of them under way.
fn with_platforms(seed: u64) -> (Vec<Body>, Vec<Collision>) {
    let (mut bodies, mut collisions) = scene(seed);
    for (number, body) in bodies.iter_mut().enumerate().skip(1).step_by(5) {
        body.shape = 0;
        if number % 2 == 0 {
            body.velocity = Velocity::default();
        }
    }
    let fixed = |body: u32| bodies[body as usize].shape == 0;
    collisions.retain(|of| !(fixed(of.body_a) && fixed(of.body_b)));
    (bodies, collisions)
}

#[test]
fn each_pair_has_its_own_friction() {
    let (bodies, mut collisions) = scene(23);
    for (number, collision) in (0_u16..).zip(&mut collisions) {
        *collision = collision.with_friction(f32::from(number % 9) * 0.15);
    }
    // A friction does not give a collision a contact point.
    let empty = Collision { count: 0, body_b: u32::MAX, ..collisions[5] }.with_friction(0.5);
    collisions.insert(6, empty);
    let mut parameters = ordered(Order::AsGiven);
    parameters.pair_friction = true;
    for shapes in both_inertias() {
        let scene = (bodies.clone(), collisions.clone());
        let own = compare(&scene, &shapes, &parameters);
        // The parameter for all pairs does not count.
        let mut other = parameters;
        other.friction = 0.1;
        assert_eq!(compare(&scene, &shapes, &other), own);
    }
}

#[test]
fn static_bodies_move_as_the_formulae_say() {
    for integrate in [true, false] {
        let mut parameters = ordered(Order::AsGiven);
        (parameters.kinematic, parameters.integrate) = (true, integrate);
        for shapes in both_inertias() {
            let scene = with_platforms(11);
            let under_way = |body: &&Body| body.shape == 0 && body.velocity != Velocity::default();
            assert_eq!(scene.0.iter().filter(under_way).count(), 6);
            compare(&scene, &shapes, &parameters);
        }
    }
}

#[test]
fn a_static_body_that_moves_is_no_hazard() {
    let (mut parameters, shapes) = (ordered(Order::AsGiven), both_inertias()[1].clone());
    parameters.kinematic = true;
    let (mut bodies, collisions) = row(40, 2.2, |_| Velocity::default());
    bodies[0].velocity.linear = [0.5, 0.0, 0.0];
    let (_board, mut accelerator) = open_with(BoardConfig::default(), None, &shapes);
    let report = accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
    assert_eq!(report.hazards, 0);
    assert!(bodies[0].pose.position[0] > 0.008, "the platform moves");
    assert!(bodies[1..].iter().all(|body| body.velocity.linear[0] > 0.0), "and takes them along");
}

#[test]
fn static_bodies_move_where_numbers_have_sixteen_bits() {
    let config = BoardConfig { profile: &HALF, ..BoardConfig::default() };
    let (board, mut accelerator) = open_with(config, None, &both_inertias()[1]);
    let mut parameters = StepParameters::default();
    parameters.kinematic = true;
    let (mut bodies, collisions) = row(12, 2.2, |_| Velocity::default());
    bodies.push(Body { velocity: Velocity::default(), ..bodies[0] });
    bodies[0].velocity.linear = [0.0, 0.0, 3.0];
    let resting = bodies[13];
    accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
    assert!((0.03..0.07).contains(&bodies[0].pose.position[2]), "{:?}", bodies[0].pose);
    let [_, _, z] = bodies[0].velocity.linear;
    assert_eq!(z.to_bits(), 3.0_f32.to_bits());
    assert_eq!(bodies[13], resting, "to the bit");
    assert!(bodies[1..13].iter().all(|body| body.velocity.linear[2] > 0.0), "{bodies:?}");
    assert_eq!(board.violations(), []);
}

/// A static shape and 149 moving ones, each of another mass and inertia. The table has 64 entries.
fn many_shapes() -> Vec<Shape> {
    let moving = (1..150_u8).map(f32::from).map(|number| Shape {
        inverse_inertia: [1.0, 1.5, 2.0].map(|k| k + number / 32.0),
        ..Shape::isotropic(0.25 + number / 64.0, 0.0)
    });
    std::iter::once(Shape::STATIC).chain(moving).collect()
}

/// The scene whose moving bodies have `shapes` in turn.
fn with_shapes(seed: u64, shapes: u32) -> (Vec<Body>, Vec<Collision>) {
    let (mut bodies, collisions) = scene(seed);
    for (number, body) in (0_u32..).zip(&mut bodies).filter(|(_, body)| body.shape != 0) {
        body.shape = 1 + 7 * number % (shapes - 1);
    }
    (bodies, collisions)
}

#[test]
fn every_body_can_bring_a_mass_of_its_own() {
    let shapes = many_shapes();
    for kinematic in [false, true] {
        let parameters = ordered(Order::AsGiven).with_kinematic(kinematic);
        let scene = with_shapes(31, 150);
        let distinct: std::collections::BTreeSet<u32> =
            scene.0.iter().map(|body| body.shape).collect();
        assert!(distinct.len() > 20 && distinct.iter().any(|shape| *shape > 64), "{distinct:?}");
        compare(&scene, &shapes, &parameters);
    }
}

#[test]
fn a_streamed_mass_counts_as_one_of_the_table() {
    let (bodies, collisions) = with_shapes(5, 64);
    for fast in [false, true] {
        let config = BoardConfig { fast, inertia: Inertia::World, ..Default::default() };
        let step = |shapes: &[Shape]| {
            let (board, mut accelerator) = open_with(config, None, shapes);
            let mut bodies = bodies.clone();
            let parameters = ordered(Order::AsGiven);
            let report = accelerator.step(&mut bodies, &collisions, &parameters);
            let cycles = report.expect("a step").cycles;
            assert_eq!(board.violations(), []);
            (bits(&bodies), cycles)
        };
        let shapes = many_shapes();
        assert_eq!(step(&shapes), step(&shapes[..64]), "{config:?}");
    }
}

/// The table is written again after masses were streamed, and a reset writes what the board needs.
#[test]
fn one_board_takes_few_shapes_after_many_and_many_after_few() {
    let many = many_shapes();
    let (bodies, collisions) = with_shapes(9, 150);
    let few_bodies = with_shapes(9, 64).0;
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let parameters = ordered(Order::AsGiven).with_retries(1);
    let (board, mut accelerator) = open_with(config, None, &many);
    for (shapes, bodies, fails) in [
        (&many[..], &bodies, false),
        (&many[..64], &few_bodies, true),
        (&many[..], &bodies, true),
        (&many[..64], &few_bodies, false),
    ] {
        accelerator.set_shapes(shapes).expect("shapes that fit");
        let (mut expected, mut found) = (bodies.clone(), bodies.clone());
        direct_step(&mut expected, &collisions, shapes, &parameters);
        if fails {
            board.inject(Fault::new(FaultKind::DmaDecErr).on(0, Direction::Mm2s));
        }
        let report = accelerator.step(&mut found, &collisions, &parameters).expect("a step");
        assert_eq!(report.retries, u32::from(fails));
        assert_eq!(bits(&found), bits(&expected), "{} shapes", shapes.len());
    }
}

#[test]
fn more_shapes_than_entries_need_world_inertia() {
    let (_board, mut accelerator) = open_with(BoardConfig::default(), None, &both_inertias()[1]);
    let error = accelerator.set_shapes(&[Shape::isotropic(1.0, 6.0); 65]).expect_err("65");
    assert!(error.is_input() && error.to_string().contains("takes at most 64"), "{error}");
}
