//! Tests that an order without hazards gives the same bits on hardware that ignores hazards, on
//! hardware that waits, and in a solver that takes one collision after the other. The order costs
//! its empty entries and nothing else.
//!
//! With `PGS_VECTORS` it also tests the thesis' step; `cargo test -p zynq-pgs --test it order:: --
//! --nocapture` prints the figures.
#![cfg(feature = "emulation")]
#![allow(clippy::print_stdout, reason = "the figures are the output of the test")]

use crate::common::{at_rest, bits, by_hand, open, ordered};
use crate::vectors;
use bitstream_model::{BoardConfig, Hazards};
use scene::{Scene, SceneOptions, kinetic_energy};
use zynq_pgs::interface::profile::{FLOAT, HALF, NAIVE, Profile};
use zynq_pgs::order::{Order, OrderError};
use zynq_pgs::validate::Excess;
use zynq_pgs::{Body, Collision, Error, InputError, Shape, StepParameters, StepReport};

fn with(hazards: Hazards) -> BoardConfig {
    BoardConfig { hazards, queue: Some(0), ..BoardConfig::default() }
}

/// A board in which every collision reads the result of all collisions before it.
fn sequential() -> BoardConfig {
    BoardConfig { window_slots: Some(1), queue: Some(0), ..BoardConfig::default() }
}

fn verified(order: Order) -> StepParameters {
    ordered(order).with_verify_order(true)
}

fn pile(text: &str, drop: f32) -> Scene {
    let grid = text.parse().expect("a grid");
    Scene::new(&SceneOptions { grid, drop }).expect("a small scene")
}

/// Steps a scene on a board. Returns the state at the end, and every report.
fn run(
    config: BoardConfig,
    mut scene: Scene,
    steps: usize,
    parameters: &StepParameters,
) -> (Vec<u32>, Vec<StepReport>) {
    let (board, mut accelerator) = open(config);
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    let mut reports = Vec::new();
    for _ in 0..steps {
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        let stepped = accelerator.step(bodies, collisions, parameters);
        reports.push(stepped.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations())));
    }
    assert_eq!(board.violations(), []);
    (bits(scene.bodies()), reports)
}

/// Issue slots of the window of `float`.
const DEPTH: u32 = 162;

/// Steps a scene in the default order without hazards for the window of `float`, one collision
/// after the other.
fn run_by_hand(mut scene: Scene, steps: usize) -> Vec<u32> {
    let (_, mut accelerator) = open(sequential());
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    for _ in 0..steps {
        scene.detect();
        let order = Order::HazardFree;
        let collisions = by_hand(order, scene.bodies(), scene.collisions(), scene.shapes(), DEPTH);
        let (bodies, _) = scene.parts_mut();
        let report = accelerator.step(bodies, &collisions, &ordered(Order::AsGiven));
        assert_eq!(report.expect("a step").cycles.stalls, 0);
    }
    bits(scene.bodies())
}

/// 120 steps from a drop of 0.5 m: the pile lands, and lands again.
#[test]
fn a_pile_takes_the_same_way_whether_the_pipeline_waits_or_not() {
    const STEPS: usize = 120;
    let scene = || pile("8x8x8", 0.5);
    let (waiting, reports) =
        run(with(Hazards::Interlocked), scene(), STEPS, &verified(Order::HazardFree));
    // The default on hardware that does not wait.
    let (unchecked, loose) =
        run(with(Hazards::Unchecked), scene(), STEPS, &StepParameters::default());
    let by_hand = run_by_hand(scene(), STEPS);
    let differing =
        |other: &[u32]| waiting.iter().zip(other).filter(|(one, other)| one != other).count();
    let sum = |of: fn(&StepReport) -> u64| reports.iter().map(of).sum::<u64>();
    let (collisions, empty) = (sum(|report| report.collisions), sum(|report| report.empty));
    println!(
        "8x8x8, {STEPS} steps: {collisions} collisions, {empty} empty entries, {} hazards, {} \
         cycles stalled, {} values differ unchecked, {} sequential",
        sum(|report| report.hazards),
        sum(|report| report.cycles.stalls),
        differing(&unchecked),
        differing(&by_hand),
    );
    assert_eq!((differing(&unchecked), differing(&by_hand)), (0, 0));
    assert!(collisions > 60_000, "it is a pile");
    for (report, loose) in reports.iter().zip(&loose) {
        assert_eq!((report.hazards, report.cycles.stalls), (0, 0));
        assert_eq!((loose.hazards, loose.cycles.stalls), (0, 0));
        assert_eq!([report.order, loose.order], [Order::HazardFree; 2]);
        // The formula for two cycles an entry, empty ones included: 513 bodies are 256.5 slots of
        // four beats in and 513 out; the pipelines fill in 374 and 314 cycles,
        // the integration in 264.
        let passes = if report.collisions == 0 { 0 } else { 4 * (374 + 314) };
        let entries = 8 * 2 * (report.collisions + report.empty);
        assert_eq!(report.cycles.work, 257 + entries + passes + 513 + 264);
        assert!(report.verified && !loose.verified);
    }
    // As given, hardware that does not wait gives other bits.
    let (stale, _) = run(with(Hazards::Unchecked), scene(), STEPS, &ordered(Order::AsGiven));
    assert!(differing(&stale) > 0);
}

/// An order on hardware that waits gives the bits of a sequential solve in that order.
#[test]
fn as_given_is_solved_one_collision_after_the_other_where_hazards_are_waited_for() {
    let as_given = ordered(Order::AsGiven);
    let (given, reports) = run(with(Hazards::Interlocked), pile("4x4x4", 0.0), 3, &as_given);
    let (sequential, _) = run(sequential(), pile("4x4x4", 0.0), 3, &as_given);
    assert_eq!(given, sequential);
    assert!(reports.iter().all(|report| report.order == Order::AsGiven && report.empty == 0));
    assert!(reports[0].cycles.stalls > 0, "it stands on the ground");
}

/// Every body comes back at its index, and the board receives the requested order.
#[test]
fn every_order_is_sent_on_every_design_and_none_moves_a_body_elsewhere() {
    let orders = [Order::AsGiven, Order::Interleaved, Order::HazardFree];
    let profiles: [&'static Profile; 3] = [&NAIVE, &FLOAT, &HALF];
    for profile in profiles {
        let config = BoardConfig { profile, queue: Some(0), ..BoardConfig::default() };
        for order in orders {
            let (board, mut accelerator) = open(config);
            let mut scene = pile("4x3x4", 0.0);
            let before = scene.bodies().to_vec();
            scene.detect();
            accelerator.set_shapes(scene.shapes()).expect("they fit");
            let (bodies, collisions) = scene.parts_mut();
            let report = accelerator
                .step(bodies, collisions, &ordered(order))
                .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
            assert_eq!((report.order, report.collisions), (order, collisions.len() as u64));
            assert_eq!(report.empty > 0, order.is_hazard_free(), "{}", profile.name);
            if order.is_hazard_free() {
                assert_eq!((report.hazards, report.cycles.stalls), (0, 0), "{}", profile.name);
            }
            for (before, after) in before.iter().zip(scene.bodies()) {
                let moved = before.pose.position.iter().zip(after.pose.position);
                assert!(moved.into_iter().all(|(from, to)| (from - to).abs() < 0.1));
            }
        }
    }
}

/// Verifying does not change the order that is sent, and refuses an order with hazards before the
/// driver writes a register.
#[test]
fn what_cannot_be_proved_is_not_sent() {
    let (board, mut accelerator) = open(with(Hazards::Unchecked));
    let mut scene = pile("4x4x4", 0.0);
    scene.detect();
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    let before = (bits(scene.bodies()), board.counts());
    let (bodies, collisions) = scene.parts_mut();
    let as_given = verified(Order::AsGiven);
    let error = accelerator.step(bodies, collisions, &as_given).expect_err("hazards");
    let Error::Input(InputError::Order(OrderError::Hazard { depth, earlier, slot, .. })) = error
    else {
        panic!("{error}");
    };
    assert_eq!(depth, 162);
    assert!(slot - earlier < 162);
    assert_eq!(bits(bodies), before.0);
    assert_eq!(board.counts(), before.1, "not a register was touched");
    let report = accelerator.step(bodies, collisions, &verified(Order::HazardFree));
    assert!(report.expect("it has none").verified);
}

/// A hub that touches all other bodies needs a window for each of its collisions.
#[test]
fn an_order_that_does_not_fit_is_refused_with_its_numbers() {
    let (board, mut accelerator) = open(with(Hazards::Unchecked));
    let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
    accelerator.set_shapes(&shapes).expect("they fit");
    let spokes = 2_000_u16;
    let mut bodies: Vec<Body> =
        (0..=spokes).map(|x| at_rest([f32::from(x), 0.0, 0.0], 1)).collect();
    let collisions: Vec<Collision> = (1..=u32::from(spokes))
        .map(|other| Collision {
            body_a: 0,
            body_b: other,
            normal: [0.0, 1.0, 0.0],
            count: 1,
            contacts: Default::default(),
        })
        .collect();
    let before = board.counts();
    let error = accelerator.step(&mut bodies, &collisions, &StepParameters::default());
    let error = error.expect_err("2,000 windows of 162 slots");
    // (4 MiB - 2,001 x 24 bytes) / 16 bytes = 259,142.
    assert!(
        matches!(
            error,
            Error::Input(InputError::BeyondBitstream {
                excess: Excess::OrderTooLong {
                    collisions: 2_000,
                    bodies: 2_001,
                    limit: 259_142,
                    depth: 162,
                    body: 0,
                    uses: 2_000,
                },
                ..
            })
        ),
        "{error:?}"
    );
    let text = error.to_string();
    // 1,999 x 12 + 1 entries at 28 cycles an entry; 1,999 x 106 x 2 + 1 at 3 cycles for two, of 8
    // bytes each.
    assert!(text.ends_with("(profiles that could: naive, half)"), "{text}");
    assert_eq!(board.counts(), before, "not a register was touched");
    accelerator
        .step(&mut bodies, &collisions, &ordered(Order::AsGiven))
        .expect("in another order it fits");
}

/// O3 and O6 on the step of the thesis' scene.
#[test]
fn the_full_step_gives_the_same_bits_and_keeps_its_energy() {
    let Some(folder) = vectors::full_step() else {
        println!("skipped: full_step186 (PGS_VECTORS does not lead there)");
        return;
    };
    let start = vectors::load(&folder);
    let step = |config, collisions: &[Collision], order| {
        let (_, mut accelerator) = open(config);
        accelerator.set_shapes(&start.shapes).expect("they fit");
        let mut bodies = start.bodies.clone();
        let parameters = ordered(order).with_integrate(false);
        let report = accelerator.step(&mut bodies, collisions, &parameters).expect("a step");
        let energy = kinetic_energy(&bodies, &start.shapes) / 1e3;
        println!(
            "{:?}: {energy:.1} kJ, {} hazards, {} cycles by formula, {} stalled, {} empty entries",
            report.order, report.hazards, report.cycles.work, report.cycles.stalls, report.empty
        );
        (bits(&bodies), report, energy)
    };
    for order in [Order::HazardFree, Order::HazardFree] {
        let collisions = by_hand(order, &start.bodies, &start.collisions, &start.shapes, DEPTH);
        let (expected, _, energy) = step(sequential(), &collisions, Order::AsGiven);
        for hazards in [Hazards::Unchecked, Hazards::Interlocked] {
            let (found, report, _) = step(with(hazards), &start.collisions, order);
            let differing = expected.iter().zip(&found).filter(|(one, other)| one != other).count();
            println!("{hazards:?}: {differing} of {} values differ from sequential", found.len());
            assert_eq!(differing, 0);
            assert_eq!((report.hazards, report.cycles.stalls, report.order), (0, 0, order));
            // As reported for 162 slots: between the limits of 128 and 192.
            assert!(report.empty * 1000 <= report.collisions * 7, "{} empty", report.empty);
        }
        assert!((energy / 127.2 - 1.0).abs() < 0.03, "{energy} kJ");
    }
    let (_, _, stale) = step(with(Hazards::Unchecked), &start.collisions, Order::AsGiven);
    assert!(stale > 160.0, "as given it gains energy: {stale} kJ");
}
