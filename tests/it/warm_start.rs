//! Compares the warm start with the direct solver, bit for bit, on every board and in
//! every order, and holds its passes, bytes and cycles against the specification.
#![cfg(feature = "emulation")]

use std::sync::atomic::{AtomicU32, Ordering};

use crate::common::direct::{direct_step, direct_step_from};
use crate::common::random_scene::{round_shapes, scene, shapes};
use crate::common::{bits, open_with, ordered};
use bitstream_model::interface::number::{Numbers, Precision};
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, NAIVE};
use bitstream_model::{BoardConfig, EmulatedBoard, FaultPlan, Hazards};
use half::f16;
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Orderer};
use zynq_pgs::{
    Accelerator, Body, Collision, Collisions, Error, Fault, Impulses, InputError, StepParameters,
    WarmCollisions,
};

fn words(impulses: &[Impulses]) -> &[u32] {
    bytemuck::cast_slice(impulses)
}

fn warm(order: Order) -> StepParameters {
    ordered(order).with_warm_start(true).with_impulses_out(true)
}

fn boards() -> Vec<BoardConfig> {
    let mut boards = Vec::new();
    for (fast, threads) in [(false, 1), (true, 1), (true, 2)] {
        let usual = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
        boards.push(BoardConfig { fast, threads, ..usual });
    }
    boards
}

/// A scene with an empty collision.
fn world() -> (Vec<Body>, Vec<Collision>) {
    let (bodies, mut collisions) = scene(5);
    let empty = Collision { count: 0, body_b: u32::MAX, ..collisions[5] };
    collisions.insert(6, empty);
    (bodies, collisions)
}

/// Steps with the impulses of the step before.
fn three_steps(
    accelerator: &mut Accelerator,
    bodies: &mut [Body],
    collisions: &[Collision],
    parameters: &StepParameters,
) -> Vec<Impulses> {
    let mut impulses = vec![Impulses::ZERO; collisions.len()];
    for _ in 0..3 {
        let warm = WarmCollisions { collisions, impulses: &impulses };
        accelerator.step(bodies, &warm, parameters).expect("a step");
        impulses = accelerator.impulses().iter().map(|of| of.scaled(0.85)).collect();
    }
    impulses
}

fn three_direct_steps(
    bodies: &mut [Body],
    collisions: &[Collision],
    parameters: &StepParameters,
) -> Vec<Impulses> {
    let mut impulses = vec![Impulses::ZERO; collisions.len()];
    for _ in 0..3 {
        let given = Some(&impulses[..]);
        let out = direct_step_from(given, bodies, collisions, &shapes(), parameters);
        impulses = out.iter().map(|of| of.scaled(0.85)).collect();
    }
    impulses
}

/// The same, with the collisions of each step in the order that the board gets.
fn three_direct_steps_in(
    order: Order,
    bodies: &mut [Body],
    collisions: &[Collision],
    parameters: &StepParameters,
) -> Vec<Impulses> {
    let (mut buffers, mut orderer) = (InputBuffers::new(), Orderer::new());
    // 324 cycles of the contact pipeline, one collision every 2.
    let window = IssueWindow::new(162, 1).expect("a window");
    let mut impulses = vec![Impulses::ZERO; collisions.len()];
    for _ in 0..3 {
        let input = buffers.gather(bodies, collisions, &shapes());
        let entries = orderer.order(&input, order, window).expect("an order").iter().flatten();
        let sent: Vec<usize> = entries.map(|index| index as usize).collect();
        let in_order: Vec<Collision> = sent.iter().map(|index| collisions[*index]).collect();
        let given: Vec<Impulses> = sent.iter().map(|index| impulses[*index]).collect();
        let out = direct_step_from(Some(&given), bodies, &in_order, &shapes(), parameters);
        for (of, index) in out.iter().zip(&sent) {
            impulses[*index] = of.scaled(0.85);
        }
    }
    impulses
}

#[test]
fn the_impulses_take_the_place_of_the_computed_ones_in_the_first_pass_of_each_kind() {
    let (bodies, collisions) = world();
    for (contact, friction) in [(4, 4), (1, 0), (0, 2), (0, 0)] {
        let iterations = |parameters: StepParameters| {
            parameters.with_contact_iterations(contact).with_friction_iterations(friction)
        };
        let parameters = iterations(warm(Order::AsGiven));
        let mut expected = bodies.clone();
        let impulses = three_direct_steps(&mut expected, &collisions, &parameters);
        for config in boards() {
            let (board, mut accelerator) = open_with(config, None, &shapes());
            let mut found = bodies.clone();
            let out = three_steps(&mut accelerator, &mut found, &collisions, &parameters);
            assert_eq!(bits(&found), bits(&expected), "{contact} + {friction}, {config:?}");
            assert_eq!(words(&out), words(&impulses), "{contact} + {friction}, {config:?}");
            assert_eq!(board.violations(), []);
        }
    }
}

#[test]
fn impulses_follow_their_collisions_through_every_order() {
    let (bodies, collisions) = world();
    for order in [Order::Interleaved, Order::HazardFree] {
        let config =
            BoardConfig { inertia: Inertia::World, queue: Some(0), ..BoardConfig::default() };
        let (_board, mut accelerator) = open_with(config, None, &shapes());
        let parameters = warm(order);
        let mut found = bodies.clone();
        let out = three_steps(&mut accelerator, &mut found, &collisions, &parameters);
        let mut expected = bodies.clone();
        let impulses = three_direct_steps_in(order, &mut expected, &collisions, &parameters);
        assert_eq!(bits(&found), bits(&expected), "{order:?}");
        assert_eq!(words(&out), words(&impulses), "{order:?}");
        assert_eq!(out[6], Impulses::ZERO, "an empty collision has none");
        let unchecked = BoardConfig { hazards: Hazards::Unchecked, ..config };
        if order.is_hazard_free() {
            let (_board, mut accelerator) = open_with(unchecked, None, &shapes());
            let mut same = bodies.clone();
            let also = three_steps(&mut accelerator, &mut same, &collisions, &parameters);
            assert_eq!(bits(&same), bits(&found), "{order:?}");
            assert_eq!(words(&also), words(&out), "{order:?}");
        }
    }
}

#[test]
fn impulses_come_out_of_a_cold_step_too_and_change_nothing() {
    let (bodies, collisions) = world();
    let parameters = ordered(Order::AsGiven);
    let mut expected = bodies.clone();
    direct_step(&mut expected, &collisions, &shapes(), &parameters);
    let mut again = bodies.clone();
    let impulses = direct_step_from(None, &mut again, &collisions, &shapes(), &parameters);
    for config in boards() {
        let (_board, mut accelerator) = open_with(config, None, &shapes());
        let mut found = bodies.clone();
        let cold = accelerator.step(&mut found, &collisions, &parameters).expect("a step");
        assert_eq!(bits(&found), bits(&expected));
        assert!(accelerator.impulses().is_empty(), "nobody asked for them");
        let mut found = bodies.clone();
        let parameters = parameters.with_impulses_out(true);
        let out = accelerator.step(&mut found, &collisions, &parameters).expect("a step");
        assert_eq!(bits(&found), bits(&expected));
        assert_eq!(words(accelerator.impulses()), words(&impulses));
        assert_eq!(out.passes, cold.passes);
        assert_eq!(out.cycles.work, cold.cycles.work, "they leave beside the passes");
        let beats = 2 * collisions.len() as u64;
        assert_eq!(out.bytes_from_device, cold.bytes_from_device + 16 * beats);
    }
}

#[test]
fn a_warm_start_costs_a_pass_of_each_kind() {
    let (bodies, collisions) = scene(5);
    let collisions = &collisions[..219];
    // Cycles of a pass of that number of issues, and beats of an issue. In `half` the slot behind
    // each third issue stays empty.
    type Cycles = fn(u64) -> u64;
    let cases: [(_, Cycles, _); 3] = [
        (&FLOAT, |issues| 2 * issues, 8),
        (&NAIVE, |issues| 32 * issues, 8),
        (&HALF, |issues| 3 * (issues + (issues - 1) / 3), 8),
    ];
    for (profile, cycles, beats) in cases {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let (_board, mut accelerator) = open_with(config, None, &round_shapes());
        let mut step = |parameters: &StepParameters| {
            accelerator.step(&mut bodies.clone(), collisions, parameters).expect("a step")
        };
        let cold = step(&ordered(Order::AsGiven));
        let hot = step(&ordered(Order::AsGiven).with_warm_start(true));
        assert_eq!((cold.passes, hot.passes), (8, 10));
        let issues = (collisions.len() as u64).div_ceil(profile.collisions_per_issue.into());
        let variant = config.variant();
        let fills = u64::from(variant.contact().fill + variant.friction().fill);
        assert_eq!(hot.cycles.work, cold.cycles.work + 2 * cycles(issues) + fills);
        assert_eq!(hot.bytes_to_device, cold.bytes_to_device + 2 * 16 * beats * issues);
    }
}

#[test]
fn a_collision_without_impulses_begins_with_none() {
    let (bodies, collisions) = scene(5);
    let (_board, mut accelerator) = {
        let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
        open_with(config, None, &shapes())
    };
    let mut found = bodies.clone();
    let parameters = ordered(Order::AsGiven).with_warm_start(true);
    accelerator.step(&mut found, &collisions, &parameters).expect("a step");
    let mut expected = bodies;
    direct_step(&mut expected, &collisions, &shapes(), &ordered(Order::AsGiven));
    // An impulse of 0 is added, which may turn a -0 into a 0.
    let zero = |words: Vec<u32>| -> Vec<u32> {
        words.into_iter().map(|word| if word == 1 << 31 { 0 } else { word }).collect()
    };
    assert_eq!(zero(bits(&found)), zero(bits(&expected)));
}

/// The nearest binary16 number.
fn short(value: f32) -> f32 {
    f16::from_f32(value).to_f32()
}

fn short_impulses(of: &Impulses) -> Impulses {
    Impulses { normal: of.normal.map(short), friction: of.friction.map(short) }
}

/// The world in numbers of binary16. Positions are multiples of 1/64 m.
fn short_world() -> (Vec<Body>, Vec<Collision>) {
    let (mut bodies, mut collisions) = world();
    let on_grid = |value: f32| (value * 64.0).round() / 64.0;
    for body in &mut bodies {
        body.pose.position = body.pose.position.map(on_grid);
        body.pose.orientation = body.pose.orientation.map(short);
        body.velocity.linear = body.velocity.linear.map(short);
        body.velocity.angular = body.velocity.angular.map(short);
    }
    for collision in &mut collisions {
        // A third of a sum is rounded, and the rounding of relative points differs from that of
        // absolute ones.
        if collision.count == 3 {
            collision.count = 4;
        }
        collision.normal = collision.normal.map(short);
        for contact in &mut collision.contacts {
            contact.point = contact.point.map(on_grid);
            contact.distance = short(contact.distance);
        }
    }
    (bodies, collisions)
}

/// `float` can compute in binary16 from words of f32: the driver's rounding is then the board's.
#[test]
fn impulses_of_half_are_those_of_a_float_board_that_computes_in_binary16() {
    let (bodies, collisions) = short_world();
    let inside =
        Numbers { rows: Precision::Binary16, updates: Precision::Binary16, ..BINARY16_ON_CHIP };
    let configs = [
        BoardConfig { profile: &HALF, ..BoardConfig::default() },
        BoardConfig { numbers: Some(inside), ..BoardConfig::default() },
    ];
    for count in [collisions.len(), collisions.len() - 1] {
        let parameters = warm(Order::AsGiven).with_integrate(false);
        let [half, float] = configs.map(|config| {
            let (board, mut accelerator) = open_with(config, None, &round_shapes());
            let mut found = bodies.clone();
            let out = three_steps(&mut accelerator, &mut found, &collisions[..count], &parameters);
            assert_eq!(board.violations(), []);
            (bits(&found), out)
        });
        assert_eq!(half.0, float.0);
        assert_eq!(words(&half.1), words(&float.1));
        assert!(half.1.iter().any(|of| short_impulses(of) != *of), "rounding matters");
    }
}

const BINARY16_ON_CHIP: Numbers =
    Numbers { velocities: Precision::Binary16, impulses: Precision::Binary16, ..Numbers::F32 };

#[test]
fn impulses_beyond_the_words_of_a_collision_are_refused() {
    let count = scene(5).1.len();
    let config = BoardConfig { profile: &HALF, ..BoardConfig::default() };
    let mut impulses = vec![Impulses::ZERO; count];
    impulses[17].friction[1] = -65_505.0;
    let found = refused(config, &impulses, &warm(Order::AsGiven));
    let text = found.to_string();
    assert!(
        text.starts_with(
            "collision 17: friction impulse[1] is -65505, but this bitstream holds collisions in \
             binary16, which ends at 65504"
        ),
        "{text}"
    );
    assert!(text.ends_with("profiles that could: naive, float)"), "{text}");
}

#[test]
fn an_impulse_in_sixteen_bits_that_is_corrupted_on_its_way_fails_the_step() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { profile: &HALF, ..BoardConfig::default() };
    let (board, mut accelerator) = open_with(config, None, &round_shapes());
    let plan: FaultPlan =
        "corrupt=0x00000400@dma2.mm2s,phase=friction1,beat=3".parse().expect("a plan");
    board.inject(plan);
    let warm = warm(Order::AsGiven);
    let error = accelerator.step(&mut bodies.clone(), &collisions, &warm).expect_err("a sum");
    assert!(
        matches!(&error, Error::Step { fault, .. } if matches!(**fault, Fault::Checksum { .. })),
        "{error}"
    );
    accelerator.step(&mut bodies.clone(), &collisions, &warm).expect("the next works");
}

fn refused(config: BoardConfig, impulses: &[Impulses], parameters: &StepParameters) -> InputError {
    let (bodies, collisions) = scene(5);
    let (_board, mut accelerator) = open_with(config, None, &round_shapes());
    let mut found = bodies.clone();
    let warm = WarmCollisions { collisions: &collisions, impulses };
    match accelerator.step(&mut found, &warm, parameters) {
        Err(Error::Input(input)) => {
            assert_eq!(bits(&found), bits(&bodies), "nothing has changed");
            input
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn impulses_that_are_no_numbers_or_of_another_number_are_refused() {
    let count = scene(5).1.len();
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let parameters = warm(Order::AsGiven);
    let few = vec![Impulses::ZERO; count - 1];
    let found = refused(config, &few, &parameters);
    assert!(matches!(found, InputError::UnequalLengths { what: "collisions" }), "{found}");
    let (mut normal, mut friction) = (Impulses::ZERO, Impulses::ZERO);
    normal.normal[0] = f32::NAN;
    friction.friction[1] = f32::INFINITY;
    for wrong in [normal, friction] {
        let mut impulses = vec![Impulses::ZERO; count];
        impulses[17] = wrong;
        let found = refused(config, &impulses, &parameters);
        assert_eq!(found, InputError::ImpulseNotFinite { collision: 17 });
    }
}

#[test]
fn a_prepared_step_starts_warm_and_the_impulses_of_the_one_before_are_read_meanwhile() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let parameters = warm(Order::AsGiven);
    let given: Vec<Impulses> = (0..collisions.len())
        .map(|at| Impulses { normal: [0.01 * at as f32; 4], friction: [0.125, -0.25] })
        .collect();
    let warm = WarmCollisions { collisions: &collisions, impulses: &given };
    let (mut expected, mut cold) = (bodies.clone(), bodies.clone());
    let hot = direct_step_from(Some(&given), &mut expected, &collisions, &shapes(), &parameters);
    let zeros = vec![Impulses::ZERO; collisions.len()];
    let first = direct_step_from(Some(&zeros), &mut cold, &collisions, &shapes(), &parameters);

    let (_board, mut accelerator) = open_with(config, None, &shapes());
    let (mut left, mut right) = (bodies.clone(), bodies);
    let mut flight = accelerator.submit(&left, &collisions, &parameters).expect("a step");
    let prepared = flight.prepare(&right, &warm, &parameters).expect("prepared");
    let (report, started) = flight.wait_and_start(&mut left, &prepared);
    report.expect("the first step");
    let started = started.expect("the second step");
    assert_eq!(words(started.impulses()), words(&first));
    started.wait(&mut right).expect("the second step");
    assert_eq!((bits(&left), bits(&right)), (bits(&cold), bits(&expected)));
    assert_eq!(words(accelerator.impulses()), words(&hot));
}

/// Collisions that answer otherwise from the second read of each on.
struct Changing<'a> {
    collisions: &'a [Collision],
    reads: Vec<AtomicU32>,
}

impl Collisions for Changing<'_> {
    fn len(&self) -> usize {
        self.collisions.len()
    }

    fn collision(&self, index: usize) -> Collision {
        let mut collision = self.collisions[index];
        if self.reads[index].fetch_add(1, Ordering::Relaxed) > 0 {
            collision.contacts[0].point[0] = f32::NAN;
        }
        collision
    }
}

#[test]
fn collisions_that_change_between_the_reads_of_a_warm_step_are_refused() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let (board, mut accelerator) = open_with(config, None, &shapes());
    let reads = collisions.iter().map(|_| AtomicU32::new(0)).collect();
    let changing = Changing { collisions: &collisions, reads };
    let refused = accelerator.step(&mut bodies.clone(), &changing, &warm(Order::AsGiven));
    assert!(matches!(refused, Err(Error::Input(_))), "{refused:?}");
    assert_eq!(board.violations(), []);
}

#[test]
fn written_collisions_give_impulses_out_and_begin_with_none() {
    let (bodies, collisions) = world();
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let (_board, mut accelerator) = open_with(config, None, &shapes());
    let parameters = ordered(Order::AsGiven).with_impulses_out(true);
    let mut expected = bodies.clone();
    let impulses = direct_step_from(None, &mut expected, &collisions, &shapes(), &parameters);
    // Fewer than announced.
    let announced = collisions.len() + 100;
    let written = accelerator.write(&bodies, announced, &parameters, |records| {
        collisions.iter().for_each(|collision| records.push(collision));
    });
    let mut found = bodies.clone();
    let step = written.expect("written");
    accelerator.start(&step).expect("started").wait(&mut found).expect("a step");
    assert_eq!(bits(&found), bits(&expected));
    assert_eq!(words(accelerator.impulses()), words(&impulses));
    let refused = accelerator.write(&bodies, 1, &parameters.with_warm_start(true), |_| ());
    let refused = refused.expect_err("written collisions come without impulses");
    assert!(matches!(refused, Error::Input(InputError::WrittenWarm)), "{refused}");
    assert!(!refused.to_string().contains("  "), "{refused}");
}

#[test]
fn an_impulse_that_is_corrupted_on_its_way_back_fails_the_step() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let (board, mut accelerator) = open_with(config, None, &shapes());
    let parameters = ordered(Order::AsGiven).with_impulses_out(true);
    accelerator.step(&mut bodies.clone(), &collisions, &parameters).expect("a step");
    let before = accelerator.impulses().to_vec();
    let plan: FaultPlan =
        "corrupt=0x00000001@dma0.s2mm,phase=results,beat=2".parse().expect("a plan");
    board.inject(plan);
    let mut found = bodies.clone();
    let error = accelerator.step(&mut found, &collisions, &parameters).expect_err("a wrong sum");
    assert!(
        matches!(&error, Error::Step { fault, .. } if matches!(**fault, Fault::Checksum { .. })),
        "{error}"
    );
    assert_eq!(bits(&found), bits(&bodies));
    assert_eq!(words(accelerator.impulses()), words(&before));
}

#[test]
fn impulses_that_diverge_fail_the_step_and_change_nothing() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let (_board, mut accelerator) = open_with(config, None, &shapes());
    let mut impulses = vec![Impulses::ZERO; collisions.len()];
    impulses[7].normal[0] = f32::MAX;
    impulses[9].normal[0] = f32::MAX;
    let warm = WarmCollisions { collisions: &collisions, impulses: &impulses };
    // No friction pass: an infinite sum would make the velocities infinite first.
    let parameters = ordered(Order::AsGiven)
        .with_warm_start(true)
        .with_impulses_out(true)
        .with_friction_iterations(0);
    let mut found = bodies.clone();
    let error = accelerator.step(&mut found, &warm, &parameters).expect_err("it diverges");
    let named =
        |fault: &Fault| matches!(fault, Fault::NotFinite { .. } | Fault::ImpulseNotFinite { .. });
    assert!(matches!(&error, Error::Step { fault, .. } if named(fault)), "{error}");
    assert_eq!(bits(&found), bits(&bodies));
    assert!(accelerator.impulses().is_empty());
}

#[test]
fn impulses_of_a_failed_step_are_not_given_out() {
    let (bodies, collisions) = scene(5);
    let config = BoardConfig { inertia: Inertia::World, ..BoardConfig::default() };
    let (board, mut accelerator): (EmulatedBoard, _) = open_with(config, None, &shapes());
    let parameters = warm(Order::AsGiven);
    accelerator.step(&mut bodies.clone(), &collisions, &parameters).expect("a step");
    let before = accelerator.impulses().to_vec();
    let plan: FaultPlan =
        "corrupt=0x00400000@dma3.mm2s,phase=contact1,beat=3".parse().expect("a plan");
    board.inject(plan);
    let failed = accelerator.step(&mut bodies.clone(), &collisions, &parameters);
    let error = failed.expect_err("the impulse of a collision was corrupted");
    assert!(
        matches!(&error, Error::Step { fault, .. } if matches!(**fault, Fault::Checksum { .. })),
        "{error}"
    );
    assert_eq!(words(accelerator.impulses()), words(&before));
    accelerator.step(&mut bodies.clone(), &collisions, &parameters).expect("the next works");
}
