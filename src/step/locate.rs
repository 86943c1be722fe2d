//! This file says which of the caller's collisions and bodies an error of the accelerator is about:
//! it counts them in the order in which they were sent.

use super::fault::{Fault, Subject};
use crate::error::Error;
use crate::order::{Lives, Schedule};

/// Gives the caller's own index to an error about what was sent in this order. Where only live bodies
/// are kept, bodies were sent in another order too.
pub(super) fn locate(error: &mut Error, schedule: &Schedule, lives: Option<&Lives>) {
    let Error::Step { fault, .. } = error else { return };
    let Fault::Accelerator(accelerator) = &mut **fault else { return };
    let place = |sent: u32| usize::try_from(sent).unwrap_or(usize::MAX);
    match &mut accelerator.subject {
        Subject::Collision { sent, given } => *given = schedule.get(place(*sent)),
        Subject::Body { sent, given } => {
            if let Some(lives) = lives {
                *given = lives.velocities().get(place(*sent)).map(|body| place(*body));
            }
        }
        _ => {}
    }
}
