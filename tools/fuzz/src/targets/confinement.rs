//! Takes random steps of the driver on a board that checks every access.

use bitstream_model::EmulatedBoard;
use zynq_pgs::{Accelerator, BoardChoice, Error, Fault, OpenOptions};

use super::scenes::{InvalidValues, Scene, bits, parameters};
use crate::boards;
use crate::input::Input;
use crate::tally::Tally;

/// Most steps of one execution.
const STEPS_MAX: u32 = 24;

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let board = EmulatedBoard::new(boards::any(&mut input)).expect("every choice can be built");
    let options =
        OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("nothing is wrong with the board");
    let mut tally = Tally::default();
    let mut scene = Scene::default();
    for number in 0..STEPS_MAX {
        if input.is_empty() {
            break;
        }
        if number == 0 || input.one_in(4) {
            let most = if input.one_in(64) { 40 } else { 8 };
            scene = Scene::any(&mut input, most, most, InvalidValues::Sometimes);
            scene.outgrow(&mut input, &accelerator.capabilities().variant);
            if accelerator.set_shapes(&scene.shapes).is_err() {
                tally.refused += 1;
                // Isotropic, which every board takes.
                for shape in &mut scene.shapes {
                    shape.inverse_inertia = [shape.inverse_inertia[0]; 3];
                }
                accelerator.set_shapes(&scene.shapes).expect("every board takes these");
            }
        }
        step(&mut input, &mut accelerator, &mut scene, &mut tally);
        assert_eq!(board.violations(), [], "after step {number}");
    }
    drop(accelerator);
    assert_eq!(board.violations(), [], "after closing");
    tally.add_board(&board.counts());
    tally
}

/// Takes a step; sometimes twice.
fn step(
    input: &mut Input<'_>,
    accelerator: &mut Accelerator,
    scene: &mut Scene,
    tally: &mut Tally,
) {
    let passes = if input.one_in(64) { 12 } else { 3 };
    let variant = accelerator.capabilities().variant;
    let parameters = parameters(input, passes, InvalidValues::Sometimes, &variant);
    scene.suit(input, &parameters, InvalidValues::Sometimes);
    let mut take = || {
        let mut bodies = scene.bodies.clone();
        let ended = accelerator.step(&mut bodies, &scene.given(), &parameters);
        (bodies, ended)
    };
    let (bodies, ended) = take();
    if input.one_in(4) {
        let (bodies_again, ended_again) = take();
        assert_eq!(bits(&bodies), bits(&bodies_again), "the same step twice");
        assert_eq!(ended.is_ok(), ended_again.is_ok(), "{ended:?}, {ended_again:?}");
        tally.steps += u64::from(ended_again.is_ok());
        tally.refused += u64::from(ended_again.is_err());
    }
    match ended {
        Ok(report) => {
            assert_eq!(report.bodies, bodies.len() as u64);
            let with_points = scene.collisions.iter().filter(|collision| collision.count > 0);
            assert_eq!(report.collisions, with_points.count() as u64);
            tally.steps += 1;
            scene.bodies = bodies;
        }
        Err(error) => {
            check_refusal(&error);
            assert_eq!(
                bits(&bodies),
                bits(&scene.bodies),
                "touched by a step that failed: {error}"
            );
            tally.refused += 1;
        }
    }
}

/// A sound board refuses a step by its input alone.
fn check_refusal(error: &Error) {
    let by_input = match error {
        Error::Input(_) => true,
        Error::Step { fault, .. } => {
            matches!(**fault, Fault::NotFinite { .. } | Fault::ImpulseNotFinite { .. })
        }
        _ => false,
    };
    assert!(by_input && !error.must_reopen(), "{error}: {error:?}");
}
