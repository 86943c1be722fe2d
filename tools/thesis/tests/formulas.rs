//! The emulated board takes the cycles and the time of the formulas.

use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};
use pgs_thesis::estimate::{Records, StepCycles, StepShape, StepTime};
use scene::{Grid, Scene, SceneOptions};
use zynq_pgs::emulation::Build;
use zynq_pgs::order::Order;
use zynq_pgs::{Accelerator, BoardChoice, OpenOptions, StepParameters, StepReport};

/// A step of cubes that lie on the ground and on each other, in their order without hazards.
fn step(
    profile: &'static Profile,
    bandwidth: Bandwidth,
    grid: [u16; 3],
) -> (StepReport, StepShape) {
    let [x, y, z] = grid;
    let grid = Grid::new(x, y, z).expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a scene");
    let build = Build { profile: Some(profile), bandwidth: Some(bandwidth), ..Build::default() };
    let board = BoardChoice::Built(build);
    let mut accelerator =
        Accelerator::open(OpenOptions { board, ..OpenOptions::default() }).expect("a board");
    accelerator.set_shapes(scene.shapes()).expect("shapes");
    scene.detect();
    let (bodies, collisions) = scene.parts_mut();
    let parameters = StepParameters::thesis().with_order(Some(Order::AsGiven));
    let report = accelerator.step(bodies, collisions, &parameters).expect("a step");
    let shape = StepShape {
        contact_iterations: parameters.contact_iterations.into(),
        friction_iterations: parameters.friction_iterations.into(),
        ..StepShape::new(report.bodies, report.collisions)
    };
    (report, shape)
}

#[test]
fn cycles_without_stalls_and_waits_are_those_of_the_formula() {
    for profile in [&NAIVE, &FLOAT, &HALF] {
        for grid in [[1, 1, 1], [3, 2, 3], [6, 4, 5]] {
            let (report, shape) = step(profile, Bandwidth::Unlimited, grid);
            let cycles =
                StepCycles::new(&profile.default_variant(), Records::Streamed, &shape).total;
            assert_eq!(report.cycles.work, cycles, "{} {grid:?}", profile.name);
        }
    }
}

#[test]
fn under_a_bandwidth_limit_a_large_step_takes_the_time_by_formula() {
    // Cubes side by side: no two collisions share a moving body, and none stalls.
    let grid = [100, 1, 90];
    for bandwidth in [Bandwidth::ZCU102_SUSTAINED, Bandwidth::BytesPerSecond(4_000_000_000)] {
        let (report, shape) = step(&FLOAT, bandwidth, grid);
        let expected =
            StepTime::new(&FLOAT.default_variant(), Records::Streamed, &shape, bandwidth).seconds;
        let found = report.modelled_time().as_secs_f64();
        assert!((found / expected - 1.0).abs() < 0.02, "{found} s, by formula {expected} s");
    }
}
