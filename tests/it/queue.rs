//! Tests a step through the board's issue queue: it is the step in the order of issue, to the bit and
//! to the cycle, and its impulses come back in the caller's order.
#![cfg(feature = "emulation")]

use std::collections::VecDeque;

use crate::common::{bits, open_with, ordered};
use bitstream_model::{Bandwidth, BoardConfig};
use scene::{Scene, SceneOptions};
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Orderer};
use zynq_pgs::report::OrderChoice;
use zynq_pgs::{
    Accelerator, Body, Collision, Impulses, Shape, StepParameters, StepReport, WarmCollisions,
};

/// Collisions in the queue.
const DEPTH: usize = 64;
/// Issue slots of the longer window of `float`: 324 cycles, one collision every 2.
const WINDOW: usize = 162;

fn board(queue: usize) -> BoardConfig {
    let queue = u32::try_from(queue).ok();
    // Hazards are the only cause of waiting.
    BoardConfig { queue, bandwidth: Bandwidth::Unlimited, ..BoardConfig::default() }
}

/// The order in which a queue issues a list, and the slots in which it issues nothing.
///
/// Written from the interface specification, hazards, and from nothing else.
fn issued(pairs: &[[u32; 2]], moving: &[bool]) -> (Vec<usize>, u64) {
    let mut stream = 0..pairs.len();
    let mut queue: VecDeque<usize> = stream.by_ref().take(DEPTH).collect();
    let mut used = vec![None::<usize>; moving.len()];
    let (mut order, mut idle, mut passed, mut slot) = (Vec::new(), 0, 0, 0);
    let moves = |at: usize| pairs[at].into_iter().filter(|body| moving[*body as usize]);
    while let Some(oldest) = queue.front().copied() {
        let free = |at: usize| {
            moves(at).all(|body| used[body as usize].is_none_or(|last| slot - last >= WINDOW))
                && (at == oldest
                    || passed < 4 * WINDOW
                    || moves(at).all(|body| moves(oldest).all(|other| body != other)))
        };
        let place = queue.iter().position(|at| free(*at));
        passed += 1;
        if let Some(at) = place.and_then(|place| queue.remove(place)) {
            moves(at).for_each(|body| used[body as usize] = Some(slot));
            order.push(at);
            queue.extend(stream.next());
            if at == oldest {
                passed = 0;
            }
        } else {
            idle += 1;
        }
        slot += 1;
    }
    (order, idle)
}

/// Bodies, collisions and shapes of a pile that has fallen for some steps.
struct Pile {
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    shapes: Vec<Shape>,
}

impl Pile {
    fn new(grid: &str) -> Self {
        let grid = grid.parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a small scene");
        let collisions = scene.detect().to_vec();
        let (mut bodies, shapes) = (scene.bodies().to_vec(), scene.shapes().to_vec());
        for (body, speed) in bodies.iter_mut().skip(1).zip((0_u8..7).cycle()) {
            body.velocity.linear = [0.02 * f32::from(speed), -0.3, 0.0];
        }
        Self { bodies, collisions, shapes }
    }

    /// The place in the caller's list of each collision, in the order of issue; idle slots.
    fn issued(&self, order: Order) -> (Vec<usize>, u64) {
        let mut buffers = InputBuffers::new();
        let input = buffers.gather(&self.bodies, &self.collisions, &self.shapes);
        let window = IssueWindow::new(162, 1).expect("a window");
        let mut orderer = Orderer::new();
        let sent = orderer.order(&input, order, window).expect("an order");
        let sent: Vec<usize> = sent.iter().flatten().map(|at| at as usize).collect();
        let pairs: Vec<_> = sent.iter().map(|at| input.pairs[*at]).collect();
        let (order, idle) = issued(&pairs, input.moving);
        (order.into_iter().map(|place| sent[place]).collect(), idle)
    }

    fn open(&self, queue: usize) -> Accelerator {
        open_with(board(queue), None, &self.shapes).1
    }

    /// Three steps, each with the impulses of the one before; in the order of `places`.
    fn three_steps(
        &self,
        accelerator: &mut Accelerator,
        parameters: &StepParameters,
        places: &[usize],
    ) -> (Vec<u32>, Vec<Impulses>, StepReport) {
        let mut bodies = self.bodies.clone();
        let collisions: Vec<Collision> = places.iter().map(|at| self.collisions[*at]).collect();
        let mut impulses = vec![Impulses::ZERO; collisions.len()];
        let mut report = None;
        for _ in 0..3 {
            let warm = WarmCollisions { collisions: &collisions, impulses: &impulses };
            report = Some(accelerator.step(&mut bodies, &warm, parameters).expect("a step"));
            impulses = accelerator.impulses().iter().map(|of| of.scaled(0.85)).collect();
        }
        let mut given = vec![Impulses::ZERO; impulses.len()];
        places.iter().zip(&impulses).for_each(|(at, of)| given[*at] = *of);
        (bits(&bodies), given, report.expect("three steps"))
    }

    fn places(&self) -> Vec<usize> {
        (0..self.collisions.len()).collect()
    }
}

fn words(impulses: &[Impulses]) -> &[u32] {
    bytemuck::cast_slice(impulses)
}

#[test]
fn a_step_through_the_queue_is_the_step_in_the_order_of_issue() {
    let pile = Pile::new("7x6x7");
    let default = StepParameters::default().with_impulses_out(true);
    for parameters in [
        default,
        default.with_warm_start(true),
        default.with_warm_start(true).with_contact_iterations(0),
        default.with_friction_iterations(0),
    ] {
        let (bodies, impulses, report) =
            pile.three_steps(&mut pile.open(DEPTH), &parameters, &pile.places());
        assert_eq!((report.order, report.order_choice), (Order::Interleaved, OrderChoice::Queue));
        assert!(report.queued);

        let (issued, idle) = pile.issued(Order::Interleaved);
        let as_given = parameters.with_order(Order::AsGiven);
        let (expected, of_issue, in_order) =
            pile.three_steps(&mut pile.open(0), &as_given, &issued);
        assert!(bodies == expected, "other bits");
        assert!(words(&impulses) == words(&of_issue), "impulses of others");
        // Friction has no impulse where nothing presses.
        let none = words(&impulses).iter().all(|word| *word == 0);
        assert_eq!((in_order.queued, none), (false, parameters.contact_iterations == 0));

        let passes = u64::from(report.passes);
        assert_eq!(report.cycles.stalls, 2 * idle * passes);
        let filling = 2 * DEPTH as u64 * passes;
        assert_eq!(report.cycles.work, in_order.cycles.work + filling);
        // A beat of numbers for four collisions a kind.
        let kinds = u64::from(parameters.contact_iterations > 0)
            + u64::from(parameters.friction_iterations > 0);
        let numbers = kinds * (pile.collisions.len() as u64).div_ceil(4);
        assert_eq!(report.bytes_from_device, in_order.bytes_from_device + 16 * numbers);
        assert_eq!(report.bytes_to_device, in_order.bytes_to_device);
    }
}

#[test]
fn the_order_as_given_passes_by_the_queue() {
    let pile = Pile::new("5x5x5");
    let parameters = ordered(Order::AsGiven).with_impulses_out(true).with_warm_start(true);
    let steps = |queue| pile.three_steps(&mut pile.open(queue), &parameters, &pile.places());
    let (with, without) = (steps(DEPTH), steps(0));
    assert!(with.0 == without.0 && words(&with.1) == words(&without.1));
    let figures = |it: &StepReport| (it.order, it.queued, it.cycles, it.bytes_from_device);
    assert_eq!(figures(&with.2), figures(&without.2));
}

/// Of the orders without hazards a queue makes nothing else.
#[test]
fn a_verified_step_goes_through_the_queue_as_it_was_proved() {
    let pile = Pile::new("5x4x5");
    let parameters = StepParameters::default().with_impulses_out(true).with_verify_order(true);
    let steps = |queue| pile.three_steps(&mut pile.open(queue), &parameters, &pile.places());
    let (with, without) = (steps(DEPTH), steps(0));
    assert!(with.0 == without.0 && words(&with.1) == words(&without.1));
    assert_eq!((with.2.order, with.2.queued, with.2.verified), (Order::HazardFree, true, true));
    assert_eq!(with.2.cycles.stalls, 0);
}

#[test]
fn written_collisions_go_through_the_queue_unless_an_order_is_named() {
    let pile = Pile::new("5x5x5");
    let mut accelerator = pile.open(DEPTH);
    let mut written = |parameters: StepParameters| {
        let parameters = parameters.with_impulses_out(true);
        let mut bodies = pile.bodies.clone();
        let step = accelerator.write(&bodies, pile.collisions.len() + 9, &parameters, |records| {
            pile.collisions.iter().for_each(|collision| records.push(collision));
        });
        let step = step.expect("it fits");
        let report = accelerator.start(&step).expect("it starts").wait(&mut bodies);
        let report = report.expect("a step");
        (bits(&bodies), accelerator.impulses().to_vec(), report)
    };
    let (issued, idle) = pile.issued(Order::AsGiven);
    let mut plain = pile.open(0);
    let mut by_hand = |places: &[usize]| {
        let collisions: Vec<Collision> = places.iter().map(|at| pile.collisions[*at]).collect();
        let mut bodies = pile.bodies.clone();
        let parameters = ordered(Order::AsGiven).with_impulses_out(true);
        plain.step(&mut bodies, &collisions, &parameters).expect("a step");
        let mut given = vec![Impulses::ZERO; places.len()];
        places.iter().zip(plain.impulses()).for_each(|(at, of)| given[*at] = *of);
        (bits(&bodies), given)
    };
    for (parameters, places, stalls) in [
        (StepParameters::default(), issued, Some(2 * 8 * idle)),
        (ordered(Order::AsGiven), pile.places(), None),
    ] {
        let (bodies, impulses, report) = written(parameters);
        let (expected, of_place) = by_hand(&places);
        assert!(bodies == expected && words(&impulses) == words(&of_place));
        assert_eq!((report.order, report.queued), (Order::AsGiven, stalls.is_some()));
        assert!(stalls.is_none_or(|stalls| report.cycles.stalls == stalls));
    }
}
