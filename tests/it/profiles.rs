//! Takes the same scene through the driver on every profile, and tests their common results, the
//! costs of each, and the refusals of each.
#![cfg(feature = "emulation")]

use crate::common::{at_rest, bits, open, ordered, standing};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, NAIVE, PROFILES, Profile};
use scene::{Scene, SceneOptions};
use zynq_pgs::error::Aftermath;
use zynq_pgs::order::Order;
use zynq_pgs::{
    Body, Collision, Contact, Error, Fault, Shape, StepParameters, StepReport, Velocity,
};

fn of(profile: &'static Profile) -> BoardConfig {
    BoardConfig { profile, ..BoardConfig::default() }
}

/// The outcome of a step of a small pile that stands on the ground.
struct Stepped {
    bodies: Vec<Body>,
    report: StepReport,
}

fn step(config: BoardConfig) -> Stepped {
    let (board, mut accelerator) = open(config);
    assert_eq!(accelerator.capabilities().variant, config.variant());
    let grid = "3x3x3".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a small scene");
    // Off the grid, so that coordinates have more digits than sixteen bits hold.
    for (index, body) in (0_u32..).zip(scene.bodies_mut()).skip(1) {
        let digit = u16::try_from(index * 7919 % 101).expect("below 101");
        let off = f32::from(digit) / 10_007.0;
        body.pose.position[0] += off;
        body.pose.position[2] -= 1.7 * off;
        body.velocity = Velocity { linear: [off, -1.0 - off, 3.3 * off], angular: [0.0, off, 0.0] };
    }
    scene.detect();
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    let (bodies, collisions) = scene.parts_mut();
    // One order on every design: otherwise the results could not be compared.
    let report = accelerator
        .step(bodies, collisions, &ordered(Order::AsGiven))
        .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
    drop(accelerator);
    assert_eq!(board.violations(), [], "{}", config.profile.name);
    Stepped { bodies: scene.bodies().to_vec(), report }
}

/// The largest difference of a component of position and of velocity.
fn difference(left: &[Body], right: &[Body]) -> (f32, f32) {
    let largest = |of: fn(&Body) -> Vec<f32>| {
        let pairs = left.iter().zip(right).flat_map(|(l, r)| of(l).into_iter().zip(of(r)));
        pairs.map(|(l, r)| (l - r).abs()).fold(0.0, f32::max)
    };
    let velocity =
        |body: &Body| [body.velocity.linear.to_vec(), body.velocity.angular.to_vec()].concat();
    (largest(|body| body.pose.position.to_vec()), largest(velocity))
}

#[test]
fn naive_gives_the_bits_of_float() {
    assert!(bits(&step(of(&NAIVE)).bodies) == bits(&step(of(&FLOAT)).bodies));
}

/// Cubes are the same about any axes: the tensors' zeros change no number but the sign of a zero.
#[test]
fn world_inertia_changes_nothing_for_cubes() {
    let world = BoardConfig { inertia: Inertia::World, ..of(&FLOAT) };
    let (position, velocity) = difference(&step(world).bodies, &step(of(&FLOAT)).bodies);
    assert!(position == 0.0 && velocity == 0.0, "{position} {velocity}");
}

/// The pile stands within 8 m of the origin and lands at 1 m/s.
#[test]
fn sixteen_bits_stay_near_float() {
    let float = step(of(&FLOAT)).bodies;
    let near = |config: BoardConfig, position: f32, velocity: f32| {
        let (p, v) = difference(&step(config).bodies, &float);
        let name = config.profile.name;
        assert!(p > 0.0 || v > 0.0, "{name}: sixteen bits that round nothing");
        assert!(p <= position && v <= velocity, "{name}: {p} m, {v} m/s");
    };
    // Positions in binary16 are rounded by half of 2^-8 m at 4 to 8 m, on input and on output.
    near(of(&HALF), 4e-3, 1e-2);
}

/// Bytes by hand from the record table and the stripes, 16 a beat: B bodies, C collisions.
#[test]
fn a_step_costs_the_bytes_and_doorbells_of_its_profile() {
    for profile in PROFILES {
        let StepReport {
            bodies, collisions, bytes_to_device, bytes_from_device, doorbells, ..
        } = step(of(profile)).report;
        assert!(collisions % 2 == 1 || bodies % 5 != 0, "the pile needs padding");
        let five = |beats: u64| beats.next_multiple_of(5);
        let (beats_in, beats_out, channels) = match profile.name {
            "naive" => (4 * bodies + 8 * 7 * collisions, 4 * bodies, 1),
            "float" => (4 * bodies + 8 * 7 * collisions, 4 * bodies, 4),
            "half" => {
                let pairs = collisions.div_ceil(2);
                (2 * five(bodies) + 8 * 7 * pairs, five(2 * bodies), 3)
            }
            other => panic!("{other}: its bytes are not written down here"),
        };
        assert_eq!((bytes_to_device, bytes_from_device), (16 * beats_in, 16 * beats_out));
        // Tails each way, and the start.
        assert_eq!(doorbells, 2 * channels + 1, "{}", profile.name);
    }
}

/// A row of cubes on the ground, with every number of them: odd numbers leave half an issue and
/// part of a group.
#[test]
fn any_number_of_bodies_and_collisions_goes_through_every_profile() {
    for profile in PROFILES {
        for inertia in profile.inertias().iter().copied() {
            let (board, mut accelerator) = open(BoardConfig { inertia, ..of(profile) });
            accelerator
                .set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)])
                .expect("shapes that fit");
            for cubes in [1, 2, 3, 4, 5, 6, 7, 30, 1] {
                let (mut bodies, collisions) = row(cubes);
                accelerator
                    .step(&mut bodies, &collisions, &StepParameters::default())
                    .unwrap_or_else(|error| {
                        panic!("{} {cubes}: {error:?}: {:?}", profile.name, board.violations())
                    });
                assert_eq!(bits(&bodies[..1]), bits(&row(cubes).0[..1]), "the ground stays");
                for body in &bodies[1..] {
                    let [_, y, _] = body.velocity.linear;
                    assert!((-0.5..0.1).contains(&y), "{}: stopped, {y} m/s", profile.name);
                }
            }
            drop(accelerator);
            assert_eq!(board.violations(), []);
        }
    }
}

fn row(cubes: u32) -> (Vec<Body>, Vec<Collision>) {
    let velocity = Velocity { linear: [0.0, -1.0, 0.0], angular: [0.0; 3] };
    let mut bodies = vec![at_rest([0.0, -4.0, 0.0], 0)];
    let mut collisions = Vec::new();
    for cube in 1..=cubes {
        let x = 0.25 * f32::from(u16::try_from(cube).expect("a small scene"));
        bodies.push(Body { velocity, ..at_rest([x, 1.0, 0.0], 1) });
        collisions.push(standing([0, cube], x, 0.0, 0.0));
    }
    (bodies, collisions)
}

/// The whole text of a refusal, with nothing sent.
fn refused(config: BoardConfig, bodies: &mut [Body], collisions: &[Collision]) -> String {
    let (board, mut accelerator) = open(config);
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("shapes that fit");
    let before = (board.counts().register_reads, board.counts().register_writes);
    let as_before = bits(bodies);
    let error = accelerator
        .step(bodies, collisions, &StepParameters::default())
        .expect_err("something that this profile cannot carry");
    assert!(error.is_input(), "{error}");
    assert_eq!((board.counts().register_reads, board.counts().register_writes), before);
    assert!(bits(bodies) == as_before);
    error.to_string()
}

#[test]
fn a_value_beyond_the_format_is_refused_with_the_profiles_that_could() {
    let (mut bodies, collisions) = row(3);
    bodies[2].pose.position[0] = 70_000.0;
    assert_eq!(
        refused(of(&HALF), &mut bodies, &collisions),
        "body 2: position[0] is 70000, but this bitstream holds bodies in binary16, which ends at \
         65504: bring it into range, or load another (profiles that could: naive, float)"
    );
}

/// A contact far out on a body: 1 + 0.4 x 380^2 = 57,761, and with 410 m 67,241.
#[test]
fn a_contact_is_solved_or_refused_and_never_left_out() {
    let (bodies, collisions) = row(1);
    let there = |arm: f32| {
        let (mut bodies, mut collision) = (bodies.clone(), collisions[0]);
        bodies[1].pose.position = [0.0; 3];
        bodies[1].velocity.linear = [0.0, -4.0, 0.0];
        collision.count = 1;
        collision.contacts[0] = Contact { point: [arm, 0.0, 0.0], distance: 0.0 };
        (bodies, [collision])
    };
    for config in [of(&HALF), of(&FLOAT)] {
        let (board, mut accelerator) = open(config);
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
        accelerator.set_shapes(&shapes).expect("shapes that fit");
        let (mut bodies, collisions) = there(380.0);
        let parameters = StepParameters::default();
        accelerator.step(&mut bodies[..], &collisions[..], &parameters).expect("within range");
        // 4 m/s over an arm of 380 m.
        let spin = bodies[1].velocity.angular[2];
        assert!((spin - 4.0 / 380.0).abs() < 1e-3, "{spin}");
        assert_eq!(board.violations(), []);
    }
    let (mut bodies, collisions) = there(410.0);
    let text = refused(of(&HALF), &mut bodies, &collisions);
    assert!(text.starts_with("collision 0, contact point 0: inverse effective mass[0]"), "{text}");
    assert!(text.ends_with("(profiles that could: naive, float)"), "{text}");
}

#[test]
fn counts_beyond_indices_and_memory_are_refused_with_the_profiles_that_could() {
    let (few, collisions) = row(1);
    let mut bodies = vec![few[1]; 65_537];
    bodies[0] = few[0];
    assert_eq!(
        refused(of(&HALF), &mut bodies, &collisions),
        "found 65537 bodies, the bitstream takes at most 65536: give fewer, or load another \
         (profiles that could: naive, float)"
    );
    // 2 x 24 + 300,000 x 16 = 4,800,048 bytes; (4,194,304 - 48) / 16 = 262,141. The collisions
    // alone are beyond float's 262,144.
    let mut bodies = few;
    let text = refused(of(&FLOAT), &mut bodies, &vec![collisions[0]; 300_000]);
    assert!(
        text.starts_with("found 300000 collisions, the bitstream takes at most 262144"),
        "{text}"
    );
    assert!(text.ends_with("(profiles that could: half)"), "{text}");
    let text = refused(of(&FLOAT), &mut bodies, &vec![collisions[0]; 262_142]);
    assert!(text.contains("need 4194320 bytes") && text.contains("there are 4194304"), "{text}");
    assert!(text.contains("at most 262141 collisions fit"), "{text}");
    assert!(text.ends_with("(profiles that could: half)"), "{text}");
}

/// A result beyond 65,504 comes back as infinity.
#[test]
fn results_that_sixteen_bits_cannot_hold_are_a_fault_and_change_nothing() {
    let (board, mut accelerator) = open(of(&HALF));
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("shapes that fit");
    let (mut bodies, _) = row(3);
    bodies[2].velocity.linear[0] = 65_400.0;
    let before = bits(&bodies);
    // A sixtieth of 60,000 m/s² is 1,000 m/s.
    let parameters = StepParameters::default();
    let none: &[Collision] = &[];
    let mut hard = parameters;
    hard.gravity = [60_000.0, 0.0, 0.0];
    let error = accelerator.step(&mut bodies, none, &hard).expect_err("66,400 m/s");
    let Error::Step { fault, aftermath: Aftermath::Untouched, .. } = &error else {
        panic!("{error}")
    };
    assert!(matches!(**fault, Fault::NotFinite { body: 2 }), "{fault}");
    assert!(bits(&bodies) == before);
    accelerator.step(&mut bodies, none, &parameters).expect("within range");
    assert_eq!(board.violations(), []);
}
