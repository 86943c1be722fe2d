//! Tests that a step has the same bits for every storage of bodies and collisions: arrays of
//! structures and separate arrays.
#![cfg(feature = "emulation")]

use crate::common;
use bitstream_model::BoardConfig;
use bytemuck::Zeroable;
use proptest::prelude::*;
use scene::{Scene, SceneOptions};
use zynq_pgs::scene::{BodyArrays, CollisionArrays, Real};
use zynq_pgs::{Bodies, Body, Collisions, Pose, Shape, StepParameters, Velocity};

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

    let mut singles = Columns::<f32>::of(bodies, [0.0; 3]);
    // A double holds the sum of a place of the pile and this origin nearly without rounding.
    let origin = [1e6, -65_536.0, 4096.0];
    let mut doubles = Columns::<f64>::of(bodies, [0.0; 3]);
    let mut far = Columns::<f64>::of(bodies, origin);
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

    let collision_arrays =
        CollisionArrays { bodies: &pairs, normals: &normals, counts: &counts, contacts: &contacts };
    let parameters = StepParameters::default();
    let mut step = |bodies: &mut dyn Bodies| {
        accelerator.step(bodies, &collision_arrays, &parameters).expect("a step");
    };
    step(&mut singles.arrays());
    step(&mut doubles.arrays());
    step(&mut far.arrays());
    let before = common::bits(bodies);
    accelerator.step(bodies, collisions, &parameters).expect("a step");
    assert_ne!(common::bits(bodies), before, "the step moves bodies");
    let bits = common::bits(bodies);
    assert_eq!(common::bits(&singles.bodies()), bits);
    assert_eq!(common::bits(&doubles.bodies()), bits);
    let [.., last] = bodies else { panic!("bodies") };
    let there = far.positions[far.positions.len() - 1];
    for ((far, near), origin) in there.into_iter().zip(last.pose.position).zip(origin) {
        assert!((far - origin - f64::from(near)).abs() < 1e-6, "{there:?} {last:?}");
    }
}

/// Bodies in arrays of their own.
struct Columns<R> {
    positions: Vec<[R; 3]>,
    orientations: Vec<[R; 4]>,
    linear_velocities: Vec<[R; 3]>,
    angular_velocities: Vec<[R; 3]>,
    shapes: Vec<u32>,
    origin: [R; 3],
}

impl<R: Real> Columns<R> {
    fn of(bodies: &[Body], origin: [R; 3]) -> Self {
        let zero = R::default();
        let place =
            |position: [f32; 3]| std::array::from_fn(|i| R::from(position[i]) - (zero - origin[i]));
        Self {
            positions: bodies.iter().map(|body| place(body.pose.position)).collect(),
            orientations: bodies.iter().map(|body| body.pose.orientation.map(R::from)).collect(),
            linear_velocities: bodies
                .iter()
                .map(|body| body.velocity.linear.map(R::from))
                .collect(),
            angular_velocities: bodies
                .iter()
                .map(|body| body.velocity.angular.map(R::from))
                .collect(),
            shapes: bodies.iter().map(|body| body.shape).collect(),
            origin,
        }
    }

    fn arrays(&mut self) -> BodyArrays<'_, R> {
        BodyArrays {
            positions: &mut self.positions,
            orientations: &mut self.orientations,
            linear_velocities: &mut self.linear_velocities,
            angular_velocities: &mut self.angular_velocities,
            shapes: &self.shapes,
            origin: self.origin,
        }
    }

    fn bodies(&mut self) -> Vec<Body> {
        let arrays = self.arrays();
        (0..arrays.len()).map(|index| arrays.body(index)).collect()
    }
}

/// Any number but NaN, both zeros among them.
fn any_number() -> impl Strategy<Value = f32> {
    use prop::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

fn any_body() -> impl Strategy<Value = Body> {
    let three = || prop::array::uniform3(any_number());
    (three(), prop::array::uniform4(any_number()), three(), three(), any::<u32>()).prop_map(
        |(position, orientation, linear, angular, shape)| Body {
            pose: Pose { position, orientation },
            velocity: Velocity { linear, angular },
            shape,
        },
    )
}

proptest! {
    #[test]
    fn doubles_with_the_values_of_singles_are_the_same_bodies(
        before in prop::collection::vec(any_body(), 1..4),
        after in any_body(),
    ) {
        let mut singles = Columns::<f32>::of(&before, [0.0; 3]);
        let mut doubles = Columns::<f64>::of(&before, [0.0; 3]);
        prop_assert_eq!(common::bits(&singles.bodies()), common::bits(&before));
        prop_assert_eq!(common::bits(&doubles.bodies()), common::bits(&before));
        singles.arrays().commit(0, after.pose, after.velocity);
        doubles.arrays().commit(0, after.pose, after.velocity);
        let expected: Vec<_> = [Body { shape: before[0].shape, ..after }]
            .into_iter()
            .chain(before.into_iter().skip(1))
            .collect();
        prop_assert_eq!(common::bits(&singles.bodies()), common::bits(&expected));
        prop_assert_eq!(common::bits(&doubles.bodies()), common::bits(&expected));
    }

    /// As poses of a step without integration, and static bodies.
    #[test]
    fn a_double_that_a_step_has_not_changed_keeps_all_its_digits(
        place in prop::array::uniform3(-1e7..1e7_f64),
        origin in prop::array::uniform3(-1e7..1e7_f64),
    ) {
        let mut far = Columns::of(&[Body::zeroed()], origin);
        far.positions[0] = place;
        let body = far.bodies()[0];
        let linear = [1.0, 2.0, 3.0];
        let moved = Velocity { linear, ..body.velocity };
        far.arrays().commit(0, body.pose, moved);
        prop_assert_eq!(far.positions[0].map(f64::to_bits), place.map(f64::to_bits));
        let bits = linear.map(|speed| f64::from(speed).to_bits());
        prop_assert_eq!(far.linear_velocities[0].map(f64::to_bits), bits);
    }
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
