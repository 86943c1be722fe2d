//! Tests the warm start by place: each collision begins with the impulses that it had in the last
//! step that was committed, wherever it stood there.
#![cfg(feature = "emulation")]

use crate::common::direct::direct_step_from;
use crate::common::random_scene::{scene, shapes};
use crate::common::{bits, open_with, ordered};
use bitstream_model::interface::profile::Inertia;
use bitstream_model::{BoardConfig, EmulatedBoard, FaultPlan};
use zynq_pgs::order::Order;
use zynq_pgs::{
    Accelerator, Body, Cancellation, Collision, Collisions as _, Error, Impulses, InputError,
    LastStep, Place, StepParameters,
};

const FACTOR: f32 = 0.85;

fn words(impulses: &[Impulses]) -> &[u32] {
    bytemuck::cast_slice(impulses)
}

fn warm() -> StepParameters {
    ordered(Order::AsGiven).with_warm_start(true).with_impulses_out(true)
}

fn open() -> (EmulatedBoard, Accelerator) {
    open_with(BoardConfig { inertia: Inertia::World, ..BoardConfig::default() }, None, &shapes())
}

/// Impulses that tell a collision and a point by their value.
fn numbered(count: usize) -> Vec<Impulses> {
    (0..count)
        .map(|at| Impulses {
            normal: [0.0, 0.25, 0.5, 0.75].map(|point| point + at as f32 + 1.0),
            friction: [at as f32, -1.0],
        })
        .collect()
}

/// A last step of `collisions` with [`numbered`] impulses.
fn last(collisions: &[Collision]) -> LastStep {
    let mut last = LastStep::default();
    last.commit(collisions, &numbered(collisions.len())).expect("one for each collision");
    last
}

fn found(last: &LastStep, collisions: &[Collision], places: &[Place]) -> Vec<Impulses> {
    let placed = last.placed(collisions, places, 0.5).expect("places of the last step");
    collisions
        .iter()
        .enumerate()
        .map(|(at, of)| placed.impulses(at, of.normal, of.points()))
        .collect()
}

#[test]
fn new_vanished_and_reordered_collisions_and_points_have_their_own_impulses() {
    let (_, mut old) = scene(5);
    old.iter_mut().for_each(|collision| collision.count = 4);
    let last = last(&old[..4]);
    // Number 1 has vanished. Two collisions share the points of number 2. Both have new points, and
    // the second one has a point beyond its count.
    let new = [old[3], old[9], old[0], old[2], Collision { count: 3, ..old[2] }];
    let [moved, rest] = [[3, 255, 0, 255], [255, 1, 255, 2]];
    let [moved, rest] = [moved, rest].map(|points| Place { collision: 2, points });
    let places = [Place::same(3), Place::NEW, Place::same(0), moved, rest];
    let of = |normal: [f32; 4], at: f32| Impulses { normal, friction: [at, -1.0] }.scaled(0.5);
    let expected = [
        of([4.0, 4.25, 4.5, 4.75], 3.0),
        Impulses::ZERO,
        of([1.0, 1.25, 1.5, 1.75], 0.0),
        Impulses { normal: [1.875, 0.0, 1.5, 0.0], friction: [0.5, -0.25] },
        Impulses { normal: [0.0, 1.625, 0.0, 1.75], friction: [0.25, -0.125] },
    ];
    assert_eq!(found(&last, &new, &places), expected);
    let nothing = LastStep::default();
    assert_eq!(found(&nothing, &new, &[Place::NEW; 5]), [Impulses::ZERO; 5]);
}

#[test]
fn places_that_the_last_step_did_not_have_are_refused_in_words() {
    let (_, old) = scene(5);
    let last = last(&old[..4]);
    let refused = |places: &[Place]| {
        let new = [old[0], old[1]];
        last.placed(&new, places, 1.0).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(
        refused(&[Place::NEW, Place::same(4)]),
        "collision 1: its place in the last step is 4, but that step had 4 collisions, counted \
         from 0: correct it, or give the place of a new one, 4294967295"
    );
    assert_eq!(
        refused(&[Place { points: [0, 1, 254, 3], ..Place::same(2) }, Place::NEW]),
        "collision 0, contact point 2: its place in the last step is 254, expected a point below \
         4, or 255 for a new one: correct it"
    );
    assert_eq!(
        refused(&[Place::NEW]),
        "the arrays of the collisions have different lengths: give every array for all collisions"
    );
    assert_eq!(refused(&[Place::same(3), Place::NEW]), "");
}

#[test]
fn impulses_of_other_collisions_are_not_committed() {
    let (_, old) = scene(5);
    let mut last = last(&old[..4]);
    let before = found(&last, &old[..4], &[0, 1, 2, 3].map(Place::same));
    let refused = last.commit(&old, &numbered(4)).expect_err("another number");
    assert_eq!(refused, InputError::OtherImpulses { found: 4, expected: old.len() });
    let text = refused.to_string();
    assert!(text.contains("`StepParameters::impulses_out`"), "{text}");
    assert_eq!(found(&last, &old[..4], &[0, 1, 2, 3].map(Place::same)), before);
}

/// A world that starts warm by place. The order of its collisions changes from step to step.
struct World {
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    places: Vec<Place>,
    last: LastStep,
}

impl World {
    fn new() -> Self {
        let (bodies, mut collisions) = scene(5);
        collisions.insert(6, Collision { count: 0, body_b: u32::MAX, ..collisions[5] });
        let places = vec![Place::NEW; collisions.len()];
        Self { bodies, collisions, places, last: LastStep::default() }
    }

    fn step(&mut self, accelerator: &mut Accelerator) -> Result<(), Error> {
        let placed = self.last.placed(&self.collisions, &self.places, FACTOR)?;
        accelerator.step(&mut self.bodies, &placed, &warm())?;
        self.commit(accelerator.impulses());
        Ok(())
    }

    /// Commits a step, and makes the collisions of the next: the last one comes first.
    fn commit(&mut self, impulses: &[Impulses]) {
        self.last.commit(&self.collisions, impulses).expect("the impulses of the step");
        self.collisions.rotate_right(1);
        self.places = (0..).take(self.places.len()).map(Place::same).collect();
        self.places.rotate_right(1);
    }

    /// The bodies after some steps on a board of their own, and the impulses of the last one.
    fn after(mut self, steps: usize) -> (Vec<u32>, Vec<u32>) {
        let (_board, mut accelerator) = open();
        (0..steps).for_each(|_| self.step(&mut accelerator).expect("a step"));
        (bits(&self.bodies), words(accelerator.impulses()).to_vec())
    }
}

#[test]
fn a_step_by_place_has_the_bits_of_one_by_value() {
    let World { mut bodies, mut collisions, .. } = World::new();
    let mut given = vec![Impulses::ZERO; collisions.len()];
    let mut out = Vec::new();
    for step in 0..3 {
        if step > 0 {
            given = out.iter().map(|of: &Impulses| of.scaled(FACTOR)).collect();
            given.rotate_right(1);
            collisions.rotate_right(1);
        }
        out = direct_step_from(Some(&given), &mut bodies, &collisions, &shapes(), &warm());
    }
    assert_eq!(World::new().after(3), (bits(&bodies), words(&out).to_vec()));
    assert!(out.iter().any(|of| of.friction[0] != 0.0));
}

/// Takes a step that ends with an error in some way, between two good ones.
fn retried(disturb: impl Fn(&EmulatedBoard, &mut Accelerator, &mut World)) {
    let (board, mut accelerator) = open();
    let mut world = World::new();
    world.step(&mut accelerator).expect("the first step");
    let before = bits(&world.bodies);
    disturb(&board, &mut accelerator, &mut world);
    assert_eq!(bits(&world.bodies), before);
    world.step(&mut accelerator).expect("the second step, again");
    assert_eq!(
        (bits(&world.bodies), words(accelerator.impulses()).to_vec()),
        World::new().after(2)
    );
    assert_eq!(board.violations(), []);
}

#[test]
fn a_step_that_is_given_again_after_a_fault_has_the_same_bits() {
    let plans = [
        "corrupt=0x00400000@dma3.mm2s,phase=contact1,beat=3",
        "corrupt=0x00000001@dma0.s2mm,phase=results,beat=2",
        "dma-dec-err@dma2.mm2s,phase=friction1,beat=5",
        "stall@dma1.s2mm,phase=results,beat=0",
    ];
    for plan in plans {
        retried(|board, accelerator, world| {
            board.inject(plan.parse::<FaultPlan>().expect("a plan"));
            let error = world.step(accelerator).expect_err(plan);
            assert!(error.may_retry(), "{plan}: {error}");
        });
    }
}

#[test]
fn a_step_that_is_given_again_after_a_cancellation_a_reset_or_a_refusal_has_the_same_bits() {
    retried(|_, accelerator, world| {
        let cancellation = Cancellation::new();
        accelerator.set_cancellation(cancellation.clone());
        cancellation.cancel();
        world.step(accelerator).expect_err("it is cancelled");
        cancellation.clear();
    });
    // A step that is dropped is stopped by a reset.
    retried(|_, accelerator, world| {
        let placed = world.last.placed(&world.collisions, &world.places, FACTOR).expect("places");
        drop(accelerator.submit(&world.bodies, &placed, &warm()).expect("a step"));
    });
    retried(|_, accelerator, world| {
        let x = std::mem::replace(&mut world.bodies[1].pose.position[0], f32::NAN);
        world.step(accelerator).expect_err("it is refused");
        world.bodies[1].pose.position[0] = x;
    });
}

#[test]
fn two_worlds_whose_steps_are_prepared_keep_their_own_impulses() {
    let (_board, mut accelerator) = open();
    let (mut left, mut right) = (World::new(), World::new());
    right.bodies.iter_mut().for_each(|body| body.velocity.linear[1] *= 2.0);
    let alone = |world: &World| World { bodies: world.bodies.clone(), ..World::new() }.after(3);
    let expected = [alone(&left), alone(&right)];
    assert_ne!(expected[0], expected[1]);

    let placed = left.last.placed(&left.collisions, &left.places, FACTOR).expect("places");
    let mut flight = accelerator.submit(&left.bodies, &placed, &warm()).expect("the first step");
    let mut out = [Vec::new(), Vec::new()];
    for step in 1..6 {
        // `next` is packed while the board works on `now`.
        let (now, next) =
            if step % 2 == 1 { (&mut left, &mut right) } else { (&mut right, &mut left) };
        let placed = next.last.placed(&next.collisions, &next.places, FACTOR).expect("places");
        let prepared = flight.prepare(&next.bodies, &placed, &warm()).expect("prepared");
        let (report, started) = flight.wait_and_start(&mut now.bodies, &prepared);
        report.expect("a step");
        flight = started.expect("started");
        out[(step + 1) % 2] = words(flight.impulses()).to_vec();
        now.commit(flight.impulses());
    }
    flight.wait(&mut right.bodies).expect("the last step");
    out[1] = words(accelerator.impulses()).to_vec();
    let [of_left, of_right] = out;
    assert_eq!([(bits(&left.bodies), of_left), (bits(&right.bodies), of_right)], expected);
}
