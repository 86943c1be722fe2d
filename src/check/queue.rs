//! Tests the issue queue by a small step whose collisions it must issue in another order.
//!
//! Four bodies stand in a row, each in collision with the next. The second collision has a body in
//! common with the first and must wait for it. The third has none, and goes ahead of the second,
//! which then waits for both.

use super::bring_up::chain;
use super::report::Outcome;
use crate::error::Error;
use crate::order::{IssueWindow, Order};
use crate::scene::{Body, CONTACT_POINTS, Collision, Contact, Pose, StepParameters, Velocity};
use crate::step::Accelerator;
use crate::validate::InputError;

/// The collisions as the step lists them, and as the queue issues them.
const LISTED: [u8; 3] = [0, 1, 2];
const ISSUED: [u8; 3] = [0, 2, 1];

/// A step of the three collisions.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Solved {
    /// The bodies afterwards.
    bits: Vec<u32>,
    /// Cycles in which no collision issued.
    stalls: u64,
}

/// Takes the step through the queue, and past it in both orders.
pub(super) fn queue(accelerator: &mut Accelerator) -> Outcome {
    // A queue of one collision always issues the oldest.
    if accelerator.capabilities().queue < 2 {
        return Outcome::skipped("the bitstream has no issue queue");
    }
    match steps(accelerator) {
        Ok((steps, stalls)) => judge(&steps, stalls),
        Err(error) => Outcome::failed(
            chain(&error),
            "three collisions to be solved",
            "check whether an accelerator of another build answers the registers",
        ),
    }
}

/// The step through the queue, past it in the order of issue, and past it as listed; the stalls
/// that the first one must have.
fn steps(accelerator: &mut Accelerator) -> Result<([Solved; 3], u64), Error> {
    let capabilities = accelerator.capabilities();
    let window = IssueWindow::of(capabilities).map_err(InputError::from)?;
    // The third collision issues in the second slot, and the second one a window later.
    let idle = u64::from(window.depth()) - 1;
    let pass = idle * u64::from(capabilities.initiation_interval);
    let (through, passes) = step(accelerator, LISTED, Order::Interleaved)?;
    let (issued, _) = step(accelerator, ISSUED, Order::AsGiven)?;
    let (listed, _) = step(accelerator, LISTED, Order::AsGiven)?;
    Ok(([through, issued, listed], pass * passes))
}

/// Solves the collisions in an order, and counts the passes.
fn step(
    accelerator: &mut Accelerator,
    places: [u8; 3],
    order: Order,
) -> Result<(Solved, u64), Error> {
    let mut bodies = [0, 1, 2, 3].map(body);
    let parameters = StepParameters::default().with_integrate(false).with_order(order);
    let report = accelerator.step(&mut bodies[..], &places.map(collision)[..], &parameters)?;
    let bits = bytemuck::cast_slice(&bodies).to_vec();
    Ok((Solved { bits, stalls: report.cycles.stalls }, report.passes.into()))
}

/// A body of the row: each is slower than the one behind it.
fn body(place: u8) -> Body {
    let x = f32::from(place);
    Body {
        pose: Pose { position: [2.0 * x, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity { linear: [1.5 - x, 0.25 * x, 0.0], angular: [0.0; 3] },
        shape: u32::from(place) % 3,
    }
}

/// The collision of a body of the row with the next.
fn collision(place: u8) -> Collision {
    let mut contacts = [Contact::default(); CONTACT_POINTS];
    contacts[0].point = [f32::from(2 * place + 1), 0.25, 0.0];
    let [body_a, body_b] = [place, place + 1].map(u32::from);
    Collision { body_a, body_b, normal: [-1.0, 0.0, 0.0], count: 1, contacts }
}

/// The outcome of the step through the queue, past it in the order of issue, and past it as listed.
fn judge([through, issued, listed]: &[Solved; 3], stalls: u64) -> Outcome {
    if through.bits == issued.bits && through.stalls == stalls {
        return Outcome::ok(format!(
            "the third of three collisions overtook the second: the bits of that order, {stalls} \
             cycles of stalls"
        ));
    }
    let bits = match &through.bits {
        bits if *bits == issued.bits => "the bits of that order",
        bits if *bits == listed.bits => "the bits of the order of the list",
        _ => "the bits of neither order",
    };
    Outcome::failed(
        format!("{bits}, {} cycles of stalls", through.stalls),
        format!("the third of three collisions ahead of the second, {stalls} cycles of stalls"),
        "build the bitstream anew, its queue and its QUEUE register together; until then give the \
         collisions in their order (as given), which goes past the queue",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_bits_and_wrong_stalls_are_told_apart() {
        let solved = |bits, stalls| Solved { bits: vec![bits], stalls };
        let judged = |through| judge(&[through, solved(5, 40), solved(6, 50)], 30);
        assert!(matches!(judged(solved(5, 30)), Outcome::Ok { .. }));
        for (through, said) in [
            (solved(5, 31), "the bits of that order, 31 cycles"),
            (solved(6, 30), "the bits of the order of the list, 30 cycles"),
            (solved(7, 30), "the bits of neither order, 30 cycles"),
        ] {
            let outcome = judged(through);
            let Outcome::Failed { found, .. } = &outcome else { panic!("{outcome:?}") };
            assert!(found.starts_with(said), "{found}");
        }
    }
}
