//! Tests that a collision without contact points has no effect and keeps its place, and that a step
//! without bodies is a step.
#![cfg(feature = "emulation")]

use crate::common::{at_rest, bits, open_with, ordered, standing};
use bitstream_model::BoardConfig;
use scene::{Scene, SceneOptions};
use zynq_pgs::interface::profile::{FLOAT, HALF, NAIVE, PROFILES, Profile};
use zynq_pgs::order::Order;
use zynq_pgs::scene::{CollisionArrays, Structures};
use zynq_pgs::{
    Accelerator, Body, Collision, Collisions, Contact, Error, InputError, Shape, StepParameters,
    StepReport,
};

/// The orders, and `None` for the board's own choice.
const ORDERS: [Option<Order>; 3] = [None, Some(Order::AsGiven), Some(Order::HazardFree)];

/// A pile that falls.
struct Pile {
    shapes: Vec<Shape>,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
}

impl Pile {
    /// A pile with one more cube, which touches nothing and spins.
    fn new(grid: &str) -> Self {
        let grid = grid.parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        let collisions = scene.detect().to_vec();
        let (shapes, mut bodies) = (scene.shapes().to_vec(), scene.bodies().to_vec());
        let moves = |body: &&mut Body| !shapes[body.shape as usize].is_static();
        for (body, speed) in bodies.iter_mut().filter(moves).zip((0_u8..9).cycle()) {
            body.velocity.linear = [0.05 * f32::from(speed), -0.1, 0.0];
        }
        let mut alone = *bodies.last().expect("some cubes");
        alone.pose.position = [-30.0, 5.0, 3.0];
        alone.velocity.angular = [1.0, -2.0, 0.5];
        bodies.push(alone);
        Self { shapes, bodies, collisions }
    }

    /// The index of the cube that touches nothing.
    fn alone(&self) -> u32 {
        u32::try_from(self.bodies.len() - 1).expect("few")
    }

    fn open(&self, profile: &'static Profile, threads: usize) -> Accelerator {
        let config = BoardConfig { profile, queue: Some(0), ..BoardConfig::default() };
        open_with(config, Some(threads), &self.shapes).1
    }

    /// The collisions, with empty ones in front, between and behind.
    fn with_empty(&self) -> Vec<Collision> {
        let nan = Contact { point: [f32::NAN; 3], distance: f32::NAN };
        let missing = u32::try_from(self.bodies.len()).expect("few");
        let nothing = |body_a, body_b, normal| Collision {
            body_a,
            body_b,
            normal,
            count: 0,
            contacts: [nan; 4],
        };
        let alone = self.alone();
        let sound = Collision { count: 0, ..standing([0, alone], -30.0, 5.0, -0.5) };
        let empty = [
            sound,
            Collision { body_a: alone, body_b: 1, ..sound },
            nothing(alone, alone, [f32::INFINITY; 3]),
            nothing(missing, alone, [f32::NAN; 3]),
            nothing(u32::MAX, u32::MAX, [0.0; 3]),
            nothing(0, 0, [2.0; 3]),
        ];
        let mut empty = empty.into_iter().cycle();
        let mut all: Vec<_> = empty.by_ref().take(3).collect();
        for (at, collision) in self.collisions.iter().enumerate() {
            all.push(*collision);
            let count = if at % 97 == 0 { 5 } else { usize::from(at % 6 == 0) };
            all.extend(empty.by_ref().take(count));
        }
        all
    }
}

/// Takes two steps, which must succeed. Returns the bits of the bodies, and the second report.
fn two_steps<C: Collisions + ?Sized>(
    board: &mut Accelerator,
    bodies: &[Body],
    collisions: &C,
    parameters: &StepParameters,
) -> (Vec<u32>, StepReport) {
    let mut bodies = bodies.to_vec();
    board.step(&mut bodies, collisions, parameters).expect("a first step");
    let report = board.step(&mut bodies, collisions, parameters).expect("a second step");
    (bits(&bodies), report)
}

/// Compares a step with empty collisions and the same step without them.
fn same(pile: &Pile, profile: &'static Profile, order: Option<Order>, threads: usize) {
    let what = format!("{} {order:?}, {threads} threads", profile.name);
    let mut parameters = StepParameters::default();
    parameters.order = order;
    let mut board = pile.open(profile, threads);
    let (expected, without) = two_steps(&mut board, &pile.bodies, &pile.collisions, &parameters);
    let all = pile.with_empty();
    let (found, with) = two_steps(&mut board, &pile.bodies, &all, &parameters);
    assert!(found == expected, "{what}");
    let alone = |all: &[u32]| all[all.len() - 13..].to_vec();
    assert_ne!(alone(&found), bits(&pile.bodies[pile.bodies.len() - 1..]), "{what}: falls");

    let empty = (all.len() - pile.collisions.len()) as u64;
    let sent = |report: &StepReport| (report.order, report.collisions, report.impulse_sum);
    assert_eq!(sent(&with), sent(&without), "{what}");
    let padded = order == Some(Order::AsGiven);
    if padded {
        assert_eq!((with.empty, without.empty), (empty, 0), "{what}");
    } else {
        let cost = |it: &StepReport| (it.empty, it.bytes_to_device, it.cycles, it.hazards);
        assert_eq!(cost(&with), cost(&without), "{what}: they are not sent");
    }

    // Neither containers without structures nor separate arrays make a difference.
    let bodies: Vec<_> = all.iter().map(|it| [it.body_a, it.body_b]).collect();
    let normals: Vec<_> = all.iter().map(|it| it.normal).collect();
    let counts: Vec<_> = all.iter().map(|it| it.count).collect();
    let points = |it: &Contact| [it.point[0], it.point[1], it.point[2], it.distance];
    let contacts: Vec<_> = all.iter().map(|it| it.contacts.each_ref().map(points)).collect();
    let arrays = CollisionArrays {
        bodies: &bodies,
        normals: &normals,
        counts: &counts,
        contacts: &contacts,
    };
    let (found, report) = two_steps(&mut board, &pile.bodies, &arrays, &parameters);
    assert!(found == expected && report.cycles == with.cycles, "{what}: separate arrays");
}

#[test]
fn empty_collisions_have_no_effect_in_any_order_of_any_profile() {
    let pile = Pile::new("5x4x5");
    for profile in PROFILES {
        for order in ORDERS {
            same(&pile, profile, order, 1);
        }
    }
}

#[test]
fn empty_collisions_have_no_effect_where_several_threads_pack() {
    let pile = Pile::new("20x16x20");
    for (profile, order) in [
        (&FLOAT, Some(Order::AsGiven)),
        (&HALF, Some(Order::AsGiven)),
        (&NAIVE, Some(Order::HazardFree)),
        (&FLOAT, Some(Order::HazardFree)),
    ] {
        same(&pile, profile, order, 2);
    }
}

#[test]
fn a_body_of_empty_collisions_alone_is_untouched() {
    let pile = Pile::new("2x2x2");
    let alone = pile.bodies.len() - 1;
    for profile in [&FLOAT, &NAIVE] {
        for order in ORDERS {
            let mut parameters = StepParameters::default();
            (parameters.order, parameters.integrate) = (order, false);
            let mut bodies = pile.bodies.clone();
            let mut board = pile.open(profile, 1);
            board.step(&mut bodies, &pile.with_empty(), &parameters).expect("a step");
            assert_eq!(bits(&bodies[alone..]), bits(&pile.bodies[alone..]), "{order:?}");
            assert_ne!(bits(&bodies[..alone]), bits(&pile.bodies[..alone]), "{order:?}");
        }
    }
}

#[test]
fn a_step_of_empty_collisions_alone_is_one_without_collisions() {
    let mut pile = Pile::new("2x2x2");
    pile.collisions.truncate(1);
    let all = pile.with_empty();
    let empty: Vec<_> = all.into_iter().filter(|collision| collision.count == 0).collect();
    for profile in PROFILES {
        for order in ORDERS {
            let mut parameters = StepParameters::default();
            parameters.order = order;
            let mut board = pile.open(profile, 1);
            let none: &[Collision] = &[];
            let (expected, _) = two_steps(&mut board, &pile.bodies, none, &parameters);
            let (found, report) = two_steps(&mut board, &pile.bodies, &empty, &parameters);
            assert_eq!((found, report.collisions), (expected, 0), "{} {order:?}", profile.name);
        }
    }
}

#[test]
fn an_order_with_empty_collisions_is_verified() {
    let pile = Pile::new("3x3x3");
    let mut board = pile.open(&FLOAT, 1);
    let mut parameters = ordered(Order::HazardFree);
    parameters.verify_order = true;
    let (expected, without) = two_steps(&mut board, &pile.bodies, &pile.collisions, &parameters);
    let (found, with) = two_steps(&mut board, &pile.bodies, &pile.with_empty(), &parameters);
    assert!(found == expected && with.verified == without.verified);
    // As given, padding parts the uses of a body.
    let gap = Collision { count: 0, ..standing([0, 1], 0.0, 0.0, 0.0) };
    let list: Vec<_> = [1, 2]
        .into_iter()
        .flat_map(|body| std::iter::once(standing([0, body], 0.0, 0.0, -0.01)).chain([gap; 400]))
        .chain([standing([1, 2], 0.0, 0.0, -0.01)])
        .collect();
    let mut parameters = ordered(Order::AsGiven);
    parameters.verify_order = true;
    let mut bodies = vec![at_rest([0.0; 3], 0), at_rest([0.0; 3], 1), at_rest([0.0; 3], 1)];
    let mut board =
        open_with(BoardConfig::default(), None, &[Shape::STATIC, Shape::isotropic(1.0, 1.5)]).1;
    let report = board.step(&mut bodies, &list, &parameters).expect("no hazards");
    assert_eq!((report.collisions, report.empty, report.hazards), (3, 800, 0));
}

#[test]
fn an_error_behind_empty_collisions_has_the_callers_index() {
    let pile = Pile::new("3x3x3");
    for profile in [&FLOAT, &HALF] {
        for order in [None, Some(Order::HazardFree)] {
            let mut parameters = StepParameters::default();
            parameters.order = order;
            let mut board = pile.open(profile, 1);
            let good = pile.with_empty();
            board.step(&mut pile.bodies.clone(), &good, &parameters).expect("a step");
            let wrong: Vec<_> = (0..good.len()).filter(|at| good[*at].count > 0).collect();
            for at in [wrong[0], wrong[wrong.len() / 2], wrong[wrong.len() - 1]] {
                for body_b in [good[at].body_a, u32::MAX] {
                    let mut list = good.clone();
                    list[at].body_b = body_b;
                    let error = board.step(&mut pile.bodies.clone(), &list, &parameters);
                    let Err(Error::Input(error)) = error else { panic!("{error:?}") };
                    assert!(
                        matches!(
                            error,
                            InputError::SelfCollision { collision, .. }
                                | InputError::BodyIndex { collision, .. }
                                if collision == at
                        ),
                        "{error}"
                    );
                }
            }
        }
    }
}

/// Collisions in memory, in an order that has places without a collision.
struct Gaps<'a> {
    all: &'a [Collision],
    order: &'a [u32],
}

impl Collisions for Gaps<'_> {
    fn len(&self) -> usize {
        self.order.len()
    }

    fn collision(&self, index: usize) -> Collision {
        let place = self.order[index] as usize;
        let empty = Collision { count: 0, ..self.all[0] };
        self.all.get(place).copied().unwrap_or(empty)
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Ordered { all: self.all, order: self.order })
    }
}

#[test]
fn a_place_past_the_end_of_the_structures_is_an_empty_collision() {
    let pile = Pile::new("3x3x3");
    let all = pile.with_empty();
    let mut order: Vec<u32> = (0..).zip(&all).map(|(at, _)| at).collect();
    let past: Vec<u32> = vec![u32::MAX, u32::try_from(all.len()).expect("few")];
    order.splice(10..10, past);
    let gaps = Gaps { all: &all, order: &order };
    for profile in [&FLOAT, &HALF] {
        for order in ORDERS {
            let mut parameters = StepParameters::default();
            parameters.order = order;
            let mut board = pile.open(profile, 1);
            let (expected, _) = two_steps(&mut board, &pile.bodies, &pile.collisions, &parameters);
            let (found, _) = two_steps(&mut board, &pile.bodies, &gaps, &parameters);
            assert!(found == expected, "{} {order:?}", profile.name);
        }
    }
}

#[test]
fn empty_collisions_are_written_too() {
    let pile = Pile::new("4x4x4");
    let all = pile.with_empty();
    let parameters = ordered(Order::AsGiven);
    for profile in PROFILES {
        let mut board = pile.open(profile, 1);
        let mut expected = pile.bodies.clone();
        board.step(&mut expected, &pile.collisions, &parameters).expect("a step");
        let mut bodies = pile.bodies.clone();
        let written = board.write(&bodies, all.len(), &parameters, |records| {
            for (index, collision) in all.iter().enumerate() {
                assert_eq!(records.len(), index);
                records.push(collision);
            }
        });
        let written = written.expect("nothing is wrong");
        let report = board.start(&written).expect("a start").wait(&mut bodies).expect("a step");
        assert_eq!(bits(&bodies), bits(&expected), "{}", profile.name);
        let given = pile.collisions.len();
        let counts = (report.collisions, report.empty);
        assert_eq!(counts, (given as u64, (all.len() - given) as u64));
    }
}

/// Everything that a step without bodies counts is 0.
fn is_zero(report: &StepReport) -> bool {
    let counts = [
        report.bodies,
        report.collisions,
        report.empty,
        report.cycles.total,
        report.cycles.work + report.cycles.stalls + report.cycles.waits,
        report.bytes_to_device,
        report.bytes_from_device,
        report.hazards,
        report.register_reads,
        report.register_writes,
        report.doorbells,
        report.interrupts,
        report.descriptors,
    ];
    counts == [0; 13] && report.impulse_sum == Some(0.0)
}

#[test]
fn a_step_without_bodies_touches_no_register() {
    let pile = Pile::new("2x2x2");
    let empty: Vec<_> = pile.with_empty().into_iter().filter(|it| it.count == 0).collect();
    for profile in PROFILES {
        // Without shapes, and before and after another step.
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let (emulated, mut board) = open_with(config, None, &[]);
        for round in 0..2 {
            for order in ORDERS {
                let mut parameters = StepParameters::default();
                parameters.order = order;
                let before = emulated.counts();
                let mut none: Vec<Body> = Vec::new();
                for collisions in [&[][..], &empty[..], &pile.collisions[..]] {
                    let stepped = board.step(&mut none, collisions, &parameters);
                    if collisions.iter().all(|collision| collision.count == 0) {
                        let report = stepped.expect("a step");
                        assert!(is_zero(&report), "{}: {report:?}", profile.name);
                    } else {
                        let found = stepped.expect_err("there is no body 0");
                        let is_index = matches!(
                            found,
                            Error::Input(InputError::BodyIndex { collision: 0, bodies: 0, .. })
                        );
                        assert!(is_index, "{}: {found:?}", profile.name);
                    }
                }
                let after = emulated.counts();
                assert_eq!(
                    (after.register_reads, after.register_writes),
                    (before.register_reads, before.register_writes)
                );
            }
            if round == 0 {
                board.set_shapes(&pile.shapes).expect("shapes");
                let mut bodies = pile.bodies.clone();
                board.step(&mut bodies, &pile.collisions, &StepParameters::default()).expect("one");
            }
        }
        assert_eq!(emulated.violations(), []);
    }
}

#[test]
fn a_step_without_bodies_is_submitted_prepared_and_written() {
    let pile = Pile::new("2x2x2");
    let mut none: Vec<Body> = Vec::new();
    let nothing: &[Collision] = &[];
    let parameters = StepParameters::default();
    for profile in [&FLOAT, &HALF] {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let (emulated, mut board) = open_with(config, None, &pile.shapes);
        let mut expected = pile.bodies.clone();
        board.step(&mut expected, &pile.collisions, &parameters).expect("a step");

        // Nothing, then bodies, then nothing.
        let mut flight = board.submit(&none, nothing, &parameters).expect("a start");
        let next = flight.prepare(&pile.bodies, &pile.collisions, &parameters).expect("memory");
        let (report, started) = flight.wait_and_start(&mut none, &next);
        assert!(is_zero(&report.expect("a step")));
        let mut flight = started.expect("a start");
        let next = flight.prepare(&none, nothing, &parameters).expect("nothing to prepare");
        let mut bodies = pile.bodies.clone();
        let (report, started) = flight.wait_and_start(&mut bodies, &next);
        assert_eq!(report.expect("a step").bodies, pile.bodies.len() as u64);
        assert_eq!(bits(&bodies), bits(&expected));
        assert!(is_zero(&started.expect("a start").wait(&mut none).expect("a step")));
        // It starts again, and a flight may be dropped.
        drop(board.start(&next).expect("a start"));
        let mut one = pile.bodies.clone();
        let wrong = board.submit(&none, nothing, &parameters).expect("a start").wait(&mut one);
        assert!(matches!(wrong, Err(Error::Input(InputError::OtherBodies { .. }))));

        let as_given = ordered(Order::AsGiven);
        let empty = pile.with_empty()[0];
        let written = board.write(&none, 70, &as_given, |records| {
            (0..70).for_each(|_| records.push(&empty));
            assert_eq!((records.len(), records.is_refused()), (70, false));
        });
        let written = written.expect("nothing is wrong");
        let report = board.start(&written).expect("a start").wait(&mut none);
        assert!(is_zero(&report.expect("a step")));
        let refused = board.write(&none, 70, &as_given, |records| {
            records.push(&empty);
            records.push(&pile.collisions[0]);
        });
        let index = matches!(
            refused,
            Err(Error::Input(InputError::BodyIndex { collision: 1, bodies: 0, .. }))
        );
        assert!(index, "{refused:?}");
        let mut bodies = pile.bodies.clone();
        board.step(&mut bodies, &pile.collisions, &parameters).expect("a step");
        assert_eq!(bits(&bodies), bits(&expected));
        drop(board);
        assert_eq!(emulated.violations(), []);
    }
}
