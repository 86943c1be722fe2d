//! A pile of cubes for a board, and the steps to the state in which a verb measures it: one way, so
//! that "step 70 of the pile" is the same step everywhere.

use bitstream_model::BoardConfig;
use scene::{Grid, Scene, SceneOptions};
use zynq_pgs::StepParameters;
use zynq_pgs::order::Order;

use crate::board::{self, OpenBoard};
use crate::common::CommonArgs;
use crate::failure::{Failure, Result};
use crate::options::ordering::is_sequential;
use crate::options::scenes;

/// Builds a pile, unless no board takes it.
///
/// # Errors
///
/// Fails where the grid has too many bodies.
pub fn build(grid: Grid, drop: f32) -> Result<Scene> {
    scenes::check_rows(grid)?;
    Scene::new(&SceneOptions { grid, drop }).map_err(Failure::input)
}

/// Opens a board and gives it a pile, unless the pile is too large for the board.
///
/// # Errors
///
/// Fails as the board does, and where the grid has too many bodies for it.
pub fn open(
    grid: Grid,
    drop: f32,
    common: &CommonArgs,
    config: BoardConfig,
) -> Result<(Scene, OpenBoard)> {
    scenes::check_rows(grid)?;
    let mut opened = board::open(common, config)?.stated();
    scenes::check_size(grid, opened.accelerator.capabilities())?;
    let scene = self::build(grid, drop)?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    Ok((scene, opened))
}

/// Takes steps, each after `go_on` agrees, and detects the collisions of the step behind them;
/// false if `go_on` or Ctrl-C ended them.
///
/// The collisions are solved in the order of their detection. A board that does not solve them one
/// after the other would give a pile energy in this order, and takes the driver's.
///
/// # Errors
///
/// Fails where the board does.
pub fn step_to(
    scene: &mut Scene,
    opened: &mut OpenBoard,
    parameters: &StepParameters,
    steps: u32,
    mut go_on: impl FnMut() -> bool,
) -> Result<bool> {
    let parameters = match is_sequential(opened.accelerator.capabilities()) {
        true => parameters.with_order(Some(Order::AsGiven)),
        false => *parameters,
    };
    for _ in 0..steps {
        if !go_on() {
            return Ok(false);
        }
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        match opened.accelerator.step(bodies, collisions, &parameters) {
            Ok(_) => opened.alive()?,
            Err(error) if board::is_cancelled(&error) => return Ok(false),
            Err(error) => return Err(opened.failure(error)),
        }
    }
    scene.detect();
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_that_of_steps_in_the_order_of_detection() {
        let grid = Grid::new(3, 3, 3).expect("a grid");
        let (mut scene, mut opened) =
            open(grid, 0.2, &CommonArgs::emulated(), BoardConfig::default()).expect("a board");
        let mut by_hand = build(grid, 0.2).expect("a pile");
        let given = StepParameters::thesis().with_order(Some(Order::AsGiven));
        for _ in 0..40 {
            by_hand.detect();
            let (bodies, collisions) = by_hand.parts_mut();
            opened.accelerator.step(bodies, collisions, &given).expect("a step");
        }
        by_hand.detect();
        let defaults = StepParameters::thesis();
        assert!(step_to(&mut scene, &mut opened, &defaults, 40, || true).expect("steps"));
        assert_eq!(scene.bodies(), by_hand.bodies());
        assert_eq!(scene.collisions(), by_hand.collisions());
        assert!(!scene.collisions().is_empty());
        assert!(!step_to(&mut scene, &mut opened, &defaults, 1, || false).expect("no step"));
    }

    #[test]
    fn a_pile_that_no_board_or_this_board_takes_is_refused_before_it_is_built() {
        for ([x, y, z], part) in
            [([180, 1000, 180], "no board takes"), ([60, 60, 60], "the board takes at most")]
        {
            let grid = Grid::new(x, y, z).expect("a grid");
            let refused = open(grid, 0.0, &CommonArgs::emulated(), BoardConfig::default())
                .expect_err("too large");
            assert!(refused.chain().contains(part), "{}", refused.chain());
        }
    }
}
