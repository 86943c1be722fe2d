//! Tests that a step is the same however the caller's thread rounds, flushes or traps, and that the
//! driver restores the thread's environment.
#![cfg(feature = "emulation")]
#![allow(unsafe_code, reason = "Rust does not say what it computes in a foreign environment")]
#![allow(clippy::print_stdout, reason = "a skipped test is reported")]

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common;
use crate::common::bits;
use bitstream_model::interface::profile::{FLOAT, Inertia, PROFILES, Profile};
use bitstream_model::{BoardConfig, EmulatedBoard};
use pgs_support::float_env::foreign::{Environment, environments, under};
use scene::{Scene, SceneOptions};
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, OrderInput, Orderer};
use zynq_pgs::{
    Accelerator, BoardChoice, Bodies, Body, Collision, Collisions, OpenOptions, Pose, Shape,
    StepParameters, StepReport, Velocity, Writer, check,
};

/// Number of bodies and collisions from which several threads share the work.
const SEVERAL: usize = 2_041;

/// Runs `work` in every environment of a caller, and checks that each environment stays as it was.
///
/// `work` computes nothing itself: it calls the driver, moves words, and compares them.
fn everywhere(mut work: impl FnMut(&str)) {
    if environments().next().is_none() {
        println!("skipped: nothing is known of this processor's floating-point environment");
    }
    for (name, environment) in environments() {
        let work = || {
            work(name);
            assert_eq!(Environment::current(), environment, "{name}: not restored");
        };
        // SAFETY: as above.
        unsafe { under(environment, work) };
    }
}

/// A pile, and the inertia of its shapes.
struct Pile {
    shapes: Vec<Shape>,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
}

impl Pile {
    /// A pile in which the environment decides bits. All of its numbers have many digits, so that
    /// all are rounded. Some bodies hang in the air with subnormal velocities across gravity, and
    /// lose the velocities where subnormals are flushed.
    fn new(inertia: Inertia) -> Self {
        let grid = "14x11x14".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        let off = |index: u32| {
            f32::from(u16::try_from(index * 7919 % 101).expect("below 101")) / 10_007.0
        };
        for (index, body) in (0..).zip(scene.bodies_mut()).skip(1) {
            let off = off(index);
            body.pose.position[0] += off;
            body.pose.position[2] -= 1.7 * off;
            body.velocity = Velocity { linear: [off, -1.0 - off, 3.3 * off], angular: [off; 3] };
        }
        let collisions = scene.detect().to_vec();
        let (mut shapes, mut bodies) = (scene.shapes().to_vec(), scene.bodies().to_vec());
        if inertia == Inertia::World {
            shapes[1] = Shape::cuboid(0.7, [0.9, 1.0, 1.1]).expect("a box");
        }
        // The bodies turn after all collisions are found: rounding counts here, and not how the
        // pile looks.
        for (index, body) in (0..).zip(&mut bodies).skip(1) {
            body.pose.orientation = [0.1 + off(index), -off(index), 0.03, 0.95];
        }
        let slow = Velocity { linear: [1e-39, 0.0, 0.0], angular: [0.0, -3e-40, 0.0] };
        bodies.extend((0..40_u8).map(|k| {
            let position = [3.1 * f32::from(k), 40.0, -3.0];
            Body { velocity: slow, ..common::at_rest(position, 1) }
        }));
        assert!(bodies.len() >= SEVERAL && collisions.len() >= SEVERAL);
        Self { shapes, bodies, collisions }
    }

    /// Opens a board with `threads` threads, for the board and for the driver.
    fn open(&self, config: BoardConfig, threads: usize) -> (EmulatedBoard, Accelerator) {
        common::open_with(BoardConfig { threads, ..config }, Some(threads), &self.shapes)
    }

    /// The outcome of one step.
    fn step(&self, config: BoardConfig, threads: usize) -> Outcome {
        let (board, mut accelerator) = self.open(config, threads);
        let mut bodies = self.bodies.clone();
        let report = accelerator.step(&mut bodies, &self.collisions, &StepParameters::default());
        drop(accelerator);
        assert_eq!(board.violations(), []);
        Outcome::of(&bodies, &report.expect("a good step"))
    }
}

/// The bits of the bodies, and the board's counters.
#[derive(PartialEq)]
struct Outcome {
    bits: Vec<u32>,
    cycles: u64,
    impulses: Option<u64>,
}

impl Outcome {
    fn of(bodies: &[Body], report: &StepReport) -> Self {
        let impulses = report.impulse_sum.map(f64::to_bits);
        Self { bits: bits(bodies), cycles: report.cycles.total, impulses }
    }
}

fn same_everywhere(config: BoardConfig) {
    let pile = Pile::new(config.inertia);
    let expected = pile.step(config, 1);
    assert!(expected.bits != bits(&pile.bodies), "they move");
    for threads in [1, 2] {
        let same = |name: &str| {
            // A message with all words would be too long to read.
            let found = pile.step(config, threads) == expected;
            assert!(found, "{:?}, {name}, {threads} threads", config.variant());
        };
        same("as it is");
        everywhere(same);
    }
}

fn of(profile: &'static Profile, inertia: Inertia) -> BoardConfig {
    BoardConfig { profile, inertia, ..BoardConfig::default() }
}

#[test]
fn a_step_is_the_same_in_every_environment_on_every_profile() {
    PROFILES.iter().for_each(|profile| same_everywhere(of(profile, Inertia::Isotropic)));
}

#[test]
fn a_step_with_world_inertia_is_the_same_in_every_environment() {
    same_everywhere(of(&FLOAT, Inertia::World));
}

/// Runs four steps: one, a second that is prepared while the first is on the board, one that is
/// written while the second is there, and one that is written while the board is idle. The narrow
/// phase runs in the environment `outside`.
fn overlapped(pile: &Pile, threads: usize, outside: Environment) -> [Outcome; 4] {
    let (board, mut accelerator) = pile.open(of(&FLOAT, Inertia::World), threads);
    let Pile { bodies, collisions, .. } = pile;
    // A written step comes as given, and so does the prepared one, so that both are one step.
    let (parameters, part) = (common::ordered(Order::AsGiven), &collisions[..SEVERAL]);
    let left = |what| assert_eq!(Environment::current(), outside, "after {what}");
    let narrow_phase = |records: &mut Writer<'_>| {
        left("entering the narrow phase");
        part.iter().for_each(|collision| records.push(collision));
        left("pushing");
    };
    let mut after = [0; 4].map(|_| bodies.clone());
    let [first, second, third, fourth] = &mut after;

    let mut flight = accelerator.submit(bodies, collisions, &parameters).expect("a start");
    left("submit");
    let next = flight.prepare(bodies, part, &parameters).expect("there is memory");
    left("prepare");
    let (ended, started) = flight.wait_and_start(first, &next);
    left("wait_and_start");
    let mut reports = vec![ended.expect("a good step")];
    let mut flight = started.expect("a start");
    let next = flight.write(bodies, SEVERAL, &parameters, narrow_phase).expect("there is room");
    left("write in flight");
    let (ended, started) = flight.wait_and_start(second, &next);
    reports.push(ended.expect("a good step"));
    reports.push(started.expect("a start").wait(third).expect("a good step"));
    left("wait");
    let next = accelerator.write(bodies, SEVERAL, &parameters, narrow_phase);
    left("write");
    let flight = accelerator.start(&next.expect("there is room")).expect("a start");
    left("start");
    drop(flight);
    left("drop");
    let next = accelerator.write(bodies, SEVERAL, &parameters, narrow_phase);
    let flight = accelerator.start(&next.expect("there is room"));
    reports.push(flight.expect("a start").wait(fourth).expect("a good step"));
    drop(accelerator);
    left("closing");
    assert_eq!(board.violations(), []);
    let mut reports = reports.iter();
    after.map(|bodies| Outcome::of(&bodies, reports.next().expect("one each")))
}

#[test]
fn overlapped_and_written_steps_are_the_same_in_every_environment() {
    let pile = Pile::new(Inertia::World);
    let expected = overlapped(&pile, 1, Environment::current());
    assert!(expected[1] != expected[0] && expected[1].bits == expected[3].bits);
    for threads in [1, 2] {
        everywhere(|name| {
            let found = overlapped(&pile, threads, Environment::current());
            assert!(found == expected, "{name}, {threads} threads");
        });
    }
}

/// Bodies that count the calls in another environment than the standard one, and may panic.
struct Watched<'a> {
    pile: &'a Pile,
    after: Vec<Body>,
    foreign: AtomicUsize,
    panics: bool,
}

impl Watched<'_> {
    fn asked(&self) {
        let foreign = !Environment::current().is_standard();
        self.foreign.fetch_add(foreign.into(), Ordering::Relaxed);
    }
}

impl Bodies for Watched<'_> {
    fn len(&self) -> usize {
        self.asked();
        self.pile.bodies.len()
    }

    fn body(&self, index: usize) -> Body {
        self.asked();
        if self.panics && index == SEVERAL {
            resume_unwind(Box::new(()));
        }
        self.pile.bodies[index]
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.asked();
        self.after.commit(index, pose, velocity);
    }
}

/// Collisions that count into the same counter.
struct Found<'a>(&'a Watched<'a>);

impl Collisions for Found<'_> {
    fn len(&self) -> usize {
        self.0.asked();
        self.0.pile.collisions.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.0.asked();
        self.0.pile.collisions[index]
    }
}

#[test]
fn callers_are_asked_in_the_standard_environment_and_have_their_own_after_a_panic() {
    let pile = Pile::new(Inertia::Isotropic);
    for threads in [1, 2] {
        let expected = pile.step(of(&FLOAT, Inertia::Isotropic), threads);
        everywhere(|name| {
            let outside = Environment::current();
            let (_, mut accelerator) = pile.open(of(&FLOAT, Inertia::Isotropic), threads);
            let watched = |panics| {
                let (after, foreign) = (pile.bodies.clone(), AtomicUsize::new(0));
                Watched { pile: &pile, after, foreign, panics }
            };
            let (mut bodies, mut torn, asked) = (watched(false), watched(true), watched(false));
            let panic = catch_unwind(AssertUnwindSafe(|| {
                accelerator.step(&mut torn, &Found(&asked), &StepParameters::default()).map(drop)
            }));
            assert!(panic.is_err(), "{name}");
            assert_eq!(Environment::current(), outside, "{name}: not restored after a panic");
            let report = accelerator.step(&mut bodies, &Found(&asked), &StepParameters::default());
            assert!(Outcome::of(&bodies.after, &report.expect("a good step")) == expected);
            for all in [&torn, &bodies, &asked] {
                assert_eq!(all.foreign.load(Ordering::Relaxed), 0, "{name}");
            }
        });
    }
}

#[test]
fn what_else_computes_is_the_same_in_every_environment() {
    let shapes = || {
        let shapes = [
            Shape::cuboid(0.7, [0.3, 1.1, 2.3]),
            Shape::sphere(3.0, 0.7),
            Shape::capsule(0.3, 1.7, 0.9),
            // Their inverses are beyond f32.
            Shape::sphere(1e-39, 1.0),
            Shape::cuboid(f32::MAX, [1.0; 3]),
        ];
        shapes.map(|shape| {
            let words = |shape: Shape| (shape.inverse_mass, shape.inverse_inertia);
            shape.ok().map(words).map(|(m, [x, y, z])| [m, x, y, z].map(f32::to_bits))
        })
    };
    let bodies: Vec<Body> = (0..40_u32).map(|k| common::at_rest([0.0; 3], k % 2)).collect();
    let pairs = |k: u32| [[k, (k + 1) % 40], [k, (k + 7) % 40]];
    let pairs: Vec<[u32; 2]> = (0..40).flat_map(pairs).collect();
    // The body moves, if only just.
    let heavy = Shape::isotropic(1e-39, 0.0);
    let order = || {
        let (mut buffers, mut orderer) = (InputBuffers::new(), Orderer::new());
        let none: &[Collision] = &[];
        let moving = buffers.gather(&bodies, none, &[heavy, Shape::STATIC]).moving.to_vec();
        let all = vec![true; bodies.len()];
        let input = OrderInput { pairs: &pairs, moving: &all };
        let window = IssueWindow::new(3, 1).expect("a window");
        let schedule = orderer.order(&input, Order::HazardFree, window).expect("an order");
        (schedule.iter().collect::<Vec<_>>(), moving)
    };
    let checked = || {
        let board = EmulatedBoard::new(BoardConfig::default()).expect("a board");
        let board = BoardChoice::Emulated(board.cpu_port());
        check(OpenOptions { board, ..OpenOptions::default() }).expect("a board that answers")
    };
    let expected = (shapes(), order(), checked());
    assert!(expected.0[2].is_some() && expected.0[3].is_none() && expected.2.passed());
    assert_eq!(expected.1.1.iter().filter(|moves| **moves).count(), 20);
    everywhere(|name| assert!((shapes(), order(), checked()) == expected, "{name}"));
}
