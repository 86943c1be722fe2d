//! Tests that a step that names no order gets the cheapest one on the board at hand.
//!
//! `cargo test -p zynq-pgs --test it cheapest_order:: -- --nocapture` prints the cycles of each
//! order.
#![cfg(feature = "emulation")]
#![allow(clippy::print_stdout, reason = "the figures are the output of the test")]

use crate::common;
use crate::common::{at_rest, bits, open, ordered};
use bitstream_model::{Bandwidth, BoardConfig, Hazards};
use scene::{Scene, SceneOptions};
use zynq_pgs::interface::profile::{FLOAT, HALF, NAIVE, Profile};
use zynq_pgs::order::Order;
use zynq_pgs::report::OrderChoice;
use zynq_pgs::{Body, Collision, Contact, Shape, StepParameters, StepReport, Velocity};

const SHAPES: [Shape; 3] =
    [Shape::STATIC, Shape::isotropic(1.0, 1.5), Shape::isotropic(1e-6, 1e-6)];
const GROUND: u32 = 0;
const CUBE: u32 = 1;
const PLATFORM: u32 = 2;

/// A body at rest, or a cube that falls.
fn body(position: [f32; 3], shape: u32) -> Body {
    let fall = if shape == CUBE { -0.2 } else { 0.0 };
    let velocity = Velocity { linear: [0.0, fall, 0.0], angular: [0.0; 3] };
    Body { velocity, ..at_rest(position, shape) }
}

/// Four points around the middle of a face of a cube of 2 m, whose normal leads to A.
fn face(body_a: u32, body_b: u32, middle: [f32; 3], normal: [f32; 3]) -> Collision {
    let contacts = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|[s, t]| {
        let across = if normal[1] == 0.0 { [0.0, s, t] } else { [s, 0.0, t] };
        let point = [0, 1, 2].map(|axis| middle[axis] + across[axis]);
        Contact { point, distance: -0.001 }
    });
    Collision { body_a, body_b, normal, count: 4, contacts }
}

/// 200 boxes side by side on one platform that moves, body 0.
fn platform() -> (Vec<Body>, Vec<Collision>) {
    let mut bodies = vec![body([0.0, -1.0, 0.0], PLATFORM)];
    let mut collisions = Vec::new();
    for (index, place) in (1..=200_u32).zip(0_u8..) {
        let at = [f32::from(place % 20) * 2.5, 1.0, f32::from(place / 20) * 2.5];
        bodies.push(body(at, CUBE));
        collisions.push(face(0, index, [at[0], 0.0, at[2]], [0.0, -1.0, 0.0]));
    }
    (bodies, collisions)
}

/// A wall of two courses of ten cubes on the ground: 38 collisions, sorted as Bullet sorts them.
fn wall() -> (Vec<Body>, Vec<Collision>) {
    const LENGTH: u32 = 10;
    let mut bodies = vec![body([0.0, -400.0, 0.0], GROUND)];
    let mut collisions = Vec::new();
    let at = |index: u32| {
        let place = |count: u32| f32::from(u8::try_from(count).expect("a small wall")) * 2.0;
        [place((index - 1) % LENGTH), 1.0 + place((index - 1) / LENGTH), 0.0]
    };
    for index in 1..=2 * LENGTH {
        bodies.push(body(at(index), CUBE));
        if index <= LENGTH {
            let [x, ..] = at(index);
            collisions.push(face(0, index, [x, 0.0, 0.0], [0.0, -1.0, 0.0]));
        }
    }
    for index in 1..=2 * LENGTH {
        let [x, y, z] = at(index);
        if index % LENGTH != 0 {
            collisions.push(face(index, index + 1, [x + 1.0, y, z], [-1.0, 0.0, 0.0]));
        }
        if index <= LENGTH {
            let above = index + LENGTH;
            collisions.push(face(index, above, [x, y + 1.0, z], [0.0, -1.0, 0.0]));
        }
    }
    (bodies, collisions)
}

/// Runs one step. Returns the report, and the bits of the bodies afterwards.
fn step(
    config: BoardConfig,
    (mut bodies, collisions): (Vec<Body>, Vec<Collision>),
    parameters: &StepParameters,
) -> (StepReport, Vec<u32>) {
    let (board, mut accelerator) = open(config);
    accelerator.set_shapes(&SHAPES).expect("they fit");
    let report = accelerator
        .step(&mut bodies, &collisions, parameters)
        .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
    (report, bits(&bodies))
}

/// Reports of the step as given, in the order without hazards, and in the default order.
fn compared(config: BoardConfig, scene: fn() -> (Vec<Body>, Vec<Collision>)) -> [StepReport; 3] {
    let given = step(config, scene(), &ordered(Order::AsGiven)).0;
    let reordered = step(config, scene(), &ordered(Order::HazardFree)).0;
    let default = step(config, scene(), &StepParameters::default()).0;
    println!(
        "{}: {} collisions: as given {} cycles, hazard-free {} with {} empty entries, \
         default {} ({:?}) with {}",
        config.profile.name,
        given.collisions,
        given.cycles.total,
        reordered.cycles.total,
        reordered.empty,
        default.cycles.total,
        default.order,
        default.empty,
    );
    [given, reordered, default]
}

/// Every profile, on a pipeline that waits.
fn waiting() -> impl Iterator<Item = BoardConfig> {
    let profiles: [&'static Profile; 3] = [&NAIVE, &FLOAT, &HALF];
    profiles.into_iter().map(|profile| BoardConfig {
        profile,
        queue: Some(0),
        ..BoardConfig::default()
    })
}

fn is_cheapest([given, reordered, default]: [StepReport; 3]) {
    let better = given.cycles.total.min(reordered.cycles.total);
    assert!(default.cycles.total * 100 <= better * 102, "{} of {better}", default.cycles.total);
    assert_eq!(default.empty, 0, "a pipeline that waits needs no empty entries");
    assert!(matches!(default.order_choice, OrderChoice::Cheapest(_)));
}

#[test]
fn a_platform_under_200_boxes_is_solved_as_given() {
    for config in waiting() {
        let [given, reordered, default] = compared(config, platform);
        assert!(
            given.cycles.total < reordered.cycles.total,
            "the scene is one for the order given"
        );
        assert_eq!(default.order, Order::AsGiven);
        assert_eq!(default.cycles, given.cycles);
        assert_eq!(default.bytes_to_device, given.bytes_to_device);
        is_cheapest([given, reordered, default]);
    }
}

#[test]
fn a_small_scene_costs_no_more_than_the_better_order() {
    for config in waiting() {
        is_cheapest(compared(config, wall));
    }
}

#[test]
fn a_pile_is_reordered_and_costs_a_fraction() {
    fn pile() -> (Vec<Body>, Vec<Collision>) {
        let grid = "12x12x12".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a small scene");
        let collisions = scene.detect().to_vec();
        (scene.bodies().to_vec(), collisions)
    }
    for config in waiting() {
        let [given, reordered, default] = compared(config, pile);
        is_cheapest([given, reordered, default]);
        assert!(default.order.is_hazard_free());
        if config.profile == &FLOAT {
            assert!(default.cycles.total * 20 < given.cycles.total);
        }
        let OrderChoice::Cheapest(costs) = default.order_choice else { panic!("it was compared") };
        let reordered = costs.reordered.expect("it was made");
        assert!(reordered < costs.as_given);
    }
}

/// The driver predicts the cycles that the board counts, to the cycle for the order that it takes.
#[test]
fn predicted_cycles_are_those_of_the_board() {
    for config in waiting() {
        // Hazards are the only cause of waiting.
        let config = BoardConfig { bandwidth: Bandwidth::Unlimited, ..config };
        let fill = 4 * u64::from(config.profile.contact.fill + config.profile.friction.fill);
        let predicted_and_counted = |scene: fn() -> (Vec<Body>, Vec<Collision>)| {
            let (report, _) = step(config, scene(), &StepParameters::default());
            let (alone, _) = step(config, (scene().0, Vec::new()), &StepParameters::default());
            let counted = |report: StepReport| report.cycles.work + report.cycles.stalls;
            let OrderChoice::Cheapest(costs) = report.order_choice else { panic!("it is not") };
            (report.order, costs, counted(report) - counted(alone) - fill)
        };
        let (order, costs, counted) = predicted_and_counted(platform);
        assert_eq!((order, costs.as_given), (Order::AsGiven, counted), "{}", config.profile.name);

        let (order, costs, counted) = predicted_and_counted(wall);
        let reordered = costs.reordered.expect("it was made");
        assert!(order.is_hazard_free() && counted == reordered, "{counted} of {reordered}");
        assert!(reordered < costs.as_given);
    }
}

/// The order changes the stalls and no bit of the result: a board that takes one collision after
/// the other gives the same bits.
#[test]
fn the_default_is_the_sequential_solve_of_its_order() {
    // The damping of spin tells orders apart in a wall as regular as this.
    let parameters = StepParameters::thesis();
    let as_given = parameters.with_order(Order::AsGiven);
    let config = BoardConfig { queue: Some(0), ..BoardConfig::default() };
    let (waited, found) = step(config, wall(), &parameters);
    assert_eq!(waited.order, Order::HazardFree, "the wall has hazards to keep apart");
    assert!(waited.empty == 0 && waited.cycles.stalls > 0);
    let (bodies, collisions) = wall();
    let sequential =
        BoardConfig { window_slots: Some(1), queue: Some(0), ..BoardConfig::default() };
    let in_order = common::by_hand(Order::HazardFree, &bodies, &collisions, &SHAPES, 162);
    let (report, expected) = step(sequential, (bodies, in_order), &as_given);
    assert_eq!(report.cycles.stalls, 0);
    assert_eq!(found, expected);
    let (_, given) = step(sequential, wall(), &as_given);
    assert_ne!(found, given, "it is another order");
}

#[test]
fn the_report_says_why_an_order_was_taken() {
    let choice = |config, parameters: &StepParameters| step(config, wall(), parameters).0;
    let unchecked =
        BoardConfig { hazards: Hazards::Unchecked, queue: Some(0), ..BoardConfig::default() };
    let none = StepParameters::default();
    let report = choice(unchecked, &none);
    assert_eq!((report.order, report.order_choice), (Order::HazardFree, OrderChoice::NoInterlock));
    assert!(report.empty > 0 && report.hazards == 0);
    let report = choice(
        BoardConfig { queue: Some(0), ..BoardConfig::default() },
        &ordered(Order::HazardFree),
    );
    assert_eq!((report.order, report.order_choice), (Order::HazardFree, OrderChoice::Asked));
    // An order without hazards can be verified.
    let mut verified = none;
    verified.verify_order = true;
    let report = choice(BoardConfig { queue: Some(0), ..BoardConfig::default() }, &verified);
    assert_eq!(report.order, Order::HazardFree);
    assert!(report.verified);
}

#[test]
fn a_step_without_passes_or_collisions_is_sent_as_given() {
    let parameters =
        StepParameters::default().with_contact_iterations(0).with_friction_iterations(0);
    let (report, _) =
        step(BoardConfig { queue: Some(0), ..BoardConfig::default() }, wall(), &parameters);
    assert_eq!(report.order, Order::AsGiven);
    let (report, _) = step(
        BoardConfig { queue: Some(0), ..BoardConfig::default() },
        (wall().0, Vec::new()),
        &StepParameters::default(),
    );
    assert_eq!((report.order, report.cycles.stalls), (Order::AsGiven, 0));
}

/// A window with more issue slots than an order can keep apart.
#[test]
fn a_window_that_cannot_be_ordered_for_leaves_the_order_as_given() {
    let config =
        BoardConfig { window_slots: Some(20_000), queue: Some(0), ..BoardConfig::default() };
    let (report, _) = step(config, wall(), &StepParameters::default());
    assert_eq!(report.order, Order::AsGiven);
    let OrderChoice::Cheapest(costs) = report.order_choice else { panic!("it was compared") };
    assert_eq!(costs.reordered, None);
}
