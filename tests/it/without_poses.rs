//! Steps that integrate nothing: where the board can, no poses travel, and nothing else differs.
#![cfg(feature = "emulation")]

use crate::common::random_scene::{scene, shapes};
use crate::common::{at_rest, bits, open_with, ordered, row};
use bitstream_model::BoardConfig;
use bitstream_model::interface::extension::Extensions;
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, NAIVE, Profile};
use zynq_pgs::order::Order;
use zynq_pgs::{Body, Collision, Shape, StepParameters, StepReport, Velocity, Writer};

/// The numbers of the bodies after a step of some kind, and its report.
type Stepped = (Vec<u32>, StepReport);

/// Takes the step on a board that can do without poses, and on one that cannot: in one piece, prepared beside
/// another, and written by a narrow phase.
fn on_both(
    config: BoardConfig,
    shapes: &[Shape],
    (bodies, collisions): &(Vec<Body>, Vec<Collision>),
    parameters: &StepParameters,
) -> [Stepped; 2] {
    let older = Extensions { velocities_only: false, ..Extensions::ALL };
    [Extensions::ALL, older].map(|extensions| {
        let config = BoardConfig { extensions, ..config };
        let (board, mut accelerator) = open_with(config, None, shapes);
        let [mut whole, mut first, mut second, mut written] = [(); 4].map(|()| bodies.clone());
        let report = accelerator.step(&mut whole, collisions, parameters).expect("a good step");

        let mut step = accelerator.submit(&first, collisions, parameters).expect("it starts");
        let next = step.prepare(&second, collisions, parameters).expect("it is packed");
        let (ended, next) = step.wait_and_start(&mut first, &next);
        ended.expect("it ends");
        next.expect("it starts").wait(&mut second).expect("it ends");
        assert_eq!([bits(&first), bits(&second)], [bits(&whole), bits(&whole)]);

        let narrow_phase = |records: &mut Writer<'_>| {
            collisions.iter().for_each(|collision| records.push(collision));
        };
        let count = collisions.len();
        let step = accelerator.write(&written, count, parameters, narrow_phase);
        let step = accelerator.start(&step.expect("it is packed")).expect("it starts");
        step.wait(&mut written).expect("it ends");
        assert_eq!(bits(&written), bits(&whole));
        assert_eq!(board.violations(), []);
        (bits(&whole), report)
    })
}

fn isotropic() -> Vec<Shape> {
    let equal = |shape: Shape| Shape::isotropic(shape.inverse_mass, shape.inverse_inertia[0]);
    shapes().map(equal).to_vec()
}

/// Bytes of `bodies` records of two rows. In f32 a row is a beat; in `half` it is half a beat, and groups of
/// five beats are whole.
fn bytes_of_two_rows(profile: &Profile, bodies: u64) -> u64 {
    let beats = if *profile == HALF { bodies.next_multiple_of(5) } else { 2 * bodies };
    16 * beats
}

#[test]
fn a_step_that_integrates_nothing_moves_half_the_beats_of_the_bodies() {
    let random = scene(3);
    let cubes =
        |count| row(count, 3.0, |x| Velocity { linear: [x, -1.0, 0.5], ..Velocity::default() });
    let moving = Body {
        velocity: Velocity { linear: [1.0, 2.0, 3.0], angular: [0.5; 3] },
        ..at_rest([1.0; 3], 1)
    };
    let parameters = ordered(Order::AsGiven).with_integrate(false);
    for profile in [&FLOAT, &NAIVE, &HALF] {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        for scene in [
            (vec![moving], Vec::new()),
            (vec![moving; 2], Vec::new()),
            cubes(4),
            cubes(40),
            random.clone(),
        ] {
            let [(found, new), (expected, old)] =
                on_both(config, &isotropic(), &scene, &parameters);
            assert_eq!(found, expected, "{}", profile.name);
            let bodies = scene.0.len() as u64;
            let two_rows = bytes_of_two_rows(profile, bodies);
            assert_eq!(new.bytes_from_device, two_rows, "{}", profile.name);
            assert_eq!(old.bytes_to_device - new.bytes_to_device, two_rows, "{}", profile.name);
            assert!(bodies <= 2 || new.cycles.work < old.cycles.work);
        }
    }
}

#[test]
fn other_extensions_work_without_poses() {
    let (mut bodies, collisions) = scene(5);
    // A static body that moves.
    bodies[0].velocity.linear = [0.5, 0.0, 0.0];
    let solved = ordered(Order::AsGiven).with_integrate(false).with_spin_damping(0.25);
    let parameters = solved.with_kinematic(true).with_impulses_out(true);
    // More shapes than the table holds.
    let many: Vec<Shape> = shapes().into_iter().cycle().take(100).collect();
    for shapes in [shapes().to_vec(), many] {
        for profile in [&FLOAT, &NAIVE] {
            let config = BoardConfig { profile, inertia: Inertia::World, ..BoardConfig::default() };
            let scene = (bodies.clone(), collisions.clone());
            let [(found, new), (expected, old)] = on_both(config, &shapes, &scene, &parameters);
            assert_eq!(found, expected, "{}", profile.name);
            assert_eq!(old.bytes_from_device - new.bytes_from_device, 32 * bodies.len() as u64);
        }
    }
    let frictions: Vec<Shape> = isotropic().into_iter().map(|it| it.with_friction(0.5)).collect();
    bodies[0].velocity = Velocity::default();
    for profile in [&HALF] {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let scene = (bodies.clone(), collisions.clone());
        let parameters = solved.with_shape_friction(true);
        let [(found, _), (expected, _)] = on_both(config, &frictions, &scene, &parameters);
        assert_eq!(found, expected, "{}", profile.name);
    }
}

#[test]
fn an_integrated_step_keeps_its_poses() {
    let scene = row(7, 3.0, |_| Velocity::default());
    {
        let config = BoardConfig::default();
        let parameters = ordered(Order::AsGiven);
        let [(found, new), (expected, old)] = on_both(config, &isotropic(), &scene, &parameters);
        assert_eq!(found, expected);
        assert_eq!(new.bytes_from_device, old.bytes_from_device);
        assert_eq!(new.bytes_to_device, old.bytes_to_device);
    }
}
