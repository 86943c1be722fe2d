//! Number formats and inertia: on the streams, in the arithmetic, on chip.

#![expect(clippy::float_cmp, reason = "the expected values are exact")]

use bitstream_model::{Bandwidth, BoardConfig};
use half::f16;
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE, Profile};
use proptest::prelude::*;

use crate::common::packing::{decode, encode};
use crate::common::scene::{
    AT_REST, Body, Collision, STATIC, Step, bits, ground_contact, one_cube,
};
use crate::common::sg::{Machine, Outcome};
use crate::common::without_queue;

const BINARY16: StreamFormat = StreamFormat::Binary16;
/// Sixteen bits on the streams alone.
const BINARY16_STREAMS: Numbers =
    Numbers { collisions: BINARY16, bodies: BINARY16, poses: BINARY16, ..Numbers::F32 };
/// Binary16 everywhere but on the streams.
const BINARY16_INSIDE: Numbers = Numbers {
    collisions: StreamFormat::F32,
    bodies: StreamFormat::F32,
    poses: StreamFormat::F32,
    ..Numbers::BINARY16
};

fn config(profile: &'static Profile, numbers: Numbers) -> BoardConfig {
    BoardConfig {
        profile,
        numbers: Some(numbers),
        bandwidth: Bandwidth::Unlimited,
        ..without_queue()
    }
}

fn run(config: BoardConfig, step: &Step) -> Outcome {
    let mut machine = Machine::new(config);
    let outcome = machine.step(step).expect("the step completes");
    machine.host.assert_no_violation();
    outcome
}

/// The state of the bodies as bits; a NaN has no sign and no payload in binary16.
fn states(bodies: &[Body]) -> Vec<[[u32; 4]; 4]> {
    let plain = |value: f32| if value.is_nan() { f32::NAN } else { value };
    bodies.iter().map(|body| bits(&mapped(body, plain))).collect()
}

/// Every number of a body through a function.
fn mapped(body: &Body, f: impl Fn(f32) -> f32) -> Body {
    Body {
        position: body.position.map(&f),
        orientation: body.orientation.map(&f),
        linear: body.linear.map(&f),
        angular: body.angular.map(&f),
        ..*body
    }
}

/// The value of a number after its way over a stream.
fn carried(format: StreamFormat) -> impl Fn(f32) -> f32 {
    move |value| decode(format, encode(format, value))
}

fn half(value: f32) -> f32 {
    f16::from_f32(value).to_f32()
}

#[test]
fn equal_moments_of_inertia_give_the_same_values_in_either_form() {
    let same = config(&FLOAT, FLOAT.numbers);
    let isotropic = run(same, &one_cube());
    let world = run(BoardConfig { inertia: Inertia::World, ..same }, &one_cube());
    // Zeros may differ in their sign: 0 x m added to -0 is +0.
    let values = |outcome: &Outcome| {
        let cube = outcome.bodies[1];
        let [p, v, w] = [cube.position, cube.linear, cube.angular];
        [p, v, w].map(|vector| vector.map(|value| (value + 0.0).to_bits()))
    };
    assert_eq!(values(&world), values(&isotropic));
    assert_eq!(world.impulse_sum, isotropic.impulse_sum);
}

/// One contact, by hand: lever arm (1, -1, 0), normal (0, -1, 0), so that the moment about B is
/// (0, 0, 1) and K times it the last column of K.
#[test]
fn a_moment_turns_a_body_about_the_axes_of_its_world_inertia() {
    let mut contact = ground_contact(1, [0.0, -1.0, 0.0]);
    contact.positions = [[0.0, -2.0, 0.0], [0.0; 3]];
    contact.contacts = [[1.0, -1.0, 0.0, 0.0]; 4];
    let bodies =
        vec![Body { shape: STATIC, ..AT_REST }, Body { linear: [0.0, -4.0, 0.0], ..AT_REST }];
    let scene = Step {
        integrate: false,
        iterations: [1, 0],
        inertias: vec![[0.0; 6], [8.0, 4.0, 1.0, 2.0, 0.5, 0.25]],
        ..Step::new(bodies, vec![contact])
    };
    let config = BoardConfig { inertia: Inertia::World, ..config(&FLOAT, FLOAT.numbers) };
    let outcome = run(config, &scene);
    // J = -1 / (1 + K.zz), of 4 m/s 2 N s.
    assert_eq!(outcome.impulse_sum, 2 << 20);
    assert_eq!(outcome.bodies[1].linear, [0.0, -2.0, 0.0]);
    assert_eq!(outcome.bodies[1].angular, [1.0, 0.5, 2.0]);
    assert_eq!(bits(&outcome.bodies[0]), bits(&AT_REST));
}

#[test]
fn binary16_results_beyond_its_range_are_infinite() {
    let body = Body { linear: [0.0, 60_000.0, -60_000.0], ..AT_REST };
    let scene = Step { gravity: [0.0, 20_000.0, -20_000.0], ..Step::new(vec![body], Vec::new()) };
    for numbers in [BINARY16_STREAMS, Numbers::BINARY16] {
        let [x, y, z] = run(config(&HALF, numbers), &scene).bodies[0].linear;
        assert_eq!(
            [x, y, z].map(f32::to_bits),
            [0.0, f32::INFINITY, f32::NEG_INFINITY].map(f32::to_bits)
        );
    }
}

/// A point mass that flies against the ground, one contact pass, no integration.
fn stopped(speed: f32, inverse_mass: f32) -> Step {
    let bodies =
        vec![Body { shape: STATIC, ..AT_REST }, Body { linear: [0.0, -speed, 0.0], ..AT_REST }];
    Step {
        shapes: vec![[0.0, 0.0], [inverse_mass, 0.0]],
        integrate: false,
        iterations: [1, 0],
        ..Step::new(bodies, vec![ground_contact(1, [0.0, -1.0, 0.0])])
    }
}

#[test]
fn a_static_body_rests_whatever_its_words_say() {
    for (profile, numbers) in [(&FLOAT, Numbers::F32), (&HALF, Numbers::BINARY16)] {
        let format = numbers.bodies;
        let mut scene = stopped(1.0, 1.0);
        let reference = run(config(&FLOAT, Numbers::F32), &received(&scene, format, format));
        for speed in [0.0, -4.0, 60_000.0] {
            (scene.bodies[0].linear, scene.bodies[0].angular) = ([speed; 3], [speed; 3]);
            let found = run(config(profile, numbers), &scene);
            let expected: Vec<_> =
                reference.bodies.iter().map(|body| mapped(body, carried(format))).collect();
            assert_eq!(states(&found.bodies), states(&expected), "{} {speed}", profile.name);
            assert_eq!(found.impulse_sum, reference.impulse_sum, "{} {speed}", profile.name);
        }
    }
}

#[test]
fn velocities_on_chip_are_rounded_when_they_are_loaded_and_written_back() {
    let speed = 1.0001;
    assert_ne!(half(speed).to_bits(), speed.to_bits());
    for (velocities, expected) in [(Precision::F32, speed), (Precision::Binary16, half(speed))] {
        let numbers = Numbers { velocities, ..Numbers::F32 };
        let scene = Step { collisions: Vec::new(), ..stopped(speed, 1.0) };
        let found = run(config(&FLOAT, numbers), &scene);
        assert_eq!(found.bodies[1].linear[1].to_bits(), (-expected).to_bits());
    }
    // Half the impulse: the remaining velocity is not a binary16 number.
    let scene = Step { friction: 0.0, ..stopped(1.0, 1.0) };
    let mut scene = Step { coefficient: 1.0, ..scene };
    scene.collisions[0].contacts = [[1.0, 0.0, 0.0, 0.1]; 4];
    let left = |velocities| {
        let numbers = Numbers { velocities, ..Numbers::F32 };
        run(config(&FLOAT, numbers), &scene).bodies[1].linear[1]
    };
    let exact = left(Precision::F32);
    assert_ne!(exact.to_bits(), half(exact).to_bits());
    assert_eq!(left(Precision::Binary16).to_bits(), half(exact).to_bits());
}

#[test]
fn impulses_on_chip_are_rounded_when_they_are_written_back() {
    let speed = 3.0005;
    for (impulses, expected) in [(Precision::F32, speed), (Precision::Binary16, half(speed))] {
        let numbers = Numbers { impulses, ..Numbers::F32 };
        let outcome = run(config(&FLOAT, numbers), &stopped(speed, 1.0));
        let units = f64::from(expected) * f64::from(1 << 20);
        let found = u32::try_from(outcome.impulse_sum).expect("a small number");
        assert_eq!(f64::from(found).to_bits(), units.floor().to_bits());
        assert_eq!(
            outcome.bodies[1].linear[1].to_bits(),
            0.0_f32.to_bits(),
            "stopped by all of it"
        );
    }
}

#[test]
fn rows_in_binary16_round_the_effective_mass_and_not_the_velocities() {
    let (speed, mass) = (2.7, 0.3);
    let numbers = Numbers { rows: Precision::Binary16, ..Numbers::F32 };
    let found = run(config(&FLOAT, numbers), &stopped(speed, mass)).bodies[1].linear[1];
    let effective = half(1.0 / half(mass));
    let expected = -speed + mass * (speed * effective);
    assert_eq!(found.to_bits(), expected.to_bits());
    assert_ne!(found.to_bits(), half(found).to_bits(), "the velocity is f32");
    let all = run(config(&FLOAT, BINARY16_INSIDE), &stopped(speed, mass)).bodies[1].linear[1];
    let loaded = half(speed);
    let expected = half(-loaded + half(half(mass) * half(loaded * effective)));
    assert_eq!(all.to_bits(), expected.to_bits());
}

#[test]
fn in_binary16_every_velocity_is_a_binary16_number_until_poses_in_f32_are_integrated() {
    let solved = Step { integrate: false, ..one_cube() };
    let outcome = run(config(&FLOAT, BINARY16_INSIDE), &solved);
    let cube = outcome.bodies[1];
    let velocities = |body: &Body| [body.linear, body.angular].map(|v| v.map(f32::to_bits));
    assert_eq!(velocities(&cube), velocities(&mapped(&cube, half)));
    // One rounding of the velocities is 2^-14 m/s.
    let reference = run(config(&FLOAT, Numbers::F32), &solved);
    let pairs = cube.linear.into_iter().zip(reference.bodies[1].linear);
    assert!(pairs.into_iter().all(|(found, expected)| (found - expected).abs() < 2e-3));
    let moved = run(config(&FLOAT, BINARY16_INSIDE), &one_cube()).bodies[1];
    let step = one_cube();
    for axis in 0..3 {
        let (p, v, g) = (step.bodies[1].position[axis], cube.linear[axis], step.gravity[axis]);
        assert_eq!(moved.position[axis].to_bits(), (p + v * step.time_step).to_bits());
        assert_eq!(moved.linear[axis].to_bits(), (v + g * step.time_step).to_bits());
    }
}

#[test]
fn binary16_keeps_its_subnormals() {
    let (normal, subnormal) = (2.0_f32.powi(-14), -2.0_f32.powi(-20));
    let body = Body { linear: [normal, subnormal, 0.0], ..AT_REST };
    let scene = Step { integrate: false, ..Step::new(vec![body], Vec::new()) };
    let [x, y, _] = run(config(&HALF, Numbers::BINARY16), &scene).bodies[0].linear;
    assert_eq!([x, y].map(f32::to_bits), [normal, subnormal].map(f32::to_bits));
}

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -8.0..8.0_f32,
        1 => (-20.0..15.0_f32).prop_map(|exponent| -exponent.exp2()),
        1 => Just(0.0),
    ]
}

fn vector() -> impl Strategy<Value = [f32; 3]> {
    [number(), number(), number()]
}

fn body() -> impl Strategy<Value = Body> {
    (vector(), vector(), vector(), vector(), 1.0..8.0_f32).prop_map(
        |(position, linear, angular, [x, y, z], w)| Body {
            position,
            linear,
            angular,
            orientation: [x, y, z, w],
            ..AT_REST
        },
    )
}

/// Body 0 is static; a collision of every moving body with one of a lower index, in any order.
fn scene() -> impl Strategy<Value = Step> {
    let collision = (
        (any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<bool>()),
        (vector(), [vector(), vector()]),
        prop::collection::vec((vector(), -0.1..0.02_f32), 4),
        1..=4_u32,
    );
    (prop::collection::vec(body(), 1..9), prop::collection::vec(collision, 0..12)).prop_map(
        |(moving, collisions)| {
            let bodies: Vec<_> = std::iter::once(Body {
                shape: STATIC,
                linear: [0.0; 3],
                angular: [0.0; 3],
                ..moving[0]
            })
            .chain(moving)
            .collect();
            let collisions = collisions
                .into_iter()
                .map(|((high, low, swap), (normal, positions), contacts, count)| {
                    let high = 1 + high.index(bodies.len() - 1);
                    let [high, low] = [high, low.index(high)]
                        .map(|index| u32::try_from(index).expect("a few bodies"));
                    let mut k =
                        contacts.iter().map(|([x, y, z], distance)| [*x, *y, *z, *distance]);
                    Collision {
                        bodies: if swap { [high, low] } else { [low, high] },
                        count,
                        normal,
                        positions,
                        contacts: std::array::from_fn(|_| k.next().expect("four")),
                    }
                })
                .collect();
            Step {
                shapes: vec![[0.0, 0.0], [1.0, 0.375]],
                time_step: 1.0 / 60.0,
                drift: 0.005,
                coefficient: 0.2,
                damping: 0.99,
                ..Step::new(bodies, collisions)
            }
        },
    )
}

/// The same with a warm start, impulses that go out, and empty collisions among the others.
fn warm_scene() -> impl Strategy<Value = Step> {
    let impulses = prop::array::uniform4(-0.3..0.7_f32);
    let of_collision = (prop::array::uniform2(impulses), 0..5_u32);
    (scene(), prop::collection::vec(of_collision, 12)).prop_map(|(mut step, given)| {
        for (collision, (impulses, chance)) in step.collisions.iter_mut().zip(given) {
            step.impulses.push(impulses);
            if chance == 0 {
                collision.count = 0;
            }
        }
        Step { impulses_out: true, ..step }
    })
}

/// The step as it reads after having been on the streams; a static body rests in any format.
fn received(step: &Step, bodies: StreamFormat, collisions: StreamFormat) -> Step {
    let f = carried(collisions);
    let body = |body: &Body| {
        let read = mapped(body, carried(bodies));
        let rest = Body { linear: [0.0; 3], angular: [0.0; 3], ..read };
        if body.shape == STATIC { rest } else { read }
    };
    Step {
        bodies: step.bodies.iter().map(body).collect(),
        collisions: step
            .collisions
            .iter()
            .map(|collision| Collision {
                normal: collision.normal.map(&f),
                positions: collision.positions.map(|position| position.map(&f)),
                contacts: collision.contacts.map(|contact| contact.map(&f)),
                ..*collision
            })
            .collect(),
        impulses: step.impulses.iter().map(|kinds| kinds.map(|of| of.map(&f))).collect(),
        ..step.clone()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Between the streams all numbers are f32: the result is that of `float` on the same words.
    #[test]
    fn what_goes_in_on_sixteen_bit_streams_is_what_is_solved(step in scene()) {
        let found = run(config(&HALF, BINARY16_STREAMS), &step);
        let reference = run(config(&FLOAT, Numbers::F32), &received(&step, BINARY16, BINARY16));
        let expected: Vec<_> =
            reference.bodies.iter().map(|body| mapped(body, carried(BINARY16))).collect();
        prop_assert_eq!(states(&found.bodies), states(&expected));
        prop_assert_eq!(found.impulse_sum, reference.impulse_sum);
    }

    #[test]
    fn the_streams_of_a_profile_do_not_change_a_bit(step in scene()) {
        for numbers in [Numbers::F32, BINARY16_INSIDE] {
            let on = |profile| run(config(profile, numbers), &step);
            let (float, naive) = (on(&FLOAT), on(&NAIVE));
            prop_assert_eq!(states(&float.bodies), states(&naive.bodies));
            prop_assert_eq!(float.impulse_sum, naive.impulse_sum);
        }
    }

    /// A warm step on `half` gives the bits of `float`, whose impulses are rounded to binary16
    /// before.
    #[test]
    fn impulses_that_come_in_sixteen_bits_are_solved_as_those_of_float(step in warm_scene()) {
        let words = received(&step, BINARY16, BINARY16);
        let half = run(config(&HALF, BINARY16_STREAMS), &step);
        let reference = run(config(&FLOAT, Numbers::F32), &words);
        let expected: Vec<_> =
            reference.bodies.iter().map(|body| mapped(body, carried(BINARY16))).collect();
        prop_assert_eq!(states(&half.bodies), states(&expected));
        prop_assert_eq!(&half.impulses, &reference.impulses);
    }

    /// All of `half` is in binary16; `float` computes so with words of f32. Poses in f32 would be
    /// integrated in f32.
    #[test]
    fn impulses_of_half_are_solved_in_binary16(step in warm_scene()) {
        let step = Step { integrate: false, ..step };
        let half = run(config(&HALF, HALF.numbers), &step);
        let reference = run(config(&FLOAT, BINARY16_INSIDE), &received(&step, BINARY16, BINARY16));
        let [found, expected] = [&half, &reference].map(|outcome| states(&outcome.bodies));
        prop_assert_eq!(found, expected);
        let words = |outcome: &Outcome| -> Vec<u32> {
            let words = outcome.impulses.iter().flat_map(|beat| beat.0);
            // A NaN has no sign and no payload in binary16.
            let plain = |word| if f32::from_bits(word).is_nan() { f32::NAN.to_bits() } else { word };
            words.map(plain).collect()
        };
        prop_assert_eq!(words(&half), words(&reference));
        prop_assert_eq!(half.impulse_sum, reference.impulse_sum);
    }

    /// `half` gives out binary16 impulses. The next step takes them in without a change of a bit.
    #[test]
    fn impulses_of_half_come_back_as_they_went_out(step in warm_scene()) {
        let step = Step { iterations: [1, 1], impulses_out: true, ..step };
        let outcome = run(config(&HALF, HALF.numbers), &step);
        for impulse in outcome.impulses.iter().flat_map(|beat| beat.0).map(f32::from_bits) {
            let back = half(impulse);
            prop_assert!(back.to_bits() == impulse.to_bits() || impulse.is_nan(), "{impulse}");
        }
    }
}
