//! Tests that a step allocates nothing once a step of the same size has run.
//!
//! The emulated board allocates nothing either: the count covers everything that happens during the
//! call.
#![cfg(feature = "emulation")]
#![allow(unsafe_code, reason = "an allocator that counts is an unsafe trait")]

#[path = "common/counting_allocator.rs"]
mod counting_allocator;

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, ThreadId};

use bitstream_model::interface::profile::Profile;
use bitstream_model::{BoardConfig, EmulatedBoard, Hazards};
use counting_allocator::CountingAllocator;
use zynq_pgs::order::Order;
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, Collisions, Contact, OpenOptions, Pose, Shape,
    StepParameters, Velocity,
};

thread_local! {
    static COUNTED: Cell<u64> = const { Cell::new(0) };
    /// Whether this thread has read a [`Watching`] container.
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}

/// Number of allocator calls of all threads that have read a [`Watching`] container, from then on.
static OF_WATCHED: AtomicU64 = AtomicU64::new(0);

fn count() {
    // A thread that is ending has no counter any more.
    let _ = COUNTED.try_with(|counted| counted.set(counted.get() + 1));
    if WATCHED.try_with(Cell::get) == Ok(true) {
        OF_WATCHED.fetch_add(1, Ordering::Relaxed);
    }
}

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator(count);

/// A row of cubes on the ground, each also in contact with the next.
fn scene() -> (Vec<Body>, Vec<Collision>) {
    let body = |y, shape| Body {
        pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape,
    };
    let mut bodies = vec![body(-1.0, 0)];
    let mut collisions = Vec::new();
    for cube in 1..200 {
        bodies.push(body(0.99, 1));
        let contact = Contact { point: [0.5, -0.01, 0.25], distance: -0.01 };
        collisions.push(Collision {
            body_a: cube - 1,
            body_b: cube,
            normal: [0.0, -1.0, 0.0],
            count: 1,
            contacts: [contact; 4],
        });
    }
    (bodies, collisions)
}

fn open(config: BoardConfig) -> Accelerator {
    open_for(config, None)
}

fn open_for(config: BoardConfig, pack_threads: Option<usize>) -> Accelerator {
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let board = BoardChoice::Emulated(board.cpu_port());
    let options = OpenOptions { board, pack_threads, ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("the emulated board");
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("they fit");
    accelerator
}

/// Runs ten steps. Returns the allocations of each.
fn allocations(config: BoardConfig, order: Option<Order>) -> Vec<u64> {
    allocations_with(config, StepParameters::default().with_order(order))
}

fn allocations_with(config: BoardConfig, parameters: StepParameters) -> Vec<u64> {
    let mut accelerator = open(config);
    let (mut bodies, collisions) = scene();
    let mut counted = Vec::with_capacity(10);
    for step in 0..10 {
        // The number of collisions changes, as it does in a moving scene.
        let of_step = &collisions[step % 3..];
        let before = COUNTED.get();
        accelerator.step(&mut bodies, of_step, &parameters).expect("nothing disturbs it");
        counted.push(COUNTED.get() - before);
    }
    counted
}

/// Runs ten steps, each prepared while the one before it is on the board. Returns the allocations
/// of each.
fn allocations_prepared(config: BoardConfig, order: Option<Order>) -> Vec<u64> {
    let mut accelerator = open(config);
    let (mut bodies, collisions) = scene();
    let parameters = StepParameters::default().with_order(order);
    let mut counted = Vec::with_capacity(10);
    let mut flight =
        accelerator.submit(&bodies, &collisions, &parameters).expect("nothing disturbs it");
    for step in 0..10 {
        let of_step = &collisions[step % 3..];
        let before = COUNTED.get();
        let next = flight.prepare(&bodies, of_step, &parameters).expect("there is memory");
        let (ended, started) = flight.wait_and_start(&mut bodies, &next);
        ended.expect("nothing disturbs it");
        flight = started.expect("nothing disturbs it");
        counted.push(COUNTED.get() - before);
    }
    counted
}

/// Runs ten steps whose collisions are written one after the other. Returns the allocations of
/// each.
fn allocations_written(config: BoardConfig) -> Vec<u64> {
    let mut accelerator = open(config);
    let (mut bodies, collisions) = scene();
    let parameters = StepParameters::default();
    let mut counted = Vec::with_capacity(10);
    for step in 0..10 {
        let before = COUNTED.get();
        let written = accelerator.write(&bodies, collisions.len(), &parameters, |records| {
            collisions[step % 3..].iter().for_each(|collision| records.push(collision));
        });
        let flight = written.and_then(|step| accelerator.start(&step)?.wait(&mut bodies));
        flight.expect("nothing disturbs it");
        counted.push(COUNTED.get() - before);
    }
    counted
}

fn profile(name: &str) -> BoardConfig {
    let profile = Profile::by_name(name).expect("a profile");
    BoardConfig { profile, ..BoardConfig::default() }
}

#[test]
fn steps_two_to_ten_allocate_nothing() {
    let counted = allocations(BoardConfig::default(), None);
    assert!(counted[0] > 0, "the first step makes buffers: does the allocator count?");
    assert_eq!(counted[1..], [0; 9], "{counted:?}");
}

/// The number of empty entries depends on the collisions: each of the three sizes comes once before
/// the test forbids allocations.
#[test]
fn an_order_allocates_nothing_once_it_has_seen_a_step_of_that_size() {
    let unchecked = BoardConfig { hazards: Hazards::Unchecked, ..BoardConfig::default() };
    for (config, order) in [(BoardConfig::default(), Some(Order::HazardFree)), (unchecked, None)] {
        let counted = allocations(config, order);
        assert_eq!(counted[3..], [0; 7], "{:?} {order:?}: {counted:?}", config.hazards);
    }
}

#[test]
fn steps_with_impulses_allocate_nothing_either() {
    let out = StepParameters::default().with_impulses_out(true);
    for name in ["float", "naive"] {
        for parameters in [out, out.with_warm_start(true)] {
            let counted = allocations_with(profile(name), parameters);
            assert_eq!(counted[3..], [0; 7], "{name}: {counted:?}");
        }
    }
}

/// Each of the two banks has seen each of the three sizes after six steps.
#[test]
fn prepared_steps_allocate_nothing_once_both_banks_have_seen_a_step_of_that_size() {
    let cases = [
        (BoardConfig::default(), None),
        (BoardConfig::default(), Some(Order::HazardFree)),
        (profile("half"), None),
    ];
    for (config, order) in cases {
        let counted = allocations_prepared(config, order);
        assert!(counted[0] > 0, "the second bank is made: does the allocator count?");
        assert_eq!(counted[6..], [0; 4], "{} {order:?}: {counted:?}", config.profile.name);
    }
}

#[test]
fn steps_of_other_profiles_allocate_nothing_either() {
    for name in ["half", "naive"] {
        let counted = allocations(profile(name), None);
        assert_eq!(counted[3..], [0; 7], "{name}: {counted:?}");
    }
}

#[test]
fn written_steps_allocate_nothing() {
    for name in ["float", "half", "naive"] {
        let counted = allocations_written(profile(name));
        assert!(counted[0] > 0, "the first step makes buffers: does the allocator count?");
        assert_eq!(counted[1..], [0; 9], "{name}: {counted:?}");
    }
}

/// A repeated list of collisions that marks and counts the threads that read it.
struct Watching<'a> {
    list: &'a [Collision],
    count: usize,
    readers: &'a AtomicU64,
    caller: ThreadId,
    /// Whether a thread other than the caller's read a collision.
    helped: &'a AtomicBool,
}

impl Collisions for Watching<'_> {
    fn len(&self) -> usize {
        self.count
    }

    fn collision(&self, index: usize) -> Collision {
        if !WATCHED.replace(true) {
            self.readers.fetch_add(1, Ordering::Relaxed);
        }
        if thread::current().id() != self.caller {
            self.helped.store(true, Ordering::Relaxed);
        }
        self.list[index % self.list.len()]
    }
}

/// The count covers the caller's thread and the threads that help it to write records.
#[test]
fn steps_that_several_threads_pack_allocate_nothing_on_any_of_them() {
    // The system decides which thread comes in time. The number of attempts is bounded for a system
    // without a second thread.
    const ATTEMPTS_MAX: usize = 10_000;
    let mut accelerator = open_for(BoardConfig::default(), Some(2));
    let (mut bodies, list) = scene();
    let (readers, helped) = (AtomicU64::new(0), AtomicBool::new(false));
    let (caller, parameters) = (thread::current().id(), StepParameters::default());
    let mut step = |count| {
        let before = OF_WATCHED.load(Ordering::Relaxed);
        let of_step = Watching { list: &list, count, readers: &readers, caller, helped: &helped };
        accelerator.step(&mut bodies, &of_step, &parameters).expect("nothing disturbs it");
        OF_WATCHED.load(Ordering::Relaxed) - before
    };
    let steps = (0..ATTEMPTS_MAX).find(|_| {
        step(9000);
        readers.load(Ordering::Relaxed) == 2
    });
    assert!(steps.is_some(), "no second thread packs");
    // The steps in which another thread helped.
    let sizes = [9000, 8000, 9000, 7000, 6500].into_iter().cycle().take(ATTEMPTS_MAX);
    let counted = sizes.map(|count| (step(count), helped.swap(false, Ordering::Relaxed)));
    let counted: Vec<u64> = counted.filter(|(_, helped)| *helped).map(|it| it.0).take(6).collect();
    assert_eq!(counted, [0; 6]);
    // The counter works: larger buffers are allocated.
    assert!(step(90_000) > 0, "larger buffers are made: does the allocator count?");
}
