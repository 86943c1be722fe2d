//! Tests that a step is the same for every number of threads that write its records and read its
//! results: on every profile, as given and in order, and for prepared steps, too.
#![cfg(feature = "emulation")]

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use crate::common::{bits, open_with, ordered};
use bitstream_model::interface::profile::{FLOAT, HALF, NAIVE};
use bitstream_model::{BoardConfig, EmulatedBoard};
use scene::{Scene, SceneOptions};
use zynq_pgs::order::Order;
use zynq_pgs::{Accelerator, Body, Collision, Collisions, Shape, StepReport};

/// Number of bodies and collisions from which several threads share the work.
const SEVERAL: usize = 3 * 2_048;

/// A standing pile, and the inertia of its shapes.
struct Pile {
    shapes: Vec<Shape>,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
}

impl Pile {
    fn standing() -> Self {
        let grid = "20x16x20".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        let collisions = scene.detect().to_vec();
        let (shapes, mut bodies) = (scene.shapes().to_vec(), scene.bodies().to_vec());
        let mut moving = (0_u8..7).cycle().zip((0_u8..5).cycle());
        for body in bodies.iter_mut().filter(|body| !shapes[body.shape as usize].is_static()) {
            let (x, y) = moving.next().expect("without an end");
            body.velocity.linear = [0.05 * f32::from(x), -0.1 * f32::from(y), 0.0];
        }
        assert!(bodies.len() >= SEVERAL && collisions.len() >= SEVERAL);
        Self { shapes, bodies, collisions }
    }

    fn open(&self, config: BoardConfig, threads: Option<usize>) -> (EmulatedBoard, Accelerator) {
        open_with(config, threads, &self.shapes)
    }

    /// Runs two steps, the second prepared during the first. Returns the outcome of each.
    fn steps(&self, config: BoardConfig, order: Order, threads: Option<usize>) -> [Outcome; 2] {
        let (board, mut accelerator) = self.open(config, threads);
        let parameters = ordered(order);
        let shared = threads.is_some_and(|threads| threads > 1);
        let [all, some] = [&self.collisions[..], &self.collisions[..SEVERAL]]
            .map(|list| Shared::new(list, shared));
        let mut flight = accelerator.submit(&self.bodies, &all, &parameters).expect("a start");
        let next = flight.prepare(&self.bodies, &some, &parameters);
        let next = next.expect("there is memory");
        let mut bodies = self.bodies.clone();
        let (ended, started) = flight.wait_and_start(&mut bodies, &next);
        let first = Outcome::of(&bodies, &ended.expect("a good step"));
        let mut bodies = self.bodies.clone();
        let ended = started.expect("a start").wait(&mut bodies).expect("a good step");
        assert_eq!(board.violations(), []);
        [first, Outcome::of(&bodies, &ended)]
    }
}

/// Collisions that the caller's thread cannot pack alone, if they are shared.
struct Shared<'a> {
    list: &'a [Collision],
    caller: ThreadId,
    /// Whether another thread has packed some.
    helped: AtomicBool,
    until: Instant,
}

impl<'a> Shared<'a> {
    fn new(list: &'a [Collision], shared: bool) -> Self {
        let until = Instant::now() + Duration::from_secs(60);
        Self { list, caller: thread::current().id(), helped: AtomicBool::new(!shared), until }
    }
}

impl Collisions for Shared<'_> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.list[index]
    }

    /// Only packing calls this method.
    fn prefetch(&self, _: usize) {
        if thread::current().id() != self.caller {
            self.helped.store(true, Ordering::Relaxed);
        }
        while !self.helped.load(Ordering::Relaxed) {
            assert!(Instant::now() < self.until, "no second thread packs");
            thread::yield_now();
        }
    }
}

/// The bits of the bodies, and the board's counters.
#[derive(PartialEq)]
struct Outcome {
    bits: Vec<u32>,
    cycles: u64,
    hazards: u64,
    impulses: Option<u64>,
}

impl Outcome {
    fn of(bodies: &[Body], report: &StepReport) -> Self {
        Self {
            bits: bits(bodies),
            cycles: report.cycles.total,
            hazards: report.hazards,
            impulses: report.impulse_sum.map(f64::to_bits),
        }
    }
}

#[test]
fn steps_are_the_same_with_any_number_of_threads() {
    let pile = Pile::standing();
    let (as_given, in_order) = (Order::AsGiven, Order::HazardFree);
    let profiles = [&NAIVE, &FLOAT, &HALF];
    for (profile, order) in profiles.into_iter().flat_map(|it| [(it, as_given), (it, in_order)]) {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let expected = pile.steps(config, order, Some(1));
        assert!(expected[0].bits != bits(&pile.bodies), "they move");
        assert!(expected[0] != expected[1], "with other collisions it is another step");
        for threads in [Some(2), Some(3), None] {
            let found = pile.steps(config, order, threads);
            // A message with all words would be too long to read.
            assert!(found == expected, "{} {order:?}: {threads:?}", profile.name);
        }
    }
}

/// Every number of threads reports the same error, the first one, and leaves the bodies unchanged.
#[test]
fn what_is_refused_is_refused_in_the_same_words_with_any_number_of_threads() {
    let pile = Pile::standing();
    for at in [0, SEVERAL / 2, SEVERAL - 1] {
        let mut collisions = pile.collisions.clone();
        collisions[at].normal = [0.0, 0.5, 0.0];
        collisions[SEVERAL - 1].contacts[0].distance = f32::NAN;
        let texts = [1, 2, 3].map(|threads| {
            let (board, mut accelerator) = pile.open(BoardConfig::default(), Some(threads));
            let mut bodies = pile.bodies.clone();
            let error = accelerator.step(&mut bodies, &collisions, &ordered(Order::AsGiven));
            let error = error.expect_err("no normal has that length");
            assert!(error.is_input() && bits(&bodies) == bits(&pile.bodies), "{error}");
            assert_eq!(board.violations(), []);
            error.to_string()
        });
        assert!(texts[0].starts_with(&format!("collision {at}:")), "{texts:?}");
        assert!(texts.iter().all(|text| *text == texts[0]), "{texts:?}");
    }
}

/// Collisions, among them one that panics when it is read.
struct Torn<'a> {
    list: &'a [Collision],
    at: usize,
}

impl Collisions for Torn<'_> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn collision(&self, index: usize) -> Collision {
        if index == self.at {
            resume_unwind(Box::new(index));
        }
        self.list[index]
    }
}

/// The caller gets the panic of any thread, and has a working accelerator afterwards.
#[test]
fn a_panic_while_records_are_read_is_the_callers() {
    let pile = Pile::standing();
    let (board, mut accelerator) = pile.open(BoardConfig::default(), Some(3));
    let parameters = ordered(Order::AsGiven);
    let mut expected = pile.bodies.clone();
    accelerator.step(&mut expected, &pile.collisions, &parameters).expect("a good step");
    for at in (0..SEVERAL).step_by(700) {
        let mut bodies = pile.bodies.clone();
        let torn = Torn { list: &pile.collisions, at };
        let stepped = catch_unwind(AssertUnwindSafe(|| {
            accelerator.step(&mut bodies, &torn, &parameters).map(drop)
        }));
        assert_eq!(stepped.expect_err("a panic").downcast_ref(), Some(&at));
        assert!(bits(&bodies) == bits(&pile.bodies), "untouched");
        accelerator.step(&mut bodies, &pile.collisions, &parameters).expect("a good step");
        assert!(bits(&bodies) == bits(&expected), "{at}");
    }
    assert_eq!(board.violations(), []);
}
