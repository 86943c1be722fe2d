//! Puts the accelerator that was chosen behind an emulated board: the model, a simulator of the
//! generated Verilog, or both in lock step.

use bitstream_model::external::{ExternalAccelerator, ExternalError, LockStep, SimulatorProcess};
use bitstream_model::{BoardConfig, EmulatedBoard};

use super::not_built;
use crate::common::AcceleratorChoice;
use crate::failure::{Cause, Failure, Result};

/// Starts the accelerator that was chosen for a board that is built as `config` says; none for the
/// built-in model.
///
/// # Errors
///
/// Fails where the simulator cannot be started, or is built otherwise than `config`.
pub fn external_accelerator(
    config: &mut BoardConfig,
    accelerator: &AcceleratorChoice,
) -> Result<Option<Box<dyn ExternalAccelerator>>> {
    let Some((path, with_model)) = &accelerator.simulator else { return Ok(None) };
    let simulator = SimulatorProcess::start_for(config, path).map_err(|error| {
        let next = match error {
            ExternalError::Profile { .. } => {
                "name another profile with --board, or leave out --accelerator".to_owned()
            }
            ExternalError::Hazards { simulator, .. } => {
                format!(
                    "add the word {simulator} to the board, or build the simulator with --hazards"
                )
            }
            ExternalError::Inertia { simulator, board } => {
                format!(
                    "add the word {simulator} to the board, or build the simulator with --inertia \
                     {board}"
                )
            }
            _ => return Failure::input(error),
        };
        Failure::input(error).next(next)
    })?;
    Ok(Some(match with_model {
        true => {
            let player = Some(path.to_owned());
            let both = LockStep::new(config, Box::new(simulator), player).map_err(not_built)?;
            Box::new(both)
        }
        false => Box::new(simulator),
    }))
}

/// Builds an emulated board with the accelerator that was chosen.
///
/// # Errors
///
/// Fails where no board is built as `config` says, or the simulator cannot be started.
pub fn emulated_board(
    mut config: BoardConfig,
    accelerator: &AcceleratorChoice,
) -> Result<EmulatedBoard> {
    match external_accelerator(&mut config, accelerator)? {
        Some(external) => EmulatedBoard::with_accelerator(config, external),
        None => EmulatedBoard::new(config),
    }
    .map_err(not_built)
}

/// The failure for an external accelerator that does not answer any more, or not as the model.
pub(crate) fn dead(observer: Option<&EmulatedBoard>) -> Option<Failure> {
    let reason = observer?.accelerator_error()?;
    let next = "no body was changed, and the next command starts a new simulator; one that is \
        built with \
                `rtlgen simulator --waveform` shows the cycles before a difference from the model";
    Some(Failure::new(Cause::Hardware, reason).next(next))
}
