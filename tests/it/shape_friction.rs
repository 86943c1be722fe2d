//! A friction for each shape, where the collisions have no room for one.
#![cfg(feature = "emulation")]

use crate::common::{at_rest, bits, open_with, ordered, standing};
use bitstream_model::interface::extension::Extensions;
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, Profile};
use bitstream_model::{BoardConfig, FaultPlan};
use zynq_pgs::order::Order;
use zynq_pgs::{Body, Collision, Shape, StepParameters, Velocity};

const WITHOUT_ROOM: [&Profile; 1] = [&HALF];

/// The ground, and cubes of the shapes 1, 2.. that slide on it.
fn sliding(cubes: u16) -> (Vec<Body>, Vec<Collision>) {
    let mut bodies = vec![at_rest([0.0, -10.0, 0.0], 0)];
    let mut collisions = Vec::new();
    for cube in 1..=cubes {
        let x = 4.0 * f32::from(cube);
        let velocity = Velocity { linear: [0.0, -0.5, 1.0], ..Velocity::default() };
        bodies.push(Body { velocity, ..at_rest([x, 0.99, 0.0], cube.into()) });
        collisions.push(standing([0, cube.into()], x, -0.01, -0.01));
    }
    (bodies, collisions)
}

fn cubes(frictions: &[f32]) -> Vec<Shape> {
    frictions.iter().map(|friction| Shape::isotropic(1.0, 1.5).with_friction(*friction)).collect()
}

fn parameters() -> StepParameters {
    ordered(Order::AsGiven).with_shape_friction(true)
}

/// Each cube ends as in a step with one friction, the product of its own and the ground's. The products are
/// exact in binary16.
#[test]
fn the_friction_of_a_collision_is_the_product_of_both_shapes() {
    let frictions = [0.0, 0.25, 0.5, 1.0];
    let ground = 0.5;
    let (bodies, collisions) = sliding(4);
    let mut shapes = vec![Shape::STATIC.with_friction(ground)];
    shapes.extend(cubes(&frictions));
    for profile in WITHOUT_ROOM {
        for inertia in [Inertia::Isotropic, Inertia::World] {
            let config = BoardConfig { profile, inertia, ..BoardConfig::default() };
            let (board, mut accelerator) = open_with(config, None, &shapes);
            let mut found = bodies.clone();
            let report = accelerator.step(&mut found, &collisions, &parameters());
            report.unwrap_or_else(|error| panic!("{}: {error}", profile.name));
            let mut ends = Vec::new();
            for (cube, friction) in (1..).zip(frictions) {
                let parameters = ordered(Order::AsGiven).with_friction(friction * ground);
                let mut expected = bodies.clone();
                accelerator.step(&mut expected, &collisions, &parameters).expect("a good step");
                let own = |bodies: &[Body]| bits(&bodies[cube..=cube]);
                assert_eq!(own(&found), own(&expected), "{} cube {cube}", profile.name);
                ends.push(found[cube].velocity.linear[2]);
            }
            assert!(
                ends.windows(2).all(|pair| pair[0] > pair[1]),
                "more friction is slower: {ends:?}"
            );
            assert_eq!(board.violations(), []);
        }
    }
}

#[test]
fn a_reset_after_a_fault_restores_the_frictions() {
    let (bodies, collisions) = sliding(1);
    let shapes = [vec![Shape::STATIC], cubes(&[0.25])].concat();
    let config = BoardConfig { profile: &HALF, ..BoardConfig::default() };
    let (board, mut accelerator) = open_with(config, None, &shapes);
    let mut expected = bodies.clone();
    accelerator.step(&mut expected, &collisions, &parameters()).expect("a good step");
    let fault: FaultPlan = "accelerator-hang@accelerator".parse().expect("a plan");
    board.inject(fault);
    let mut found = bodies.clone();
    accelerator.step(&mut found, &collisions, &parameters()).expect_err("it hangs");
    assert_eq!(bits(&found), bits(&bodies));
    accelerator.step(&mut found, &collisions, &parameters()).expect("a good step");
    assert_eq!(bits(&found), bits(&expected));
}

#[test]
fn a_board_that_has_no_frictions_of_shapes_refuses_the_step() {
    let (mut bodies, collisions) = sliding(1);
    let shapes = [vec![Shape::STATIC], cubes(&[0.25])].concat();
    let older = Extensions { shape_friction: false, ..Extensions::ALL };
    for config in [
        BoardConfig { profile: &FLOAT, ..BoardConfig::default() },
        BoardConfig { profile: &HALF, extensions: older, ..BoardConfig::default() },
    ] {
        let (_, mut accelerator) = open_with(config, None, &shapes);
        let error = accelerator.step(&mut bodies, &collisions, &parameters());
        let text = error.expect_err("no frictions").to_string();
        assert!(text.contains("a friction for each shape"), "{text}");
        assert!(text.contains("profiles that could: half)"), "{text}");
    }
}
