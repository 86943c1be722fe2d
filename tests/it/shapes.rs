//! Compares scenes of several shapes, two of them anisotropic, with the direct solver, bit for bit.
#![cfg(feature = "emulation")]

use crate::common::direct::direct_step;
use crate::common::random_scene::{BODIES, scene, shapes};
use crate::common::{self, bits};
use bitstream_model::interface::profile::Inertia;
use bitstream_model::{BoardConfig, EmulatedBoard};
use zynq_pgs::order::Order;
use zynq_pgs::{Accelerator, StepParameters};

fn open(inertia: Inertia) -> (EmulatedBoard, Accelerator) {
    common::open(BoardConfig { inertia, ..BoardConfig::default() })
}

#[test]
fn shapes_of_any_inertia_are_solved_as_the_formulae_say() {
    let shapes = shapes();
    assert_eq!(shapes.iter().filter(|shape| !shape.is_isotropic()).count(), 2);
    for seed in 1..=5 {
        let (board, mut accelerator) = open(Inertia::World);
        accelerator.set_shapes(&shapes).expect("with world inertia");
        let (mut found, collisions) = scene(seed);
        // The reference takes the collisions in the given order.
        let parameters = StepParameters::default().with_order(Order::AsGiven);
        let mut expected = found.clone();
        let before = bits(&found);
        // The second step starts from other orientations.
        for step in 1..=2 {
            accelerator
                .step(&mut found, &collisions, &parameters)
                .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
            direct_step(&mut expected, &collisions, &shapes, &parameters);
            assert_eq!(bits(&found), bits(&expected), "seed {seed}, step {step}");
        }
        let after = bits(&found);
        let bodies = before.chunks(NUMBERS).zip(after.chunks(NUMBERS));
        let moved = bodies.filter(|(before, after)| before != after);
        assert_eq!(moved.count(), bodies_that_move(), "all but the ground");
        assert_eq!(board.violations(), []);
    }
}

/// Numbers of a body's state.
const NUMBERS: usize = 13;

fn bodies_that_move() -> usize {
    BODIES as usize - 1
}

/// The reference can fail: a body with the inertia of another orientation ends up elsewhere.
#[test]
fn the_orientation_of_an_anisotropic_body_matters() {
    let (shapes, parameters) = (shapes(), StepParameters::default());
    let (mut turned, collisions) = scene(1);
    let mut straight = turned.clone();
    for body in &mut straight {
        body.pose.orientation = [0.0, 0.0, 0.0, 1.0];
    }
    direct_step(&mut turned, &collisions, &shapes, &parameters);
    direct_step(&mut straight, &collisions, &shapes, &parameters);
    let differ = turned
        .iter()
        .zip(&straight)
        .any(|(a, b)| a.velocity.linear.map(f32::to_bits) != b.velocity.linear.map(f32::to_bits));
    assert!(differ);
}

#[test]
fn a_bitstream_without_world_inertia_refuses_such_shapes_before_anything_is_sent() {
    let (board, mut accelerator) = open(Inertia::Isotropic);
    let before = (board.counts().register_reads, board.counts().register_writes);
    let error = accelerator.set_shapes(&shapes()).expect_err("a box");
    assert!(error.is_input());
    let text = error.to_string();
    assert!(text.starts_with("shape 2: its inverse inertia is ["), "{text}");
    assert!(text.ends_with("(profiles that could, built with world inertia: float)"), "{text}");
    assert_eq!((board.counts().register_reads, board.counts().register_writes), before);
}
