//! Tests the design that streams the collisions once, through the driver. It gives the same bits as
//! one collision after the other in the same order, and the driver refuses every step that would
//! make it wait for ever.
//!
//! With `PGS_VECTORS` it also tests the thesis' step; `cargo test -p zynq-pgs --test it windowed:: --
//! --nocapture` prints the figures.
#![cfg(feature = "emulation")]
#![allow(clippy::print_stdout, reason = "the figures are the output of the test")]

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{at_rest, bits, by_hand, open, ordered, standing};
use crate::vectors;
use bitstream_model::interface::profile::{
    FLOAT, Flow, HALF, Inertia, MIXED, Profile, WINDOWED, WINDOWED16, Window,
};
use bitstream_model::{Bandwidth, BoardConfig};
use scene::{Scene, SceneOptions, ShapesOptions};
use zynq_pgs::order::Order;
use zynq_pgs::{
    Body, Collision, Collisions, Error, Excess, InputError, Shape, StepParameters, StepReport,
    Velocity,
};

fn of(profile: &'static Profile) -> BoardConfig {
    BoardConfig { profile, ..BoardConfig::default() }
}

/// The profile with other numbers of units and places.
fn with(change: impl Fn(&mut Window)) -> &'static Profile {
    let Flow::Window(mut window) = WINDOWED.flow else { panic!("it has a window") };
    change(&mut window);
    Box::leak(Box::new(Profile { flow: Flow::Window(window), ..WINDOWED }))
}

fn differing(one: &[Body], other: &[Body]) -> usize {
    bits(one).iter().zip(bits(other)).filter(|(one, other)| **one != *other).count()
}

/// Points a metre of a grid of 2^-9 m: differences of positions below 2^13 m are exact in f32.
const FINE: f32 = 512.0;
/// Points a metre of a grid of half a metre: sums and differences within a small pile are exact in
/// binary16, too.
const COARSE: f32 = 2.0;

/// Moves bodies and contact points to a grid of `grid` points a metre. On it lever arms are the
/// same numbers from world coordinates and from offsets. Two of three contact points remain, since
/// a third is not exact.
fn snap(bodies: &mut [Body], collisions: &mut [Collision], grid: f32) {
    let snap = |point: &mut [f32; 3]| {
        for number in point {
            *number = (*number * grid).round() / grid;
        }
    };
    bodies.iter_mut().for_each(|body| snap(&mut body.pose.position));
    for collision in collisions {
        collision.contacts.iter_mut().for_each(|contact| snap(&mut contact.point));
        if collision.count == 3 {
            collision.count = 2;
        }
    }
}

/// Entries between two uses of a body that `windowed` wants: 316 cycles at two passes of two cycles
/// a unit. In `windowed16` three cycles take two.
const DEPTH: u32 = 79;
const DEPTH16: u32 = 106;

/// Takes the steps of a scene on a grid with `windowed`, and each of them on `float` too, one
/// collision after the other in the same order.
fn side_by_side(scene: &mut Scene, steps: usize, inertia: Inertia) -> Vec<StepReport> {
    let (board, mut windowed) = open(BoardConfig { inertia, ..of(&WINDOWED) });
    let sequential = BoardConfig { window_slots: Some(1), inertia, ..of(&FLOAT) };
    let (_, mut float) = open(sequential);
    windowed.set_shapes(scene.shapes()).expect("they fit");
    float.set_shapes(scene.shapes()).expect("they fit");
    let mut reports = Vec::new();
    for step in 0..steps {
        snap(scene.bodies_mut(), &mut [], FINE);
        let mut collisions = scene.detect().to_vec();
        let mut bodies = scene.bodies().to_vec();
        snap(&mut bodies, &mut collisions, FINE);
        let mut expected = bodies.clone();
        let in_order = by_hand(Order::HazardFree, &expected, &collisions, scene.shapes(), DEPTH);
        float.step(&mut expected, &in_order, &ordered(Order::AsGiven)).expect("a step");
        let report = windowed
            .step(&mut bodies, &collisions, &StepParameters::default())
            .unwrap_or_else(|error| panic!("step {step}: {error}: {:?}", board.violations()));
        assert_eq!(differing(&bodies, &expected), 0, "step {step}, of {} bodies", bodies.len());
        assert_eq!(report.order, Order::HazardFree);
        scene.bodies_mut().copy_from_slice(&bodies);
        reports.push(report);
    }
    assert_eq!(board.violations(), []);
    reports
}

#[test]
fn a_pile_gives_the_bits_of_one_collision_after_the_other() {
    let grid = "6x6x6".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.25, ..SceneOptions::default() };
    let mut scene = Scene::new(&options).expect("a small scene");
    let reports = side_by_side(&mut scene, 60, Inertia::Isotropic);
    let last = reports.last().expect("sixty steps");
    println!(
        "6x6x6: {} collisions, {} empty entries, {} cycles ({} stalled), {:?}",
        last.collisions, last.empty, last.cycles.total, last.cycles.stalls, last.live
    );
    let live = last.live.expect("it keeps live bodies");
    assert!(live.most_alive <= live.most_held && live.most_held <= 216);
    assert!(reports.iter().map(|report| report.collisions).sum::<u64>() > 10_000);
}

#[test]
fn a_pile_of_shapes_gives_the_bits_of_one_collision_after_the_other() {
    let grid = "4x4x4".parse().expect("a grid");
    let options = ShapesOptions { grid, drop: 0.0, ..ShapesOptions::default() };
    let mut scene = Scene::of_shapes(&options).expect("a small scene");
    let reports = side_by_side(&mut scene, 90, Inertia::World);
    let collisions = reports.iter().map(|report| report.collisions).sum::<u64>();
    println!("4x4x4 shapes: {collisions} collisions in {} steps", reports.len());
    assert!(collisions > 1_000, "{collisions}");
}

fn body(x: f32, shape: u32) -> Body {
    let linear = [0.0, if shape == 0 { 0.0 } else { -1.0 }, 0.0];
    let velocity = Velocity { linear, ..Velocity::default() };
    Body { velocity, ..at_rest([x, 1.0, 0.0], shape) }
}

fn touch(body_a: u32, body_b: u32) -> Collision {
    standing([body_a, body_b], 0.0, 0.0, -0.01)
}

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 0.5)];

/// A static body is not streamed, wherever it is among the bodies; a body without contacts is.
#[test]
fn static_and_untouched_bodies_have_their_place_too() {
    for profile in [&WINDOWED, &WINDOWED16] {
        let (board, mut windowed) = open(of(profile));
        let (_, mut float) = open(BoardConfig { window_slots: Some(1), ..of(&FLOAT) });
        windowed.set_shapes(&SHAPES).expect("they fit");
        float.set_shapes(&SHAPES).expect("they fit");
        let shapes = [1, 0, 1, 1, 0, 0, 1, 1, 0];
        let start: Vec<Body> =
            (0_u8..).zip(shapes).map(|(x, shape)| body(f32::from(x), shape)).collect();
        let all = [touch(1, 2), touch(6, 4), touch(2, 6), touch(8, 7)];
        for (count, contact, friction, integrate) in
            [(4, 4, 4, true), (3, 1, 0, true), (4, 0, 2, false), (2, 0, 0, true), (0, 4, 4, true)]
        {
            let mut parameters = ordered(Order::HazardFree)
                .with_contact_iterations(contact)
                .with_friction_iterations(friction)
                .with_integrate(integrate);
            let mut bodies = start.clone();
            let report = windowed
                .step(&mut bodies, &all[..count], &parameters)
                .unwrap_or_else(|error| panic!("{error:?}: {:?}", board.violations()));
            assert_eq!((report.bodies, report.collisions), (9, count as u64));
            // Five bodies move: 2 + 2 beats in and 4 out, or 1 + 2 and 4.
            assert_eq!(report.bytes_from_device, 5 * 4 * 16);
            let mut expected = start.clone();
            // The depth of either profile is larger than the number of collisions.
            parameters.order = Some(Order::AsGiven);
            let in_order = by_hand(Order::HazardFree, &expected, &all[..count], &SHAPES, DEPTH);
            float.step(&mut expected, &in_order, &parameters).expect("a step");
            if profile.name == "windowed" {
                assert_eq!(differing(&bodies, &expected), 0, "{count} {contact} {friction}");
            }
            for (index, (after, before)) in bodies.iter().zip(&start).enumerate() {
                assert!(shapes[index] == 1 || bits(&[*after]) == bits(&[*before]));
                let near = after.velocity.linear[1] - expected[index].velocity.linear[1];
                assert!(near.abs() < 0.01, "{}: body {index}: {near}", profile.name);
            }
        }
        assert_eq!(board.violations(), []);
    }
}

#[test]
fn a_step_in_which_nothing_moves_sends_nothing() {
    let (board, mut windowed) = open(of(&WINDOWED));
    windowed.set_shapes(&SHAPES).expect("they fit");
    let mut bodies = vec![body(0.0, 0), body(1.0, 0)];
    let before = (bits(&bodies), board.counts());
    let none: &[Collision] = &[];
    let report = windowed.step(&mut bodies, none, &StepParameters::default()).expect("a step");
    assert_eq!((report.bodies, report.cycles.total, report.bytes_to_device), (2, 0, 0));
    assert_eq!((bits(&bodies), board.counts()), before);
    bodies.push(body(2.0, 1));
    windowed.step(&mut bodies, none, &StepParameters::default()).expect("the next one does");
}

/// The whole text of a refusal, with nothing sent.
fn refused(
    profile: &'static Profile,
    bodies: &mut [Body],
    collisions: &[Collision],
    order: Order,
) -> (Excess, String) {
    let (board, mut windowed) = open(of(profile));
    windowed.set_shapes(&SHAPES).expect("they fit");
    let before = (bits(bodies), board.counts());
    let error = windowed.step(bodies, collisions, &ordered(order)).expect_err("it cannot be sent");
    assert_eq!((bits(bodies), board.counts()), before);
    let Error::Input(InputError::BeyondBitstream { excess, .. }) = error else {
        panic!("{error:?}")
    };
    (excess, error.to_string())
}

/// A chain of cubes; two of them that lie far apart in it touch each other.
fn chain(links: u32) -> (Vec<Body>, Vec<Collision>) {
    let bodies = (0..=links).map(|x| body(f32::from(u16::try_from(x).expect("few")), 1)).collect();
    let mut collisions: Vec<_> = (0..links).map(|link| touch(link, link + 1)).collect();
    collisions.push(touch(0, links));
    (bodies, collisions)
}

#[test]
fn a_body_that_lives_too_long_is_refused_with_the_profiles_that_could() {
    let (mut bodies, collisions) = chain(3_000);
    let (excess, text) = refused(&WINDOWED, &mut bodies, &collisions, Order::AsGiven);
    assert!(matches!(excess, Excess::SpanTooLong { body: 0, lag: 2_816, .. }), "{excess:?}");
    // Body 0 is in the first entry and in the last.
    assert_eq!(
        text,
        "in this order body 0 is used first in entry 0 and last in entry 3000, and the bitstream's \
         delay lines take spans of less than 2816: ask for another order (hazard-free keeps \
         spans short unless a body has dozens of collisions), or load another bitstream (profiles that could: naive, float, half, mixed)"
    );
    // The longest chain that fits, and one link more.
    for (links, fits) in [(2_815, true), (2_816, false)] {
        let (mut bodies, collisions) = chain(links);
        let (board, mut windowed) = open(of(&WINDOWED));
        windowed.set_shapes(&SHAPES).expect("they fit");
        let stepped = windowed.step(&mut bodies, &collisions, &ordered(Order::AsGiven));
        assert_eq!(stepped.is_ok(), fits, "{links}: {stepped:?}: {:?}", board.violations());
    }
}

#[test]
fn more_live_bodies_than_places_are_refused_with_the_profiles_that_could() {
    let few = with(|window| window.slots = 17);
    let grid = "4x4x4".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
    let mut scene = Scene::new(&options).expect("a small scene");
    let collisions = scene.detect().to_vec();
    let mut bodies = scene.bodies().to_vec();
    let (excess, text) = refused(few, &mut bodies, &collisions, Order::HazardFree);
    let Excess::TooManyLive { held, alive, places: 16 } = excess else { panic!("{excess:?}") };
    assert!((17..=64).contains(&held) && alive <= held, "{held} {alive}");
    assert!(text.contains(&format!("{held} moving bodies")), "{text}");
    assert!(text.contains("places for 16"), "{text}");
    assert!(
        text.ends_with("(profiles that could: naive, float, half, mixed, windowed, windowed16)"),
        "{text}"
    );
    // The number of places that the driver demands is enough, and one less is not.
    let design = move |places: u32| with(move |window| window.slots = places + 1);
    let (board, mut windowed) = open(of(design(held)));
    windowed.set_shapes(scene.shapes()).expect("they fit");
    let report = windowed.step(&mut bodies, &collisions, &StepParameters::default());
    let report = report.unwrap_or_else(|error| panic!("{error:?}: {:?}", board.violations()));
    assert_eq!(report.live.expect("live bodies").most_held, held);
    let (excess, _) = refused(design(held - 1), &mut bodies, &collisions, Order::HazardFree);
    assert!(matches!(excess, Excess::TooManyLive { .. }), "{excess:?}");
}

/// Collisions, among them one that loses its contact points after the read `good_reads`, for good
/// or for one read.
struct Unsteady<'a> {
    list: &'a [Collision],
    which: usize,
    reads: AtomicUsize,
    good_reads: usize,
    once: bool,
    /// Whether it then equals the padding that fills a gap in an order.
    like_padding: bool,
}

impl Collisions for Unsteady<'_> {
    fn len(&self) -> usize {
        self.list.len()
    }

    fn collision(&self, index: usize) -> Collision {
        let mut collision = self.list[index];
        if index == self.which {
            let reads = self.reads.fetch_add(1, Ordering::Relaxed) + 1;
            let lost = reads > self.good_reads;
            if lost && !(self.once && reads > self.good_reads + 1) {
                collision.count = 0;
                if self.like_padding {
                    collision.body_b = collision.body_a;
                }
            }
        }
        collision
    }
}

/// Results go by their place in the stream: a collision that turns into padding would give every
/// body behind it the state of another.
#[test]
fn a_collision_that_loses_its_points_on_the_way_fails_the_step() {
    let grid = "3x3x3".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
    let mut scene = Scene::new(&options).expect("a small scene");
    let list = scene.detect().to_vec();
    let start = scene.bodies().to_vec();
    let parameters = StepParameters::default();
    let (mut on_the_board, mut refused) = (0, 0);
    let reads = [(1, false), (2, false), (1, true), (2, true), (3, true)];
    let reads = reads.map(|(good_reads, once)| [false, true].map(|like| (good_reads, once, like)));
    let all =
        (0..list.len()).flat_map(|which| reads.as_flattened().iter().map(move |it| (which, *it)));
    for (which, (good_reads, once, like_padding)) in all {
        let (_, mut windowed) = open(of(&WINDOWED));
        windowed.set_shapes(scene.shapes()).expect("they fit");
        let mut expected = start.clone();
        windowed.step(&mut expected, &list, &parameters).expect("a step");
        let mut bodies = start.clone();
        let unsteady = Unsteady {
            list: &list,
            which,
            reads: AtomicUsize::new(0),
            good_reads,
            once,
            like_padding,
        };
        match windowed.step(&mut bodies, &unsteady, &parameters) {
            // The driver did not read it again.
            Ok(_) => assert_eq!(differing(&bodies, &expected), 0, "{which} after {good_reads}"),
            Err(error) => {
                on_the_board += usize::from(matches!(error, Error::Step { .. }));
                refused += usize::from(error.is_input());
                assert_eq!(differing(&bodies, &start), 0, "{which} after {good_reads}: {error}");
            }
        }
    }
    // A collision that is wrong during packing is refused, even if it equals padding.
    assert!(refused >= 4 * list.len(), "{refused} of {}", list.len());
    assert_eq!(on_the_board, 0);
}

/// `half` integrates poses of sixteen bits. The test therefore compares velocities, and hands them
/// on.
#[test]
fn sixteen_bits_give_the_velocities_of_half_waiting_in_the_same_order() {
    let grid = "6x6x6".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
    let mut scene = Scene::new(&options).expect("a small scene");
    let (board, mut windowed) = open(of(&WINDOWED16));
    let (_, mut half) = open(of(&HALF));
    windowed.set_shapes(scene.shapes()).expect("they fit");
    half.set_shapes(scene.shapes()).expect("they fit");
    let mut collisions = scene.detect().to_vec();
    let mut bodies = scene.bodies().to_vec();
    snap(&mut bodies, &mut collisions, COARSE);
    assert!(collisions.len() > 500, "{}", collisions.len());
    for (index, body) in (0_u8..).zip(&mut bodies).skip(1) {
        let off = f32::from(index) / 1_009.0;
        body.velocity = Velocity { linear: [off, -1.0 - off, 3.3 * off], angular: [0.0, off, 0.1] };
    }
    let first = bits(&bodies);
    for step in 0..5 {
        let mut parameters = ordered(Order::AsGiven);
        parameters.integrate = false;
        let in_order = by_hand(Order::HazardFree, &bodies, &collisions, scene.shapes(), DEPTH16);
        let mut expected = bodies.clone();
        let waited = half.step(&mut expected, &in_order, &parameters).expect("a step");
        assert_eq!(waited.order, Order::AsGiven);
        parameters.order = Some(Order::HazardFree);
        let before = bits(&bodies);
        windowed
            .step(&mut bodies, &collisions, &parameters)
            .unwrap_or_else(|error| panic!("step {step}: {error}: {:?}", board.violations()));
        for (index, (body, expected)) in bodies.iter().zip(&expected).enumerate() {
            let of = |Velocity { linear, angular }| [linear, angular].map(|v| v.map(f32::to_bits));
            let (found, expected) = (of(body.velocity), of(expected.velocity));
            assert_eq!(found, expected, "step {step}, body {index}");
        }
        assert_ne!(bits(&bodies), before, "step {step} moved nothing");
    }
    assert_ne!(bits(&bodies), first);
    assert_eq!(board.violations(), []);
}

/// Sixteen-bit arithmetic on coordinates in range: results near to single precision.
#[test]
fn sixteen_bits_stay_near_single_precision() {
    let step = |profile| {
        let (_, mut accelerator) = open(of(profile));
        let grid = "4x4x4".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
        let mut scene = Scene::new(&options).expect("a small scene");
        accelerator.set_shapes(scene.shapes()).expect("they fit");
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        accelerator.step(bodies, collisions, &ordered(Order::HazardFree)).expect("a step");
        scene.bodies().to_vec()
    };
    let [single, short, mixed] = [&WINDOWED, &WINDOWED16, &MIXED].map(step);
    for other in [short, mixed] {
        for (one, other) in single.iter().zip(&other) {
            let pairs = one.velocity.linear.iter().zip(other.velocity.linear);
            assert!(pairs.into_iter().all(|(one, other)| (one - other).abs() < 0.02));
        }
    }
}

/// The thesis' step, once on a grid for the bits, once as it is for the figures.
#[test]
fn the_full_step_gives_the_bits_of_one_collision_after_the_other() {
    let Some(folder) = vectors::full_step() else {
        println!("skipped: full_step186 (PGS_VECTORS does not lead there)");
        return;
    };
    let start = vectors::load(&folder);
    let (mut bodies, mut collisions) = (start.bodies.clone(), start.collisions.clone());
    snap(&mut bodies, &mut collisions, FINE);
    let mut expected = bodies.clone();
    let in_order = by_hand(Order::HazardFree, &bodies, &collisions, &start.shapes, DEPTH);
    let (_, mut float) = open(BoardConfig { window_slots: Some(1), ..of(&FLOAT) });
    float.set_shapes(&start.shapes).expect("they fit");
    float.step(&mut expected, &in_order, &ordered(Order::AsGiven)).expect("a step");
    let (_, mut windowed) = open(of(&WINDOWED));
    windowed.set_shapes(&start.shapes).expect("they fit");
    windowed.step(&mut bodies, &collisions, &StepParameters::default()).expect("a step");
    let differing = differing(&bodies, &expected);
    println!("{differing} of {} values differ from sequential", 13 * bodies.len());
    assert_eq!(differing, 0);

    for (profile, bandwidth) in [
        (&FLOAT, Bandwidth::Unlimited),
        (&WINDOWED, Bandwidth::Unlimited),
        (&WINDOWED, Bandwidth::ZCU102_SUSTAINED),
        (&WINDOWED16, Bandwidth::Unlimited),
        (&WINDOWED16, Bandwidth::ZCU102_SUSTAINED),
    ] {
        let (_, mut accelerator) = open(BoardConfig { bandwidth, ..of(profile) });
        accelerator.set_shapes(&start.shapes).expect("they fit");
        let mut bodies = start.bodies.clone();
        let report = accelerator.step(&mut bodies, &start.collisions, &ordered(Order::HazardFree));
        let report = report.expect("a step");
        println!(
            "{} at {bandwidth:?}: {} cycles ({} stalled, {} waiting), {} bytes, {} empty entries, \
             {} hazards, {:?}, ordered in {:?}, packed in {:?}",
            profile.name,
            report.cycles.total,
            report.cycles.stalls,
            report.cycles.waits,
            report.bytes_to_device + report.bytes_from_device,
            report.empty,
            report.hazards,
            report.live,
            report.host.order,
            report.host.pack,
        );
    }
}
