//! Tests that a step has the same bits for every storage of bodies and collisions: arrays of
//! structures and separate arrays.
#![cfg(feature = "emulation")]

use crate::common;
use bitstream_model::BoardConfig;
use scene::{Scene, SceneOptions};
use zynq_pgs::scene::{BodyArrays, CollisionArrays};
use zynq_pgs::{Bodies, Collisions, Shape, StepParameters, Velocity};

#[test]
fn separate_arrays_give_the_bits_of_arrays_of_structures() {
    let (_board, mut accelerator) = common::open(BoardConfig::default());
    let grid = "3x2x3".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a small scene");
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    scene.detect();
    let (bodies, collisions) = scene.parts_mut();
    assert!(collisions.len() > 9, "pairs within the pile, too");

    let mut positions: Vec<_> = bodies.iter().map(|body| body.pose.position).collect();
    let mut orientations: Vec<_> = bodies.iter().map(|body| body.pose.orientation).collect();
    let mut linear_velocities: Vec<_> = bodies.iter().map(|body| body.velocity.linear).collect();
    let mut angular_velocities: Vec<_> = bodies.iter().map(|body| body.velocity.angular).collect();
    let shapes: Vec<_> = bodies.iter().map(|body| body.shape).collect();
    let pairs: Vec<_> = collisions.iter().map(|pair| [pair.body_a, pair.body_b]).collect();
    let normals: Vec<_> = collisions.iter().map(|pair| pair.normal).collect();
    let counts: Vec<_> = collisions.iter().map(|pair| pair.count).collect();
    let contacts: Vec<_> = collisions
        .iter()
        .map(|pair| {
            pair.contacts.map(|contact| {
                let [x, y, z] = contact.point;
                [x, y, z, contact.distance]
            })
        })
        .collect();

    let mut body_arrays = BodyArrays {
        positions: &mut positions,
        orientations: &mut orientations,
        linear_velocities: &mut linear_velocities,
        angular_velocities: &mut angular_velocities,
        shapes: &shapes,
    };
    let collision_arrays =
        CollisionArrays { bodies: &pairs, normals: &normals, counts: &counts, contacts: &contacts };
    let parameters = StepParameters::default();
    accelerator.step(&mut body_arrays, &collision_arrays, &parameters).expect("a step");
    let before = common::bits(bodies);
    accelerator.step(bodies, collisions, &parameters).expect("a step");

    let mut arrays = bodies.to_vec();
    for (index, body) in arrays.iter_mut().enumerate() {
        body.pose.position = positions[index];
        body.pose.orientation = orientations[index];
        body.velocity.linear = linear_velocities[index];
        body.velocity.angular = angular_velocities[index];
    }
    assert_ne!(common::bits(bodies), before, "the step moves bodies");
    assert_eq!(common::bits(&arrays), common::bits(bodies));
}

/// As a caller writes them: `&mut [body]`, `&[collision]`, and references that functions got.
#[test]
fn arrays_and_references_give_the_bits_of_slices() {
    fn step<B: Bodies, C: Collisions>(
        mut bodies: B,
        collisions: C,
        bits: impl Fn(&B) -> Vec<u32>,
    ) -> Vec<u32> {
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
        let (_board, mut board) = common::open_with(BoardConfig::default(), None, &shapes);
        let none = StepParameters::default();
        board.step(&mut bodies, &collisions, &none).expect("a step");
        bits(&bodies)
    }
    let (all, collisions) =
        common::row(2, 2.2, |x| Velocity { linear: [x, -1.0, 0.0], angular: [0.0; 3] });
    let [a, b, c] = all[..] else { panic!("the ground and two cubes") };
    let [one, two] = collisions[..] else { panic!("two collisions") };
    let expected = step(all.clone(), collisions.clone(), |bodies| common::bits(bodies));
    assert_ne!(expected, common::bits(&all));
    assert_eq!(step([a, b, c], [one, two], |bodies| common::bits(bodies)), expected);
    let mut bodies = all.clone();
    assert_eq!(step(&mut bodies[..], &collisions[..], |bodies| common::bits(bodies)), expected);
    let given = &collisions;
    assert!(given.structures().is_some() && [a].structures().is_some());
    assert_eq!((Bodies::len(&[a, b]), Collisions::len(&&[one, two])), (2, 2));
}
