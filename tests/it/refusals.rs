//! A step that is refused says the same whether its buffers are there already, so that it is looked
//! at while it is packed, or not, so that it is validated first; and in either order. Afterwards all
//! is as it was.
#![cfg(feature = "emulation")]

use std::sync::atomic::{AtomicUsize, Ordering};

use bitstream_model::{BoardConfig, EmulatedBoard};
use zynq_pgs::interface::profile::{FLOAT, Flow, HALF, MIXED, Profile, WINDOWED, WINDOWED16};
use zynq_pgs::order::Order;
use zynq_pgs::{
    Accelerator, BoardChoice, Bodies, Body, Collision, Collisions, Contact, Error, InputError,
    OpenOptions, Pose, Shape, StepParameters, Structures, Velocity,
};

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];

/// A row of cubes on the ground, each in contact with the next.
fn scene() -> (Vec<Body>, Vec<Collision>) {
    let body = |x, y, shape| Body {
        pose: Pose { position: [x, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape,
    };
    let mut bodies = vec![body(0.0, -1.0, 0)];
    let mut collisions = Vec::new();
    let mut x = 0.0;
    for cube in 1..100 {
        bodies.push(body(x, 0.99, 1));
        let contact = Contact { point: [x - 1.0, 0.5, 0.25], distance: -0.01 };
        let normal = if cube == 1 { [0.0, -1.0, 0.0] } else { [-1.0, 0.0, 0.0] };
        let (body_a, body_b) = (cube - 1, cube);
        collisions.push(Collision { body_a, body_b, normal, count: 2, contacts: [contact; 4] });
        x += 2.0;
    }
    (bodies, collisions)
}

fn open(profile: &'static Profile) -> Accelerator {
    let config = BoardConfig { profile, ..BoardConfig::default() };
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let board = BoardChoice::Emulated(board.cpu_port());
    let options = OpenOptions { board, ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("the emulated board");
    accelerator.set_shapes(&SHAPES).expect("they fit");
    accelerator
}

type Mistake = (&'static str, fn(&mut Vec<Body>, &mut Vec<Collision>));

/// One at a time, and the last two together: bodies are looked at first, the first of them first.
const MISTAKES: [Mistake; 15] = [
    ("position", |bodies, _| bodies[77].pose.position[1] = f32::NAN),
    ("orientation", |bodies, _| bodies[30].pose.orientation = [0.0; 4]),
    ("infinite orientation", |bodies, _| bodies[29].pose.orientation[3] = f32::INFINITY),
    ("linear velocity", |bodies, _| bodies[99].velocity.linear[2] = f32::NEG_INFINITY),
    ("static body", |bodies, _| bodies[0].velocity.angular[0] = 1.0),
    ("shape", |bodies, _| bodies[31].shape = 2),
    ("no body", |_, collisions| collisions[98].body_b = 100),
    ("same body", |_, collisions| collisions[60].body_b = collisions[60].body_a),
    ("count 0", |_, collisions| collisions[59].count = 0),
    ("count 5", |_, collisions| collisions[0].count = 5),
    ("normal", |_, collisions| collisions[29].normal = [0.0, 0.998, 0.0]),
    ("contact", |_, collisions| collisions[30].contacts[1].point[2] = f32::NAN),
    ("both static", |bodies, collisions| {
        bodies[50].shape = 0;
        (collisions[50].body_a, collisions[50].body_b) = (50, 0);
    }),
    ("padding", |_, collisions| {
        (collisions[7].body_a, collisions[7].body_b, collisions[7].count) = (0, 0, 0);
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
    for profile in [&FLOAT, &HALF, &MIXED, &WINDOWED] {
        let orders = [Order::AsGiven, Order::HazardFree];
        for order in orders.into_iter().filter(|order| {
            // Where only live bodies are kept, the order is made in any case.
            profile.name != "windowed" || *order == Order::HazardFree
        }) {
            let mut parameters = StepParameters::default();
            parameters.order = Some(order);
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
                assert_eq!(format!("{wrong:?}"), before, "{name}: the bodies are as they were");
            }
            // Nothing of it is left.
            let mut state = bodies.clone();
            warm.step(&mut state, &collisions, &parameters).expect("a step");
            assert_eq!(state, expected);
        }
    }
}

/// What a caller keeps; one of it is wrong at one look, and right at all others.
struct Unsteady<T> {
    list: Vec<T>,
    which: usize,
    wrong: T,
    /// The first is 1.
    at_look: usize,
    looks: AtomicUsize,
}

impl<T: Copy> Unsteady<T> {
    fn look(&self, index: usize) -> T {
        let wrong =
            index == self.which && self.looks.fetch_add(1, Ordering::Relaxed) + 1 == self.at_look;
        if wrong { self.wrong } else { self.list[index] }
    }
}

impl Collisions for Unsteady<Collision> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.look(index)
    }
}

impl Bodies for Unsteady<Body> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn body(&self, index: usize) -> Body {
        self.look(index)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.list.commit(index, pose, velocity);
    }
}

/// Collisions that are said to lie elsewhere than they do.
struct Nowhere {
    all: Vec<Collision>,
    order: Vec<u32>,
}

impl Collisions for Nowhere {
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

#[test]
fn what_lies_nowhere_is_never_sent() {
    let (bodies, all) = scene();
    let mut parameters = StepParameters::default();
    parameters.order = Some(Order::AsGiven);
    for profile in [&FLOAT, &HALF, &MIXED] {
        let mut expected = bodies.clone();
        open(profile).step(&mut expected, &all, &parameters).expect("a step");
        let mut order: Vec<u32> = (0..).zip(&all).map(|(at, _)| at).collect();
        order[42] = u32::MAX;
        let mut nowhere = Nowhere { all: all.clone(), order };
        let mut state = bodies.clone();
        let found = open(profile).step(&mut state, &nowhere, &parameters);
        let found = found.expect_err("one lies nowhere");
        assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
        assert_eq!(state, bodies);

        // If they are not as many, they are asked for one by one.
        let fewer = nowhere.order.len() - 1;
        for count in [fewer, fewer + 2] {
            nowhere.order.resize(count, 0);
            let mut state = bodies.clone();
            open(profile).step(&mut state, &nowhere, &parameters).expect("a step");
            assert_eq!(state, expected, "{count}");
        }
    }
}

/// What is wrong only while it is packed must not be sent, though nothing is wrong with it later.
#[test]
fn what_is_wrong_at_one_look_alone_is_never_sent() {
    let (bodies, collisions) = scene();
    for profile in [&FLOAT, &HALF, &MIXED, &WINDOWED, &WINDOWED16] {
        // In an order each is looked at once more, before.
        let orders = [(Order::AsGiven, 1), (Order::HazardFree, 2)];
        for (order, at_look) in orders.into_iter().skip(usize::from(profile.flow != Flow::Passes)) {
            let mut parameters = StepParameters::default();
            parameters.order = Some(order);
            let mut board = open(profile);
            let mut expected = bodies.clone();
            board.step(&mut expected, &collisions, &parameters).expect("a step");

            let mut state = bodies.clone();
            let right = collisions[42];
            // The second looks like what fills a gap in an order.
            for body_b in [right.body_b, right.body_a] {
                let wrong = Collision { count: 0, body_b, ..right };
                let (list, looks) = (collisions.clone(), AtomicUsize::new(0));
                let fickle = Unsteady { list, which: 42, wrong, at_look, looks };
                let found = board.step(&mut state, &fickle, &parameters).expect_err("one is wrong");
                assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
                assert_eq!(state, bodies);
            }

            let wrong = Body { shape: 9, ..bodies[42] };
            let (list, looks) = (bodies.clone(), AtomicUsize::new(0));
            let mut fickle = Unsteady { list, which: 42, wrong, at_look, looks };
            // Where live bodies alone are kept they are read once more for their velocities, and once
            // more for their poses.
            let again = if profile.flow == Flow::Passes { 0 } else { 2 };
            for at_look in at_look..=at_look + again {
                (fickle.at_look, fickle.looks) = (at_look, AtomicUsize::new(0));
                let found = board.step(&mut fickle, &collisions, &parameters);
                let found = found.expect_err("one is wrong");
                assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
                assert_eq!(fickle.list, bodies);
            }
            if order == Order::AsGiven {
                // The same where the caller writes its collisions.
                fickle.looks = AtomicUsize::new(0);
                let found = board.write(&fickle, 0, &parameters, |_| ()).expect_err("one is wrong");
                assert!(matches!(found, Error::Input(InputError::Unsteady)), "{found:?}");
            }

            board.step(&mut state, &collisions, &parameters).expect("a step");
            assert_eq!(state, expected);
        }
    }
}
