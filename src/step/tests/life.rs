//! Tests dropped and forgotten steps, callers that panic, and boards side by side. The board goes
//! dead at the driver's first mistake.

use std::cell::Cell;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use bitstream_model::{
    Bandwidth, BoardConfig, Direction, EmulatedBoard, Fault as Injected, FaultKind,
};
use pgs_interface::control;
use pgs_interface::profile::{FLOAT, Profile};

use super::tampered::{CONTROL_BLOCK, MEMORY, Tampered};
use super::{SHAPES, bits, open, options, scene, undisturbed};
use crate::error::Aftermath;
use crate::order::Order;
use crate::{
    Accelerator, Bodies, Body, Cancellation, Collision, Collisions, Error, Fault, InputError, Pose,
    StepParameters, Velocity,
};

const CUBES: u32 = 20;

/// A board with the bits of `float`, on one stream.
pub(crate) fn naive() -> BoardConfig {
    let profile = Profile::by_name("naive").expect("a profile");
    BoardConfig { profile, ..BoardConfig::default() }
}

/// Checks that two whole steps give the bits of undisturbed ones, and that the driver made no
/// mistake.
pub(crate) fn assert_works(board: &EmulatedBoard, accelerator: &mut Accelerator, after: &str) {
    for _ in 0..2 {
        let (mut bodies, collisions) = scene(CUBES);
        accelerator
            .step(&mut bodies, &collisions, &StepParameters::default())
            .unwrap_or_else(|error| panic!("{after}: {error}: {:?}", board.violations()));
        assert_eq!(bits(&bodies), undisturbed(CUBES), "{after}");
    }
    assert_eq!(board.violations(), [], "{after}");
}

/// Starts a step and lets the board work on it for `clocks` clocks.
fn start<'a>(
    board: &EmulatedBoard,
    accelerator: &'a mut Accelerator,
    clocks: u64,
) -> crate::step::InFlight<'a> {
    let (bodies, collisions) = scene(CUBES);
    let flight = accelerator
        .submit(&bodies, &collisions, &StepParameters::default())
        .expect("a step that starts");
    let clock = u64::from(FLOAT.clock_khz);
    board.cpu_port().pause(Duration::from_nanos(clocks * 1_000_000 / clock));
    flight
}

/// From the first beats to long after the end: a step of this scene takes 3,827 clocks.
const MOMENTS: [u64; 9] = [0, 50, 200, 500, 1_000, 2_000, 3_000, 3_816, 200_000];

#[test]
fn the_two_halves_are_a_step() {
    let (board, mut accelerator) = open(BoardConfig::default());
    for clocks in MOMENTS {
        let (mut bodies, collisions) = scene(CUBES);
        let flight = accelerator
            .submit(&bodies, &collisions, &StepParameters::default())
            .expect("a step that starts");
        // The caller's own work meanwhile.
        drop(collisions);
        board.cpu_port().pause(Duration::from_nanos(clocks * 4));
        let report = flight.wait(&mut bodies).expect("a good step");
        assert_eq!((report.bodies, report.doorbells), (u64::from(CUBES) + 1, 9));
        assert_eq!(report.cycles.total, 3_827, "as the moments assume");
        assert_eq!(bits(&bodies), undisturbed(CUBES), "{clocks} clocks");
    }
    assert_eq!(board.violations(), []);
}

#[test]
fn a_step_dropped_at_any_moment_is_stopped_and_the_next_one_works() {
    let (board, mut accelerator) = open(BoardConfig::default());
    for clocks in MOMENTS {
        let before = board.counts().cycles;
        drop(start(&board, &mut accelerator, clocks));
        let took = board.counts().cycles - before - clocks;
        // The time of four resets and their polls, not the step's deadline: a tenth of a
        // millisecond.
        assert!(took < u64::from(FLOAT.clock_khz) / 10, "{took} clocks to stop at {clocks}");
        assert_works(&board, &mut accelerator, &format!("dropped after {clocks} clocks"));
    }
}

#[test]
fn a_step_dropped_while_a_channel_stalls_is_stopped_too() {
    for core in 0..4 {
        for direction in [Direction::Mm2s, Direction::S2mm] {
            let (board, mut accelerator) = open(BoardConfig::default());
            board.inject(Injected::new(FaultKind::Stall).on(core, direction));
            drop(start(&board, &mut accelerator, 9_000));
            assert_works(&board, &mut accelerator, &format!("stall of {core} {direction:?}"));
        }
    }
}

#[test]
fn a_panic_between_the_halves_stops_the_step() {
    let (board, mut accelerator) = open(BoardConfig::default());
    for clocks in MOMENTS {
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let _flight = start(&board, &mut accelerator, clocks);
            panic!("the caller's own code");
        }));
        panicked.expect_err("it panics");
        assert_works(&board, &mut accelerator, &format!("a panic after {clocks} clocks"));
    }
}

#[test]
fn a_step_that_was_forgotten_is_stopped_by_the_next_call() {
    for clocks in MOMENTS {
        let after = format!("forgotten for {clocks} clocks");
        let (board, mut accelerator) = open(BoardConfig::default());
        let _forgotten = ManuallyDrop::new(start(&board, &mut accelerator, clocks));
        assert_works(&board, &mut accelerator, &after);

        // The shapes are loaded into a board that has been stopped.
        let _forgotten = ManuallyDrop::new(start(&board, &mut accelerator, clocks));
        accelerator.set_shapes(&SHAPES).expect("shapes that fit");
        assert_works(&board, &mut accelerator, &after);

        // The driver makes no further call. The next opening of the board stops it.
        let _forgotten = ManuallyDrop::new(start(&board, &mut accelerator, clocks));
        drop(accelerator);
        let moved = board.counts().beats_read + board.counts().beats_written;
        board.cpu_port().pause(Duration::from_millis(1));
        assert_eq!(board.counts().beats_read + board.counts().beats_written, moved, "{after}");
        let mut accelerator = Accelerator::open(options(&board)).expect("opened again");
        accelerator.set_shapes(&SHAPES).expect("shapes that fit");
        assert_works(&board, &mut accelerator, &after);
    }
}

#[test]
fn results_are_not_put_into_other_bodies() {
    let (board, mut accelerator) = open(BoardConfig::default());
    for other in [CUBES - 1, CUBES + 1] {
        let flight = start(&board, &mut accelerator, 100);
        let (mut bodies, _) = scene(other);
        let before = bits(&bodies);
        let error = flight.wait(&mut bodies).expect_err("more or fewer bodies");
        let (found, expected) = (other as usize + 1, CUBES as usize + 1);
        assert!(
            matches!(error, Error::Input(InputError::OtherBodies { found: f, expected: e })
                if (f, e) == (found, expected)),
            "{error}"
        );
        assert_eq!(bits(&bodies), before);
        assert_works(&board, &mut accelerator, "other bodies");
    }
}

/// A caller's container that panics at the last call that it allows.
#[derive(Debug)]
pub(crate) struct Panicking<'a, T> {
    pub(crate) inner: T,
    pub(crate) left: &'a AtomicU32,
    pub(crate) commits: u32,
}

impl<T> Panicking<'_, T> {
    fn ask(&self) {
        let allowed = self
            .left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        assert!(allowed.is_ok(), "a panic in the caller's container");
    }
}

impl Bodies for Panicking<'_, Vec<Body>> {
    fn len(&self) -> usize {
        self.ask();
        self.inner.len()
    }

    fn body(&self, index: usize) -> Body {
        self.ask();
        self.inner[index]
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.ask();
        self.commits += 1;
        self.inner.commit(index, pose, velocity);
    }
}

impl Collisions for Panicking<'_, Vec<Collision>> {
    fn len(&self) -> usize {
        self.ask();
        self.inner.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.ask();
        self.inner[index]
    }
}

/// Runs a small scene whose containers panic at call number `call`. Returns whether they panicked.
fn panics_at(accelerator: &mut Accelerator, call: u32, order: Option<Order>) -> bool {
    let left = AtomicU32::new(call);
    let (bodies, collisions) = scene(3);
    let before = bits(&bodies);
    let mut bodies = Panicking { inner: bodies, left: &left, commits: 0 };
    let collisions = Panicking { inner: collisions, left: &left, commits: 0 };
    let committed = Cell::new(false);
    let parameters = StepParameters { order, ..StepParameters::default() };
    let stepped = catch_unwind(AssertUnwindSafe(|| {
        accelerator.step(&mut bodies, &collisions, &parameters).map(|_| committed.set(true))
    }));
    match stepped {
        Ok(stepped) => stepped.expect("nothing else is wrong"),
        Err(_) if bodies.commits > 0 => {}
        Err(_) => assert_eq!(bits(&bodies.inner), before, "call {call}"),
    }
    !committed.get()
}

#[test]
fn a_panic_in_any_call_of_the_callers_containers_leaves_a_working_accelerator() {
    let cases = [
        (BoardConfig::default(), None),
        (BoardConfig::default(), Some(Order::HazardFree)),
        (naive(), None),
    ];
    for (config, order) in cases {
        let (board, mut accelerator) = open(config);
        let (mut expected, collisions) = scene(CUBES);
        let parameters = StepParameters { order, ..StepParameters::default() };
        accelerator.step(&mut expected, &collisions, &parameters).expect("an undisturbed step");
        let mut call = 0;
        while panics_at(&mut accelerator, call, order) {
            let (mut bodies, collisions) = scene(CUBES);
            accelerator
                .step(&mut bodies, &collisions, &parameters)
                .unwrap_or_else(|error| panic!("call {call}: {error}"));
            assert_eq!(bits(&bodies), bits(&expected), "call {call}");
            call += 1;
        }
        // Packing reads each of the four bodies and three collisions, and asks for their numbers.
        assert!(call > 14, "{call} calls");
        assert_eq!(board.violations(), []);
    }
}

#[test]
fn whoever_opens_a_board_that_runs_stops_it_before_memory_is_touched() {
    let (board, mut accelerator) = open(BoardConfig::default());
    // As after a SIGKILL: the step is not waited for, and its buffers are not taken back.
    let _left = ManuallyDrop::new(start(&board, &mut accelerator, 1_000));
    assert!(board.is_running());
    let (tampered, mut accelerator) = Tampered::on(&board);
    assert!(!board.is_running(), "opening stops it");
    assert_works(&board, &mut accelerator, "left by another");

    let wires = tampered.wires();
    let first = |wanted| wires.writes.iter().position(|write| *write == wanted);
    let memory = first((MEMORY, 0)).expect("a step allocates");
    // DMACR of the four cores, then RESET of the control block.
    let resets = [(0, 0), (1, 0), (2, 0), (3, 0), (CONTROL_BLOCK, control::RESET.offset)];
    let resets = resets.map(|reset| first(reset).expect("every part is reset"));
    assert!(resets.is_sorted() && resets[4] < memory, "{resets:?}, memory {memory}");
}

#[test]
fn a_step_is_cancelled_while_the_board_stalls_and_changes_nothing() {
    let (board, tampered, mut accelerator) = Tampered::open();
    let cancellation = tampered.wires().cancellation.clone();
    accelerator.set_cancellation(cancellation.clone());
    let hour = Duration::from_secs(3600);
    let parameters = StepParameters { deadline: Some(hour), ..StepParameters::default() };
    for waits in [1, 2, 30] {
        board.inject(Injected::new(FaultKind::Stall).on(3, Direction::S2mm));
        tampered.wires().cancel_at = waits;
        let before = board.cpu_port().now();
        let (mut bodies, collisions) = scene(CUBES);
        let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("stalls");
        assert_eq!(bits(&bodies), bits(&scene(CUBES).0));
        let Error::Step { fault, aftermath, .. } = &error else { panic!("{error}") };
        assert!(matches!(**fault, Fault::Cancelled), "{fault}");
        assert_eq!(*aftermath, Aftermath::Ready);
        // The cancellation takes effect at the next poll, which covers an hour.
        let took = board.cpu_port().now() - before;
        assert!(took < Duration::from_millis(u64::from(waits) * 10 + 5), "{took:?}");
        assert!(!board.is_running());

        // It also holds for the next step, which does not even start.
        let counts = board.counts();
        let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("still");
        let Error::Step { fault, aftermath, .. } = &error else { panic!("{error}") };
        assert!(matches!(**fault, Fault::Cancelled), "{fault}");
        assert_eq!(*aftermath, Aftermath::Untouched);
        assert_eq!(board.counts(), counts);
        cancellation.clear();
        assert_works(&board, &mut accelerator, "cancelled");
    }
}

#[test]
fn a_step_that_may_be_cancelled_and_is_not_is_the_same_step() {
    // A slow pipeline, whose step takes more than one poll.
    let config = BoardConfig {
        profile: Profile::by_name("naive").expect("a profile"),
        bandwidth: Bandwidth::BytesPerSecond(100_000_000),
        ..BoardConfig::default()
    };
    let reports = [false, true].map(|may_be_cancelled| {
        let (board, mut accelerator) = open(config);
        let cancellation = Cancellation::new();
        if may_be_cancelled {
            accelerator.set_cancellation(cancellation.clone());
        }
        let (mut bodies, collisions) = scene(2_000);
        let report = accelerator
            .step(&mut bodies, &collisions, &StepParameters::default())
            .expect("a good step");
        assert!(!cancellation.is_cancelled());
        assert_eq!(board.violations(), []);
        let accesses = report.register_reads + report.register_writes;
        (report.cycles, (report.cycles.work, report.interrupts, accesses, bits(&bodies)))
    });
    let polls = u64::from(config.profile.clock_khz) * 10;
    assert!(reports[0].0.total > 2 * polls, "{} cycles", reports[0].0.total);
    assert!(reports[0].1 == reports[1].1);
    // The emulated board checks its starving streams at the end of a wait, too, which costs a few
    // clocks.
    let differ = reports[0].0.total.abs_diff(reports[1].0.total);
    assert!(differ < 100, "{:?} and {:?}", reports[0].0, reports[1].0);
}

/// Runs steps of two scenes of this accelerator's own size. Returns the bits after each.
fn steps(cubes: u32, accelerator: &mut Accelerator) -> Vec<Vec<u32>> {
    let (mut bodies, collisions) = scene(cubes);
    let step = |_| {
        accelerator
            .step(&mut bodies, &collisions, &StepParameters::default())
            .expect("a good step");
        bits(&bodies)
    };
    (0..5).map(step).collect()
}

#[test]
fn two_boards_in_one_process_do_not_know_of_each_other() {
    let alone = [7, 30].map(|cubes| steps(cubes, &mut open(BoardConfig::default()).1));

    // The two boards alternate, each with a step in flight while the other works.
    let (left_board, mut left) = open(BoardConfig::default());
    let (right_board, mut right) = open(naive());
    let right_alone = steps(30, &mut open(naive()).1);
    let (mut left_bodies, left_collisions) = scene(7);
    let (mut right_bodies, right_collisions) = scene(30);
    let parameters = StepParameters::default();
    for step in 0..5 {
        let first = left.submit(&left_bodies, &left_collisions, &parameters).expect("starts");
        let second = right.submit(&right_bodies, &right_collisions, &parameters).expect("starts");
        first.wait(&mut left_bodies).expect("a good step");
        second.wait(&mut right_bodies).expect("a good step");
        assert_eq!(bits(&left_bodies), alone[0][step]);
        assert_eq!(bits(&right_bodies), right_alone[step]);
    }
    assert_eq!((left_board.violations(), right_board.violations()), (vec![], vec![]));

    // In two threads.
    let threads = [7, 30].map(|cubes| {
        let (board, mut accelerator) = open(BoardConfig::default());
        std::thread::spawn(move || (steps(cubes, &mut accelerator), board.violations()))
    });
    for (thread, alone) in threads.into_iter().zip(alone) {
        let (stepped, violations) = thread.join().expect("no panic");
        assert_eq!(stepped, alone);
        assert_eq!(violations, []);
    }
}
