//! Names the caller's collision in an error of the accelerator, which counts them in the
//! order of sending.

use crate::error::Error;
use crate::fault::{Fault, Subject};
use crate::order::Schedule;

/// Adds the caller's own index to the error of a collision. `schedule` is the order in which the
/// collisions were sent.
pub(super) fn locate(error: &mut Error, schedule: &Schedule) {
    let Error::Step { fault, .. } = error else { return };
    let Fault::Accelerator(accelerator) = &mut **fault else { return };
    if let Subject::Collision { sent, given } = &mut accelerator.subject {
        *given = schedule.get(usize::try_from(*sent).unwrap_or(usize::MAX));
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::control::ErrorCode;

    use super::*;
    use crate::board::root_cause::decoded;
    use crate::control_block::StickyError;
    use crate::error::Aftermath;
    use crate::fault::Phase;

    /// The message of an error with this code and detail.
    fn message_of(code: ErrorCode, detail: u32) -> String {
        let schedule: Schedule = [Some(2), None, Some(0), Some(1)].into_iter().collect();
        let sticky = StickyError { raw: code as u32, detail };
        let fault = Box::new(Fault::Accelerator(Box::new(decoded(sticky, Phase::Contact(1)))));
        let mut error = Error::Step { fault, aftermath: Aftermath::Ready, diagnosis: None };
        locate(&mut error, &schedule);
        error.fault().expect("a fault").to_string()
    }

    #[test]
    fn a_collision_is_named_as_the_caller_knows_it_and_as_it_was_sent() {
        let text = message_of(ErrorCode::SelfCollision, 0);
        assert!(text.contains("collision 2 (sent as entry 0)"), "{text}");
        let text = message_of(ErrorCode::ContactCount, 3);
        assert!(text.contains("collision 1 (sent as entry 3)"), "{text}");
        for detail in [1, 4, u32::MAX] {
            let text = message_of(ErrorCode::StaticPair, detail);
            assert!(text.contains(&format!("entry {detail}, which was left empty")), "{text}");
        }
    }
}
