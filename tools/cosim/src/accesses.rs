//! Random register accesses before, in and after a step: interrupt registers, arguments and START
//! while the accelerator is busy, writes to read-only registers, a reset in the middle of a packet.

use bitstream_model::external::{ExternalAccelerator, ExternalError, Offer};
use pgs_interface::control::{
    AP_CTRL, GIE, IER, ISR, REGISTERS, RESET, SHAPE_STRIDE, SHAPE_TABLE, ap_ctrl, reset,
};
use pgs_interface::profile::Variant;
use pgs_interface::register::Access;
use pgs_support::random::SplitMix64;

use crate::outcome::{self, Feed};
use crate::packets::packets;
use crate::random::case;

/// Accesses at rest.
const AT_REST: u32 = 8;
/// Most clocks of a step.
const CLOCKS_MAX: u64 = 10_000_000;

/// Makes the accesses of a seed; whether the step has ended. The accelerator is one in lock step
/// with the model, which names the first difference.
///
/// # Errors
/// The difference, or an accelerator that does not answer.
pub fn run(
    both: &mut dyn ExternalAccelerator,
    variant: Variant,
    seed: u64,
) -> Result<bool, ExternalError> {
    let mut random = SplitMix64::new(seed);
    let case = case(seed, variant);
    let beats = packets(&case.scene, case.fault);
    outcome::reset(both)?;
    for _ in 0..random.word_below(AT_REST) {
        access(both, &mut random, false)?;
    }
    outcome::set_up(both, &case.scene)?;
    both.write(GIE.offset, random.word_below(2))?;
    both.write(IER.offset, random.word_below(8))?;
    both.write(AP_CTRL.offset, ap_ctrl::START.mask())?;
    let mut feed = Feed::new(&beats);
    let reset_at =
        if random.word_below(4) == 0 { u64::from(random.word_below(4000)) } else { u64::MAX };
    while feed.busy && feed.clocks < CLOCKS_MAX {
        if feed.clocks >= reset_at {
            // The beats of the interrupted step are gone; a whole step follows.
            feed.busy = !outcome::run(both, &case.scene, &beats)?.ended;
            break;
        }
        // With its interrupt the hardware may have ended the step, and the model not yet.
        if random.word_below(8) == 0 && !feed.interrupt {
            access(both, &mut random, true)?;
        }
        feed.exchange(both)?;
    }
    if feed.busy {
        return Ok(false);
    }
    both.run(64, &Offer::default())?;
    for register in REGISTERS {
        both.read(register.offset)?;
    }
    for _ in 0..random.word_below(AT_REST) {
        access(both, &mut random, false)?;
    }
    for register in REGISTERS {
        both.read(register.offset)?;
    }
    Ok(true)
}

/// One access; never one that starts or resets an accelerator at rest.
fn access(
    both: &mut dyn ExternalAccelerator,
    random: &mut SplitMix64,
    busy: bool,
) -> Result<(), ExternalError> {
    let any = &REGISTERS[random.word_below(u32::try_from(REGISTERS.len()).unwrap_or(1)) as usize];
    let shape = SHAPE_TABLE + SHAPE_STRIDE * random.word_below(64) + 4 * random.word_below(2);
    match random.word_below(6) {
        0 | 1 => both.read(any.offset).map(drop),
        2 => both.read(shape).map(drop),
        3 => {
            both.write([GIE, IER, ISR][random.word_below(3) as usize].offset, random.word_below(8))
        }
        // A step in progress keeps its shapes and its arguments.
        4 if !busy => both.write(shape, random.word()),
        4 => both.write(AP_CTRL.offset, ap_ctrl::START.mask()),
        _ if any.offset == AP_CTRL.offset || any.offset == RESET.offset => {
            both.write(RESET.offset, random.word() & !reset::RESET.mask())
        }
        _ if any.access == Access::SelfClearing => Ok(()),
        _ => both.write(any.offset, random.word()),
    }
}
