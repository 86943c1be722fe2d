//! Tests that packing the next step overlaps the one on the board: on the board's own clock a step
//! takes the longer of the two times, and hardly more.
//!
//! The emulated board's clock advances with register accesses and with waiting, and stands still
//! while the host computes. The caller's own containers therefore advance it: each body and each
//! collision that is read for packing, and each body that is stored, takes its share of the total
//! time.
#![cfg(feature = "emulation")]

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use crate::common::{bits, open_with, row};
use bitstream_model::{BoardConfig, CpuPort, EmulatedBoard};
use zynq_pgs::{
    Accelerator, Bodies, Body, Collision, Collisions, Pose, Shape, StepParameters, Velocity,
};

/// A world with the host's times to pack it and to store its results, on the board's clock.
#[derive(Debug, Clone)]
struct World {
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    packing: Duration,
    storing: Duration,
    port: CpuPort,
}

/// Number of parts in which the packing time advances.
const PARTS: u32 = 100;

/// The collisions of a world during packing. Reading them advances the clock.
#[derive(Debug)]
struct Packing<'a> {
    world: &'a World,
    left: AtomicU32,
}

/// Takes one part of the remaining ones. Returns whether one remained.
fn take_part(left: &AtomicU32) -> bool {
    left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
}

impl Drop for Packing<'_> {
    fn drop(&mut self) {
        assert_eq!(self.left.load(Ordering::Relaxed), 0, "all of its time has passed");
    }
}

impl Collisions for Packing<'_> {
    fn len(&self) -> usize {
        self.world.collisions.len()
    }

    fn collision(&self, index: usize) -> Collision {
        if index.is_multiple_of(self.len().div_ceil(2 * PARTS as usize)) && take_part(&self.left) {
            self.world.port.pause(self.world.packing / PARTS);
        }
        self.world.collisions[index]
    }
}

impl Bodies for World {
    fn len(&self) -> usize {
        self.bodies.len()
    }

    fn body(&self, index: usize) -> Body {
        self.bodies[index]
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        let piece = self.bodies.len().div_ceil(PARTS as usize);
        if index.is_multiple_of(piece) {
            let pieces = u32::try_from(self.bodies.len().div_ceil(piece)).expect("few");
            self.port.pause(self.storing / pieces);
        }
        self.bodies.commit(index, pose, velocity);
    }
}

impl World {
    /// Cubes that fall on the ground, each touching the next one too.
    fn new(cubes: u16, speed: f32, port: &CpuPort) -> Self {
        let velocity = Velocity { linear: [0.1 * speed, speed, 0.0], angular: [0.0; 3] };
        let (bodies, collisions) = row(cubes, 2.0, |_| velocity);
        let (packing, storing) = Default::default();
        Self { bodies, collisions, packing, storing, port: port.clone() }
    }

    fn packing(&self) -> Packing<'_> {
        Packing { world: self, left: AtomicU32::new(PARTS) }
    }

    /// The bits of its bodies.
    fn bits(&self) -> Vec<u32> {
        bits(&self.bodies)
    }
}

fn open() -> (EmulatedBoard, Accelerator) {
    open_with(BoardConfig::default(), None, &[Shape::STATIC, Shape::isotropic(1.0, 0.4)])
}

/// Steps of each of the two worlds.
const STEPS: u32 = 4;

/// Runs two worlds alternately, one step after the other. Returns the time of a step on the board's
/// clock.
fn one_after_the_other(worlds: &mut [World; 2]) -> Duration {
    let (board, mut accelerator) = open();
    let port = board.cpu_port();
    worlds.iter_mut().for_each(|world| world.port = port.clone());
    let begun = port.now();
    for _ in 0..STEPS {
        for world in &mut *worlds {
            let flight = {
                let (world, parameters) = (&*world, StepParameters::default());
                accelerator.submit(world, &world.packing(), &parameters).expect("a start")
            };
            flight.wait(world).expect("a good step");
        }
    }
    (port.now() - begun) / (2 * STEPS)
}

/// The same with each step packed while the one before it is on the board. Returns the time from
/// the start of the first step to the start of the last.
fn overlapped(worlds: &mut [World; 2]) -> Duration {
    let (board, mut accelerator) = open();
    let port = board.cpu_port();
    worlds.iter_mut().for_each(|world| world.port = port.clone());
    let [left, right] = worlds;
    let parameters = StepParameters::default();
    let mut flight = accelerator.submit(left, &left.packing(), &parameters).expect("a start");
    let begun = port.now();
    let (mut now, mut next) = (left, right);
    for _ in 1..2 * STEPS {
        let prepared = flight.prepare(next, &next.packing(), &parameters).expect("packed");
        let (ended, started) = flight.wait_and_start(now, &prepared);
        ended.expect("a good step");
        flight = started.expect("the next one starts");
        std::mem::swap(&mut now, &mut next);
    }
    let each = (port.now() - begun) / (2 * STEPS - 1);
    flight.wait(now).expect("a good step");
    assert_eq!(board.violations(), []);
    each
}

#[test]
fn a_step_takes_the_longer_of_packing_and_the_board() {
    let (board, mut accelerator) = open();
    let port = board.cpu_port();
    let worlds = [World::new(2_500, -1.0, &port), World::new(2_400, -2.0, &port)];
    let on_board = worlds.each_ref().map(|world| {
        let mut bodies = world.bodies.clone();
        let collisions = &world.collisions;
        let report = accelerator.step(&mut bodies, collisions, &StepParameters::default());
        report.expect("a good step").modelled_time()
    });
    let on_board = on_board.iter().sum::<Duration>() / 2;
    // Packing takes less time than the board, the same time, and more.
    for (times, divisor) in [(1, 3), (1, 1), (5, 2)] {
        let host = on_board * times / divisor;
        let (storing, packing) = (host / 8, host - host / 8);
        let of_this = |world: &World| World { packing, storing, ..world.clone() };
        let mut serial = worlds.each_ref().map(of_this);
        let mut parallel = serial.clone();

        let sum = one_after_the_other(&mut serial);
        assert!(sum >= host + on_board, "{sum:?}: the time of packing passes");
        let each = overlapped(&mut parallel);
        let longer = host.max(on_board);
        assert!(each * 10 <= longer * 11, "{each:?} a step, the longer of the two is {longer:?}");
        assert!(each * 100 >= longer * 99, "{each:?} a step, the longer of the two is {longer:?}");
        assert!(serial[0].bits() == parallel[0].bits() && serial[1].bits() == parallel[1].bits());
    }
}
