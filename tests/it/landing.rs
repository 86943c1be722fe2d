//! Tests that a dropped pile lands: impulses are zero in free fall and not after, no body changes
//! its shape, and the board records no violation.
#![cfg(feature = "emulation")]

use bitstream_model::{BoardConfig, EmulatedBoard};
use scene::{Scene, SceneOptions, kinetic_energy};
use zynq_pgs::{Accelerator, BoardChoice, Body, OpenOptions, StepParameters, StepReport};

/// A pile of 3 x 3 x 3 cubes, dropped from 0.5 m: it lands after about 19 of 60 steps.
fn drop_a_pile() -> (Vec<StepReport>, Vec<Body>, Vec<usize>) {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board as by default");
    let options =
        OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("the emulated board");
    let grid = "3x3x3".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.5 };
    let mut scene = Scene::new(&options).expect("a small scene");
    accelerator.set_shapes(scene.shapes()).expect("they fit");

    let mut reports = Vec::new();
    let mut on_the_ground = Vec::new();
    for _ in 0..60 {
        on_the_ground.push(scene::ground_pairs(scene.detect()));
        let (bodies, collisions) = scene.parts_mut();
        let report = accelerator.step(bodies, collisions, &StepParameters::thesis());
        reports.push(report.expect("a step"));
    }
    assert_eq!(board.violations(), []);
    assert!(kinetic_energy(scene.bodies(), scene.shapes()) < 10.0, "it has come to rest");
    (reports, scene.bodies().to_vec(), on_the_ground)
}

#[test]
fn impulses_are_zero_before_the_landing_and_not_after() {
    let (reports, bodies, on_the_ground) = drop_a_pile();
    let landing = on_the_ground.iter().position(|pairs| *pairs > 0).expect("it lands");
    // 0.5 m of free fall, less the 0.02 m at which pairs are kept, take 18.8 steps of 1/60 s.
    assert!((17..=20).contains(&landing), "landed at step {landing}");
    let impulses: Vec<_> =
        reports.iter().map(|report| report.impulse_sum.expect("the board counts them")).collect();
    assert!(impulses[..landing].iter().all(|sum| *sum == 0.0), "{impulses:?}");
    // Nine columns of three cubes of 1 kg, held up against gravity for 1/60 s at their nine and
    // eighteen more contacts: 9 x (3 + 2 + 1) x 9.8 / 60 = 8.8 N s. Settling adds to it.
    assert!(impulses[landing + 10..].iter().all(|sum| *sum > 4.0), "{impulses:?}");
    let lowest = bodies[1..].iter().map(|body| body.pose.position[1]).fold(f32::MAX, f32::min);
    assert!((0.9..1.1).contains(&lowest), "the lowest cube's centre is at {lowest} m");
}

#[test]
fn two_runs_give_identical_bits() {
    let bits = |bodies: Vec<Body>| -> Vec<u32> {
        bodies
            .iter()
            .flat_map(|body| {
                let zynq_pgs::Pose { position, orientation } = body.pose;
                let zynq_pgs::Velocity { linear, angular } = body.velocity;
                position.into_iter().chain(orientation).chain(linear).chain(angular)
            })
            .map(f32::to_bits)
            .collect()
    };
    let (_, first, _) = drop_a_pile();
    let (_, second, _) = drop_a_pile();
    assert_eq!(bits(first), bits(second));
}

/// Kinetic and potential energy, J.
fn energy(scene: &Scene, parameters: &StepParameters) -> f64 {
    let (bodies, shapes) = (scene.bodies(), scene.shapes());
    let StepParameters { gravity, time_step, .. } = *parameters;
    let kinetic = scene::kinetic_energy_before_gravity(bodies, shapes, gravity, time_step);
    kinetic.total() + scene::potential_energy(bodies, shapes, gravity)
}

/// The kinetic energy of a pile rises long after it has landed: the cubes along two sides of the
/// top layer have their centre above the edge of the cube below. They topple and fall. All other
/// cubes stay where they are, and the total energy only falls.
#[test]
fn the_unsupported_rim_of_a_pile_topples_and_nothing_gains_energy() {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board as by default");
    let options =
        OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("the emulated board");
    let grid = "4x4x4".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a small scene");
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    let start = scene.bodies().to_vec();
    let parameters =
        StepParameters::thesis().with_contact_iterations(10).with_friction_iterations(10);

    let mut energies = Vec::new();
    for _ in 0..600 {
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        accelerator.step(bodies, collisions, &parameters).expect("a step");
        energies.push(energy(&scene, &parameters));
    }
    // Correcting penetrations lifts the pile by some hundredths of a millimetre now and then.
    let most = energies.windows(60).map(|part| part[59] - part[0]).fold(f64::MIN, f64::max);
    assert!(most < 1.0, "energy rises by {most} J within a second");

    let moved = |index: usize| {
        let [from, to] = [start[index].pose.position, scene.bodies()[index].pose.position];
        (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f32>().sqrt()
    };
    let top = |index: usize| start[index].pose.position[1] > 6.0;
    let on_an_edge = |index: usize| {
        let [x, _, z] = start[index].pose.position;
        top(index) && (x == 0.0 || z == 0.0)
    };
    let fallen: Vec<usize> = (1..start.len()).filter(|index| moved(*index) > 1.0).collect();
    let expected: Vec<usize> = (1..start.len()).filter(|index| on_an_edge(*index)).collect();
    assert_eq!(expected.len(), 7);
    assert_eq!(fallen, expected);
    let others = (1..start.len()).filter(|index| !on_an_edge(*index)).map(moved);
    assert!(others.fold(0.0, f32::max) < 0.05, "the others stay");
    let kinetic = scene::kinetic_energy_before_gravity(
        scene.bodies(),
        scene.shapes(),
        parameters.gravity,
        parameters.time_step,
    );
    assert!(kinetic.total() < 0.5, "{} J", kinetic.total());
}
