//! Boards whose accelerator is another process or runs in lock step with the model. The model plays
//! the hardware, with planted flaws: no simulator need be built.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use bitstream_model::external::{
    Difference, DifferencePlace, ExternalAccelerator, ExternalError, LockStep, ModelAccelerator,
    SimulatorProcess,
};
use bitstream_model::{BoardConfig, EmulatedBoard};
use cosim::flaws::{Flawed, Flaws};
use cosim::packets::packets;
use cosim::{accesses, outcome, random};
use pgs_interface::fence::Fence;
use pgs_interface::profile::{FLOAT, HALF, Inertia, Variant};
use pgs_interface::record::result;
use step_folder::folder::Folder;
use zynq_pgs::{
    Accelerator, BoardChoice, Error, Impulses, OpenOptions, Shape, StepParameters, WarmCollisions,
};

const PLAIN: Variant = FLOAT.default_variant();
const FORMS: [Variant; 3] =
    [PLAIN, Variant { inertia: Inertia::World, ..PLAIN }, HALF.default_variant()];

fn config() -> BoardConfig {
    let fence = Some(Fence::default());
    BoardConfig { fence, ..BoardConfig::default() }
}

fn lock_step(variant: Variant, flaws: Flaws) -> LockStep {
    let Variant { profile, inertia, .. } = variant;
    let config = BoardConfig { profile, inertia, ..config() };
    let model = ModelAccelerator::new(&config).expect("a model");
    LockStep::new(&config, Box::new(Flawed::new(model, flaws)), None).expect("a lock step")
}

fn golden(name: &str) -> Folder {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden").join(name);
    Folder::load(&path).expect("a folder of a recorded step")
}

/// A program that runs the model as a simulator with these options.
fn program(folder: &Path, options: &str) -> PathBuf {
    let path = folder.join("simulator");
    let cosim = env!("CARGO_BIN_EXE_cosim");
    let text = format!("#!/bin/sh\nexec '{cosim}' model {options} \"$@\"\n");
    // Another process writes the file. Written here, a child that another test starts at this
    // moment would inherit the open file, and the kernel refuses to execute a file open for
    // writing.
    let writes = "printf %s \"$1\" > \"$0\" && chmod 755 \"$0\"";
    let written = Command::new("sh").args(["-c", writes]).arg(&path).arg(text).status();
    assert!(written.expect("a shell").success());
    path
}

fn board(accelerator: Box<dyn ExternalAccelerator>) -> EmulatedBoard {
    EmulatedBoard::with_accelerator(config(), accelerator).expect("a board")
}

/// Steps a folder; the error, and whether the bodies are as before.
fn step(board: &EmulatedBoard, folder: &Folder) -> (Option<Error>, bool) {
    let choice = BoardChoice::Emulated(board.cpu_port());
    let mut accelerator =
        Accelerator::open(OpenOptions { board: choice, ..OpenOptions::default() }).expect("open");
    accelerator.set_shapes(&folder.shapes).expect("shapes");
    let mut bodies = folder.bodies.clone();
    let parameters: &StepParameters = &folder.parameters;
    let error = accelerator.step(&mut bodies, &folder.collisions, parameters).err();
    (error, bodies == folder.bodies)
}

#[test]
fn equals_run_random_steps_in_lock_step_without_a_difference() {
    for variant in FORMS {
        let mut both = lock_step(variant, Flaws::default());
        for seed in 1..=100 {
            let case = random::case(seed, variant);
            let beats = packets(&case.scene, case.fault);
            outcome::run(&mut both, &case.scene, &beats).unwrap_or_else(|e| panic!("{seed}: {e}"));
        }
    }
}

#[test]
fn equals_take_random_register_accesses_alike() {
    for variant in FORMS {
        let mut both = lock_step(variant, Flaws::default());
        for seed in 1..=50 {
            let ended = accesses::run(&mut both, variant, seed);
            assert!(ended.unwrap_or_else(|e| panic!("{seed}: {e}")), "{seed}");
        }
    }
}

#[test]
fn a_wrong_word_is_named_with_its_record_and_its_values() {
    let folder = golden("two_cubes");
    let scene = cosim::recorded::scene(&folder, PLAIN);
    let mut both = lock_step(PLAIN, Flaws { wrong: Some(1), ..Flaws::default() });
    let error = outcome::run(&mut both, &scene, &packets(&scene, None)).expect_err("a difference");
    let ExternalError::Difference(difference) = error else { panic!("{error}") };
    let Difference { place, cycle, model, hardware, .. } = *difference;
    assert_eq!(place, DifferencePlace::Word { record: 1, row: result::LINEAR, word: 0 });
    assert_eq!(model ^ hardware, 1);
    assert!(cycle > 1000, "{cycle}");
}

#[test]
fn the_driver_steps_on_an_accelerator_in_another_process() {
    let files = tempfile::tempdir().expect("a folder");
    let path = program(files.path(), "");
    for both in [false, true] {
        let mut config = config();
        let mut accelerator: Box<dyn ExternalAccelerator> =
            Box::new(SimulatorProcess::start_for(&mut config, &path).expect("a simulator"));
        if both {
            accelerator = Box::new(LockStep::new(&config, accelerator, None).expect("a lock step"));
        }
        let board = board(accelerator);
        let (error, untouched) = step(&board, &golden("two_cubes"));
        assert!(error.is_none(), "{error:?} {:?}", board.accelerator_error());
        assert!(!untouched);
    }
}

/// The impulses of one step go into the next one, both through registers and DMA.
#[test]
fn the_driver_steps_warm_on_an_accelerator_in_another_process() {
    let files = tempfile::tempdir().expect("a folder");
    let path = program(files.path(), "");
    let folder = golden("pile5_step60");
    let mut ends = Vec::new();
    for external in [false, true] {
        let mut config = config();
        let board = if external {
            let simulator = SimulatorProcess::start_for(&mut config, &path).expect("a simulator");
            let both = LockStep::new(&config, Box::new(simulator), None).expect("a lock step");
            board(Box::new(both))
        } else {
            EmulatedBoard::new(config).expect("a board")
        };
        let choice = BoardChoice::Emulated(board.cpu_port());
        let options = OpenOptions { board: choice, ..OpenOptions::default() };
        let mut accelerator = Accelerator::open(options).expect("open");
        accelerator.set_shapes(&folder.shapes).expect("shapes");
        let mut bodies = folder.bodies.clone();
        let parameters = folder.parameters.with_impulses_out(true);
        accelerator.step(&mut bodies, &folder.collisions, &parameters).expect("a cold step");
        let impulses = accelerator.impulses().to_vec();
        assert!(impulses.iter().any(|impulses| *impulses != Impulses::ZERO));
        let warm = WarmCollisions { collisions: &folder.collisions[..], impulses: &impulses };
        let parameters = parameters.with_warm_start(true);
        accelerator.step(&mut bodies, &warm, &parameters).expect("a warm step");
        ends.push(bodies);
    }
    assert_eq!(ends[0], ends[1]);
}

/// More shapes than the table has, each with another inertia about each axis: the masses are
/// streamed.
#[test]
fn the_driver_streams_inertias_and_masses_to_an_accelerator_in_another_process() {
    let files = tempfile::tempdir().expect("a folder");
    let path = program(files.path(), "--inertia world");
    let folder = golden("pile5_step60");
    let shapes = (1_u8..=100).map(|n| {
        let size = f32::from(n);
        let inverse_inertia = [6.0, 3.0, 2.0].map(|k: f32| k / size);
        Shape { inverse_inertia, ..Shape::isotropic(1.0 / size, 0.0) }
    });
    let shapes: Vec<Shape> = [Shape::STATIC].into_iter().chain(shapes).collect();
    let mut before = folder.bodies.clone();
    for (body, shape) in before.iter_mut().zip((1..=100).cycle()) {
        let moves = folder.shapes[body.shape as usize].inverse_mass > 0.0;
        body.shape = if moves { shape } else { 0 };
    }
    let mut ends = Vec::new();
    for external in [false, true] {
        let mut config = BoardConfig { inertia: Inertia::World, ..config() };
        let board = if external {
            let simulator = SimulatorProcess::start_for(&mut config, &path).expect("a simulator");
            let both = LockStep::new(&config, Box::new(simulator), None).expect("a lock step");
            EmulatedBoard::with_accelerator(config, Box::new(both)).expect("a board")
        } else {
            EmulatedBoard::new(config).expect("a board")
        };
        let choice = BoardChoice::Emulated(board.cpu_port());
        let options = OpenOptions { board: choice, ..OpenOptions::default() };
        let mut accelerator = Accelerator::open(options).expect("open");
        accelerator.set_shapes(&shapes).expect("shapes");
        let mut bodies = before.clone();
        accelerator.step(&mut bodies, &folder.collisions, &folder.parameters).expect("a step");
        ends.push(bodies);
    }
    assert_ne!(ends[0], before);
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn a_simulator_of_the_other_inertia_is_refused() {
    let files = tempfile::tempdir().expect("a folder");
    for (built, asked) in [("isotropic", Inertia::World), ("world", Inertia::Isotropic)] {
        let path = program(files.path(), &format!("--inertia {built}"));
        let mut config = BoardConfig { inertia: asked, ..config() };
        let error = SimulatorProcess::start_for(&mut config, &path).expect_err("the other inertia");
        assert!(error.to_string().contains(&format!("built for {built} inertia")), "{error}");
    }
}

#[test]
fn a_simulator_that_dies_or_hangs_in_a_step_is_named_and_the_bodies_stay() {
    let files = tempfile::tempdir().expect("a folder");
    let folder = golden("two_cubes");
    for (options, named) in
        [("--dies-after 5", "has ended in the middle"), ("--hangs-after 5", "has not answered for")]
    {
        let path = program(files.path(), options);
        let mut simulator = SimulatorProcess::start(&path).expect("a simulator");
        simulator.set_deadline(Duration::from_millis(500));
        let dead = board(Box::new(simulator));
        let (error, untouched) = step(&dead, &folder);
        assert!(error.is_some() && untouched);
        let reason = dead.accelerator_error().expect("a reason");
        assert!(reason.contains(named), "{reason}");
    }
    // Another one is not disturbed.
    let simulator = SimulatorProcess::start(&program(files.path(), "")).expect("a simulator");
    assert!(step(&board(Box::new(simulator)), &folder).0.is_none());
}

#[test]
fn a_difference_ends_the_step_and_the_bodies_stay() {
    let flaws = Flaws { wrong: Some(1), ..Flaws::default() };
    let board = board(Box::new(lock_step(PLAIN, flaws)));
    let (error, untouched) = step(&board, &golden("two_cubes"));
    assert!(error.is_some() && untouched);
    let reason = board.accelerator_error().expect("a reason");
    assert!(reason.contains("results, record 1, linear velocity, word 0"), "{reason}");
}
