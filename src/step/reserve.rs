//! Reserves the memory of a step, and makes the error of a step that could not be packed.

use super::flight::{Engines, PackedStep};
use crate::board::bank::{Bank, PerBank};
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::board::symptom::Symptom;
use crate::error::{Aftermath, Error};
use crate::fault::Fault;
use crate::scene::Shape;

/// A board, and the steps in its banks.
type Banks<'a> = (&'a mut Device, &'a mut PerBank<Option<PackedStep>>);

/// Makes the buffers of a bank large enough for a step, and the rings too if the engines are idle.
pub(super) fn reserve(
    (device, packed): Banks<'_>,
    shapes: &[Shape],
    (plan, bank): (&Plan, Bank),
    engines: Engines,
) -> Result<(), Symptom> {
    if engines == Engines::Idle {
        device.check_cancelled()?;
    }
    if plan.bodies == 0 {
        return Ok(());
    }
    match engines {
        Engines::Idle => {
            or_free((device, packed), bank, |device| device.reserve_or_reset(plan, bank, shapes))
        }
        Engines::Working => device.reserve_buffers(plan, bank).map_err(|error| {
            // A part of the buffers is of no use, and may be the memory that the next step lacks.
            device.release_buffers(bank);
            Fault::NoMemory(error).into()
        }),
    }
}

/// Makes an attempt, and repeats it with the memory of the other bank if memory is short. The step
/// that was prepared in the other bank is then lost.
pub(super) fn or_free(
    (device, packed): Banks<'_>,
    bank: Bank,
    attempt: impl Fn(&mut Device) -> Result<(), Symptom>,
) -> Result<(), Symptom> {
    let tried = attempt(device);
    if matches!(tried, Err(Symptom::Known(Fault::NoMemory(_))))
        && device.release_buffers(bank.other())
    {
        packed[bank.other()] = None;
        log::info!("too little memory for DMA: the memory kept for prepared steps was freed");
        return attempt(device);
    }
    tried
}

/// The error of a step that could not be packed.
pub(super) fn refuse(
    device: &mut Device,
    shapes: &[Shape],
    symptom: Symptom,
    engines: Engines,
) -> Error {
    match (symptom, engines) {
        // The board has no part in the fault, and is at work.
        (Symptom::Known(fault), Engines::Working) => {
            let fault = Box::new(fault);
            Error::Step { fault, aftermath: Aftermath::Untouched, diagnosis: None }
        }
        (symptom, _) => device.fail(symptom, shapes),
    }
}
