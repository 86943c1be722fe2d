//! Puts the collisions of a step in the order of sending.
//!
//! The caller's own order needs no work: the collisions are packed as they are, those without
//! contact points as padding. The interleaved order follows from their number. For the others this
//! module reads pairs and masses into memory that it keeps from step to step, orders the
//! collisions, and verifies on request that no hazard is left.

use super::report::OrderChoice;
use crate::control_block::Capabilities;
use crate::order::{
    Checker, InputBuffers, Interlock, IssueWindow, Order, OrderError, OrderInput, Orderer, Schedule,
};
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::validate::{Excess, InputError, Limits, SceneNeeds, needed};

/// Orders the collisions of steps, keeping its memory from one to the next.
#[derive(Debug, Default)]
pub(super) struct Ordering {
    buffers: InputBuffers,
    orderer: Orderer,
    checker: Checker,
}

/// The order of the collisions of a step, and the reason for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct OrderSummary {
    /// The order that was made.
    pub(super) order: Order,
    /// The reason for this order.
    pub(super) choice: OrderChoice,
    /// Whether there is a schedule; without one the collisions stay as given.
    pub(super) scheduled: bool,
    /// Number of collisions without contact points, if no entry of the schedule holds them; else
    /// they are sent as padding.
    pub(super) empty: Option<usize>,
    /// Whether the order was verified: it has no hazard.
    pub(super) verified: bool,
    /// Whether the step goes through the board's issue queue.
    pub(super) queued: bool,
}

impl OrderSummary {
    /// The summary of collisions that are sent as the caller gives them.
    pub(super) const fn as_given(choice: OrderChoice, queued: bool) -> Self {
        let order = Order::AsGiven;
        Self { order, choice, scheduled: false, empty: None, verified: false, queued }
    }
}

/// The board's side of an ordering.
#[derive(Debug, Clone, Copy)]
pub(super) struct OrderingContext<'a> {
    pub(super) capabilities: &'a Capabilities,
    pub(super) limits: &'a Limits,
    pub(super) shapes: &'a [Shape],
}

impl OrderingContext<'_> {
    /// Number of entries that fit beside `bodies` bodies.
    fn entries_max(&self, bodies: usize) -> usize {
        usize::try_from(self.limits.room_for_collisions(bodies)).unwrap_or(usize::MAX)
    }
}

/// Fewer collisions than this go past the queue, in the cheaper of the caller's order and the one
/// without hazards, unless the caller names an order. They never fill the queue, cost the processor
/// little to order, and are often a stack, which stands best if it is solved from the ground up.
const FEW: usize = 64;

impl Ordering {
    /// Orders the collisions of a step. Its lengths and parameters were validated before; the
    /// indices in bodies and collisions were not, and are checked here.
    ///
    /// # Errors
    /// [`Excess::OrderTooLong`], [`InputError::Order`].
    pub(super) fn order<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        context: OrderingContext<'_>,
    ) -> Result<OrderSummary, InputError> {
        let (order, choice) = match OrderRequest::of(context.capabilities, parameters) {
            OrderRequest::Cheapest => {
                return self.cheapest(bodies, collisions, parameters, context);
            }
            OrderRequest::Order(Order::AsGiven, choice) if !parameters.verify_order => {
                return Ok(OrderSummary::as_given(choice, false));
            }
            OrderRequest::Order(order @ Order::Interleaved, choice) if !parameters.verify_order => {
                // Nothing is sent, and the number of collisions was compared with no room.
                if bodies.len() == 0 {
                    return Ok(OrderSummary::as_given(choice, false));
                }
                if choice == OrderChoice::Queue && collisions.len() < FEW {
                    return self.cheapest(bodies, collisions, parameters, context);
                }
                let queued = context.capabilities.queue > 0;
                self.orderer.interleave(collisions.len());
                let (scheduled, empty, verified) = (true, None, false);
                return Ok(OrderSummary { order, choice, scheduled, empty, verified, queued });
            }
            OrderRequest::Order(order, choice) => (order, choice),
        };
        let window = IssueWindow::of(context.capabilities)?;
        let input = self.buffers.gather(bodies, collisions, context.shapes);
        let empty = input.pairs.len() - input.collisions();
        self.orderer.set_limit(context.entries_max(input.moving.len()));
        match self.orderer.order(&input, order, window) {
            Ok(_) => {}
            Err(OrderError::TooLong { depth, limit, .. }) => {
                return Err(too_long(&input, depth, limit, context.shapes));
            }
            Err(error) => return Err(error.into()),
        }
        let schedule = self.orderer.schedule();
        let verified = parameters.verify_order;
        if verified {
            self.checker.verify(schedule, &input, window)?;
        }
        let queued = order != Order::AsGiven && context.capabilities.queue > 0;
        let empty = (order != Order::Interleaved).then_some(empty);
        Ok(OrderSummary { order, choice, scheduled: true, empty, verified, queued })
    }

    /// Orders the collisions of a step for a pipeline that waits on hazards. Picks the order that
    /// takes the fewest cycles.
    fn cheapest<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        context: OrderingContext<'_>,
    ) -> Result<OrderSummary, InputError> {
        let input = self.buffers.gather(bodies, collisions, context.shapes);
        self.orderer.set_limit(context.entries_max(input.moving.len()));
        // A window that is too large for the orderer leaves the order as given.
        let window = IssueWindow::of(context.capabilities).ok();
        let pipeline = Interlock::of(context.capabilities, parameters);
        let (order, costs) = self.orderer.cheapest(&input, window, &pipeline)?;
        let choice = OrderChoice::Cheapest(costs);
        let empty = input.pairs.len() - input.collisions();
        if order == Order::AsGiven {
            if empty == 0 {
                return Ok(OrderSummary::as_given(choice, false));
            }
            self.orderer.as_given_without_empty(&input);
        }
        let (scheduled, empty) = (true, Some(empty));
        Ok(OrderSummary { order, choice, scheduled, empty, verified: false, queued: false })
    }

    /// The schedule of the last order.
    pub(super) fn schedule(&self) -> &Schedule {
        self.orderer.schedule()
    }
}

/// The order that the board and the parameters call for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OrderRequest {
    /// A fixed order, and the reason for it.
    Order(Order, OrderChoice),
    /// The order that costs the fewest cycles on a pipeline that waits on hazards.
    Cheapest,
}

impl OrderRequest {
    fn of(capabilities: &Capabilities, parameters: &StepParameters) -> Self {
        match parameters.order {
            Some(order) => Self::Order(order, OrderChoice::Asked),
            None if !capabilities.interlocked => {
                Self::Order(Order::HazardFree, OrderChoice::NoInterlock)
            }
            // Only an order that keeps its empty entries can be verified.
            None if parameters.verify_order => Self::Order(Order::HazardFree, OrderChoice::Asked),
            None if capabilities.queue > 0 => Self::Order(Order::Interleaved, OrderChoice::Queue),
            None => Self::Cheapest,
        }
    }
}

/// Whether the collisions of a step may be sent one after the other as the caller writes them.
pub(super) fn in_order_of_writing(
    capabilities: &Capabilities,
    parameters: &StepParameters,
) -> bool {
    let order = match parameters.order {
        Some(order) => order == Order::AsGiven,
        None => capabilities.interlocked,
    };
    order && !parameters.verify_order
}

/// The error of an order without hazards that does not fit. The moving body with the most
/// collisions decides which profiles could have room for it, because its uses must lie a depth
/// apart there too.
#[cold]
fn too_long(input: &OrderInput<'_>, depth: u32, limit: usize, shapes: &[Shape]) -> InputError {
    let (bodies, collisions) = (input.moving.len(), input.collisions());
    let mut uses = vec![0_usize; bodies];
    for body in input.pairs.as_flattened() {
        let body = usize::try_from(*body).unwrap_or(usize::MAX);
        if input.moving.get(body) == Some(&true) {
            uses[body] += 1;
        }
    }
    // The first body among equals.
    let most = uses.iter().copied().enumerate().rev().max_by_key(|(_, uses)| *uses);
    let (body, uses) = most.unwrap_or_default();
    let needs = SceneNeeds { bodies, collisions, inertia: needed(shapes) };
    let excess = Excess::OrderTooLong { collisions, bodies, limit, depth, body, uses };
    needs.refuse(excess, &|variant| {
        let Ok(window) = IssueWindow::of_variant(variant) else { return false };
        let apart = window.depth() as usize * window.per_issue() as usize;
        let of_body = uses.saturating_sub(1).saturating_mul(apart).saturating_add(1);
        // An order that was longer than the limit here is not shorter at a greater depth.
        let as_here = if window.depth() >= depth { limit.saturating_add(1) } else { 0 };
        let entries = collisions.max(of_body).max(as_here);
        SceneNeeds { collisions: entries, ..needs }.has_room(variant)
    })
}
