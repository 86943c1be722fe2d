//! Tests that a refused step reports the same error in both cases and in either order: its buffers
//! exist and packing checks the input, or validation comes first. Afterwards bodies and board are
//! unchanged.
#![cfg(feature = "emulation")]

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{at_rest, open_with};
use bitstream_model::BoardConfig;
use zynq_pgs::interface::profile::{FLOAT, HALF, PROFILES, Profile};
use zynq_pgs::order::Order;
use zynq_pgs::scene::Structures;
use zynq_pgs::{
    Accelerator, Bodies, Body, Collision, Collisions, Contact, Error, InputError, Pose, Shape,
    StepParameters, Velocity,
};

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];

/// A row of cubes on the ground, each in contact with the next.
fn scene() -> (Vec<Body>, Vec<Collision>) {
    let mut bodies = vec![at_rest([0.0, -1.0, 0.0], 0)];
    let mut collisions = Vec::new();
    let mut x = 0.0;
    for cube in 1..100 {
        bodies.push(at_rest([x, 0.99, 0.0], 1));
        let contact = Contact { point: [x - 1.0, 0.5, 0.25], distance: -0.01 };
        let normal = if cube == 1 { [0.0, -1.0, 0.0] } else { [-1.0, 0.0, 0.0] };
        let (body_a, body_b) = (cube - 1, cube);
        collisions.push(Collision { body_a, body_b, normal, count: 2, contacts: [contact; 4] });
        x += 2.0;
    }
    (bodies, collisions)
}

fn open(profile: &'static Profile) -> Accelerator {
    open_with(BoardConfig { profile, ..BoardConfig::default() }, None, &SHAPES).1
}

type Mistake = (&'static str, fn(&mut Vec<Body>, &mut Vec<Collision>));

/// One mistake at a time, and the last two together: bodies are checked first, in order of their
/// index.
const MISTAKES: [Mistake; 13] = [
    ("position", |bodies, _| bodies[77].pose.position[1] = f32::NAN),
    ("orientation", |bodies, _| bodies[30].pose.orientation = [0.0; 4]),
    ("infinite orientation", |bodies, _| bodies[29].pose.orientation[3] = f32::INFINITY),
    ("linear velocity", |bodies, _| bodies[99].velocity.linear[2] = f32::NEG_INFINITY),
    ("static body", |bodies, _| bodies[0].velocity.angular[0] = 1.0),
    ("shape", |bodies, _| bodies[31].shape = 2),
    ("no body", |_, collisions| collisions[98].body_b = 100),
    ("same body", |_, collisions| collisions[60].body_b = collisions[60].body_a),
    ("count 5", |_, collisions| collisions[0].count = 5),
    ("normal", |_, collisions| collisions[29].normal = [0.0, 0.998, 0.0]),
    ("contact", |_, collisions| collisions[30].contacts[1].point[2] = f32::NAN),
    ("both static", |bodies, collisions| {
        bodies[50].shape = 0;
        (collisions[50].body_a, collisions[50].body_b) = (50, 0);
    }),
    ("several", |bodies, collisions| {
        collisions[3].count = 9;
        bodies[98].shape = 9;
        bodies[97].pose.orientation = [f32::NAN; 4];
    }),
];

#[test]
fn a_refusal_is_the_same_before_packing_and_while_packing() {
    let (bodies, collisions) = scene();
    for profile in PROFILES {
        for order in [Order::AsGiven, Order::HazardFree] {
            let parameters = StepParameters::default().with_order(order);
            let mut warm = open(profile);
            let (mut expected, mut state) = (bodies.clone(), bodies.clone());
            warm.step(&mut state, &collisions, &parameters).expect("a step");
            open(profile).step(&mut expected, &collisions, &parameters).expect("a step");
            for (name, mistake) in MISTAKES {
                let (mut wrong, mut list) = (bodies.clone(), collisions.clone());
                mistake(&mut wrong, &mut list);
                let before = format!("{wrong:?}");
                let cold = open(profile).step(&mut wrong.clone(), &list, &parameters);
                let cold = cold.expect_err(name);
                let found = warm.step(&mut wrong, &list, &parameters).expect_err(name);
                assert!(found.is_input(), "{} {order:?} {name}: {found}", profile.name);
                assert_eq!(format!("{found:?}"), format!("{cold:?}"), "{name}");
                assert_eq!(format!("{wrong:?}"), before, "{name}: the bodies are unchanged");
            }
            // The next step is undisturbed.
            let mut state = bodies.clone();
            warm.step(&mut state, &collisions, &parameters).expect("a step");
            assert_eq!(state, expected);
        }
    }
}

/// A caller's container in which one element is wrong at one read, and right at all others.
struct Unsteady<T> {
    list: Vec<T>,
    which: usize,
    wrong: T,
    /// The number of the wrong read; the first is 1.
    at_read: usize,
    reads: AtomicUsize,
}

impl<T: Copy> Unsteady<T> {
    fn read(&self, index: usize) -> T {
        let wrong =
            index == self.which && self.reads.fetch_add(1, Ordering::Relaxed) + 1 == self.at_read;
        if wrong { self.wrong } else { self.list[index] }
    }
}

impl Collisions for Unsteady<Collision> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.read(index)
    }
}

impl Bodies for Unsteady<Body> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn body(&self, index: usize) -> Body {
        self.read(index)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.list.commit(index, pose, velocity);
    }
}

/// Collisions whose `structures` do not agree with their values.
struct WrongStructures {
    all: Vec<Collision>,
    order: Vec<u32>,
}

impl Collisions for WrongStructures {
    fn len(&self) -> usize {
        self.all.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.all[index]
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Ordered { all: &self.all, order: &self.order })
    }
}

/// A place past the end is an empty collision, whatever the value of its index is.
#[test]
fn what_lies_nowhere_has_no_effect() {
    let (bodies, all) = scene();
    let parameters = StepParameters::default().with_order(Order::AsGiven);
    for profile in [&FLOAT, &HALF] {
        let mut expected = bodies.clone();
        open(profile).step(&mut expected, &all, &parameters).expect("a step");
        let mut one_less = all.clone();
        one_less[42].count = 0;
        let mut without = bodies.clone();
        open(profile).step(&mut without, &one_less, &parameters).expect("a step");
        assert_ne!(without, expected);
        let mut order: Vec<u32> = (0..).zip(&all).map(|(at, _)| at).collect();
        order[42] = u32::MAX;
        let mut wrong_structures = WrongStructures { all: all.clone(), order };
        let mut state = bodies.clone();
        open(profile).step(&mut state, &wrong_structures, &parameters).expect("a step");
        assert_eq!(state, without);

        // If their number differs, the driver reads them one by one.
        let fewer = wrong_structures.order.len() - 1;
        for count in [fewer, fewer + 2] {
            wrong_structures.order.resize(count, 0);
            let mut state = bodies.clone();
            open(profile).step(&mut state, &wrong_structures, &parameters).expect("a step");
            assert_eq!(state, expected, "{count}");
        }
    }
}

/// An element that is wrong only during packing must not be sent, although it is right afterwards.
#[test]
fn what_is_wrong_at_one_look_alone_is_never_sent() {
    let (bodies, collisions) = scene();
    for profile in [&FLOAT, &HALF] {
        // Ordering reads each element once before packing does.
        for (order, at_read) in [(Order::AsGiven, 1), (Order::HazardFree, 2)] {
            let parameters = StepParameters::default().with_order(order);
            let mut board = open(profile);
            let mut expected = bodies.clone();
            board.step(&mut expected, &collisions, &parameters).expect("a step");

            let mut state = bodies.clone();
            let right = collisions[42];
            let mut wrongs =
                vec![Collision { count: 5, ..right }, Collision { body_b: right.body_a, ..right }];
            if order != Order::AsGiven {
                // Empty ones, which the order would have left out. The second one equals the
                // padding that fills a gap in an order.
                wrongs.push(Collision { count: 0, ..right });
                wrongs.push(Collision { count: 0, body_b: right.body_a, ..right });
            }
            for wrong in wrongs {
                let (list, reads) = (collisions.clone(), AtomicUsize::new(0));
                let unsteady = Unsteady { list, which: 42, wrong, at_read, reads };
                let found =
                    board.step(&mut state, &unsteady, &parameters).expect_err("one is wrong");
                assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
                assert_eq!(state, bodies);
            }

            let wrong = Body { shape: 9, ..bodies[42] };
            let (list, reads) = (bodies.clone(), AtomicUsize::new(0));
            let mut unsteady = Unsteady { list, which: 42, wrong, at_read, reads };
            let found = board.step(&mut unsteady, &collisions, &parameters);
            let found = found.expect_err("one is wrong");
            assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
            assert_eq!(unsteady.list, bodies);
            if order == Order::AsGiven {
                // The same where the caller writes its collisions.
                unsteady.reads = AtomicUsize::new(0);
                let found =
                    board.write(&unsteady, 0, &parameters, |_| ()).expect_err("one is wrong");
                assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
            }

            board.step(&mut state, &collisions, &parameters).expect("a step");
            assert_eq!(state, expected);
        }
    }
}
