//! This file puts the collisions of a step in the order in which they are sent.
//!
//! In the caller's own order nothing is made: it is packed as it is. Otherwise pairs, positions and
//! what moves are read into memory that is kept, ordered, and proved free of hazards if that was
//! asked for.

use bitstream_model::interface::profile::Flow;

use crate::accelerator::Capabilities;
use crate::order::{
    Checker, InputBuffers, IssueWindow, Order, OrderError, OrderInput, OrderReport, Orderer,
    Schedule,
};
use crate::scene::validate::{Limits, needed};
use crate::scene::{Bodies, Collisions, Demand, InputError, Shape, StepParameters};

/// Orders the collisions of steps, keeping its memory from one to the next.
#[derive(Debug, Default)]
pub(super) struct Ordering {
    buffers: InputBuffers,
    orderer: Orderer,
    checker: Checker,
}

/// How the collisions of a step were ordered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arranged {
    pub(super) order: Order,
    /// Whether there is a schedule; without one they are as given.
    pub(super) scheduled: bool,
    /// What the order is like, if it was to be verified.
    pub(super) verified: Option<OrderReport>,
}

/// What a step runs on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hardware<'a> {
    pub(super) capabilities: &'a Capabilities,
    pub(super) limits: &'a Limits,
    pub(super) shapes: &'a [Shape],
}

impl Ordering {
    /// Orders the collisions of a step that was validated.
    ///
    /// # Errors
    /// [`InputError::OrderTooLong`], [`InputError::Order`].
    pub(super) fn arrange<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        on: Hardware<'_>,
    ) -> Result<Arranged, InputError> {
        let order = parameters.order.unwrap_or_else(|| automatic(on.capabilities));
        if order == Order::AsGiven && !parameters.verify_order {
            return Ok(Arranged { order, scheduled: false, verified: None });
        }
        let window = IssueWindow::of(on.capabilities, parameters)?;
        let input = self.buffers.gather(bodies, collisions, on.shapes);
        let room = on.limits.room_for_collisions(bodies.len());
        self.orderer.set_limit(usize::try_from(room).unwrap_or(usize::MAX));
        let schedule = match self.orderer.order(&input, order, window) {
            Ok(schedule) => schedule,
            Err(OrderError::TooLong { depth, limit, .. }) => {
                return Err(too_long(&input, depth, limit, parameters, on.shapes));
            }
            Err(error) => return Err(error.into()),
        };
        let verified = match parameters.verify_order {
            true => {
                self.checker.verify(schedule, &input, window)?;
                Some(OrderReport::measure(schedule, &input, window)?)
            }
            false => None,
        };
        Ok(Arranged { order, scheduled: true, verified })
    }

    /// The schedule made last.
    pub(super) fn schedule(&self) -> &Schedule {
        self.orderer.schedule()
    }
}

/// The order of a step that asks for none.
fn automatic(capabilities: &Capabilities) -> Order {
    if capabilities.interlocked { Order::AsGiven } else { Order::HazardFree }
}

/// An order without hazards does not fit. The moving body with the most collisions tells which
/// profiles could have room for it: its uses must lie a depth apart there too.
#[cold]
fn too_long(
    input: &OrderInput<'_>,
    depth: u32,
    limit: usize,
    parameters: &StepParameters,
    shapes: &[Shape],
) -> InputError {
    let (bodies, collisions) = (input.moving.len(), input.pairs.len());
    let mut uses = vec![0_usize; bodies];
    for body in input.pairs.as_flattened() {
        let body = usize::try_from(*body).unwrap_or(usize::MAX);
        if input.moving.get(body) == Some(&true) {
            uses[body] += 1;
        }
    }
    // Of several the first.
    let most = uses.iter().copied().enumerate().rev().max_by_key(|(_, uses)| *uses);
    let (body, uses) = most.unwrap_or_default();
    let demand = Demand { bodies, collisions, inertia: needed(shapes) };
    let carriers = demand.carriers(|variant| {
        let Ok(window) = IssueWindow::of_profile(variant.profile, parameters) else { return false };
        let apart = window.depth() as usize * window.per_issue() as usize;
        let of_body = uses.saturating_sub(1).saturating_mul(apart).saturating_add(1);
        if let Flow::Window(window) = variant.profile.flow
            && of_body > window.lag as usize
        {
            return false;
        }
        // What took more than the limit here takes no less at a greater depth.
        let as_here = if window.depth() >= depth { limit.saturating_add(1) } else { 0 };
        let entries = collisions.max(of_body).max(as_here);
        Demand { collisions: entries, ..demand }.has_room(variant)
    });
    InputError::OrderTooLong { collisions, bodies, limit, depth, body, uses, carriers }
}
