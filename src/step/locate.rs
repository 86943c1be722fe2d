//! Names the caller's collision or body in an error of the accelerator, which counts them in the
//! order of sending.

use crate::error::Error;
use crate::fault::{Fault, Subject};
use crate::order::{Lives, Schedule};

/// Adds the caller's own index to an error. `schedule` is the order in which the collisions were
/// sent. Where the board keeps only live bodies, `lives` is the order of the bodies.
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

#[cfg(test)]
mod tests {
    use pgs_interface::control::ErrorCode;

    use super::*;
    use crate::board::root_cause::decoded;
    use crate::control_block::StickyError;
    use crate::error::Aftermath;
    use crate::fault::Phase;
    use crate::order::{OrderInput, Room};

    /// The message of an error with this code and detail.
    fn message_of(code: ErrorCode, detail: u32, lives: Option<&Lives>) -> String {
        let schedule: Schedule = [Some(2), None, Some(0), Some(1)].into_iter().collect();
        let sticky = StickyError { raw: code as u32, detail };
        let fault = Box::new(Fault::Accelerator(Box::new(decoded(sticky, Phase::Contact(1)))));
        let mut error = Error::Step { fault, aftermath: Aftermath::Ready, diagnosis: None };
        locate(&mut error, &schedule, lives);
        error.fault().expect("a fault").to_string()
    }

    #[test]
    fn a_collision_is_named_as_the_caller_knows_it_and_as_it_was_sent() {
        let text = message_of(ErrorCode::SelfCollision, 0, None);
        assert!(text.contains("collision 2 (sent as entry 0)"), "{text}");
        let text = message_of(ErrorCode::ContactCount, 3, None);
        assert!(text.contains("collision 1 (sent as entry 3)"), "{text}");
        for detail in [1, 4, u32::MAX] {
            let text = message_of(ErrorCode::StaticPair, detail, None);
            assert!(text.contains(&format!("entry {detail}, which was left empty")), "{text}");
        }
    }

    #[test]
    fn a_body_is_named_by_the_order_of_the_lives_where_there_is_one() {
        let text = message_of(ErrorCode::ShapeIndex, 1, None);
        assert!(text.contains("body 1 (sent as record 1)"), "{text}");
        // Collision 2 is sent first: body 3, then 1; then 2; body 0 stands still.
        let input = OrderInput {
            pairs: &[[1, 2], [0, 2], [3, 1]],
            moving: &[false, true, true, true],
            positions: &[[0.0; 3]; 4],
        };
        let schedule: Schedule = [Some(2), None, Some(0), Some(1)].into_iter().collect();
        let mut lives = Lives::default();
        let room = Room { places: 8, lag: 8, passes: 1, per_issue: 1 };
        lives.assign_places(&schedule, &input, room).expect("there is room");
        let bodies = [0, 1, 2].map(|sent| message_of(ErrorCode::ShapeIndex, sent, Some(&lives)));
        assert!(bodies[0].contains("body 3 (sent as record 0)"), "{}", bodies[0]);
        assert!(bodies[1].contains("body 1 (sent as record 1)"), "{}", bodies[1]);
        assert!(bodies[2].contains("body 2 (sent as record 2)"), "{}", bodies[2]);
        let text = message_of(ErrorCode::ShapeIndex, 3, Some(&lives));
        assert!(text.contains("record 3, which is no body's"), "{text}");
    }
}
