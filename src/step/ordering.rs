//! This file puts the collisions of a step in the order in which they are sent.
//!
//! In the caller's own order nothing is made: it is packed as it is. Otherwise pairs, positions and
//! what moves are read into memory that is kept, ordered, and proved free of hazards if that was
//! asked for. Where only live bodies are kept, every body is then given its place.

use pgs_interface::profile::Flow;

use super::report::OrderChoice;
use crate::control_block::Capabilities;
use crate::order::{
    Checker, Crowded, InputBuffers, Interlock, IssueWindow, LiveReport, Lives, Order, OrderError,
    OrderInput, OrderReport, Orderer, Room, Schedule,
};
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::validate::{InputError, SceneNeeds};
use crate::validate::{Limits, needed};

/// Orders the collisions of steps, keeping its memory from one to the next.
#[derive(Debug, Default)]
pub(super) struct Ordering {
    buffers: InputBuffers,
    orderer: Orderer,
    checker: Checker,
    lives: Lives,
}

/// How the collisions of a step were ordered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arranged {
    /// What was made.
    pub(super) order: Order,
    /// Why.
    pub(super) choice: OrderChoice,
    /// Whether there is a schedule; without one they are as given.
    pub(super) scheduled: bool,
    /// What the order is like, if it was to be verified.
    pub(super) verified: Option<OrderReport>,
    /// What it takes of a design that keeps live bodies alone.
    pub(super) live: Option<LiveReport>,
}

impl Arranged {
    /// Collisions that are sent as the caller gives them.
    pub(super) const fn as_given(choice: OrderChoice) -> Self {
        let order = Order::AsGiven;
        Self { order, choice, scheduled: false, verified: None, live: None }
    }
}

/// What a step runs on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hardware<'a> {
    pub(super) capabilities: &'a Capabilities,
    pub(super) limits: &'a Limits,
    pub(super) shapes: &'a [Shape],
}

impl Hardware<'_> {
    /// Entries of an order that fit beside so many bodies.
    fn entries_max(&self, bodies: usize) -> usize {
        usize::try_from(self.limits.room_for_collisions(bodies)).unwrap_or(usize::MAX)
    }
}

impl Ordering {
    /// Orders the collisions of a step. Its lengths and parameters were validated, what bodies and
    /// collisions hold was not: their indices are checked here.
    ///
    /// # Errors
    /// [`InputError::OrderTooLong`], [`InputError::Order`]; where only live bodies are kept,
    /// [`InputError::SpanTooLong`] and [`InputError::TooManyLive`].
    pub(super) fn arrange<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        on: Hardware<'_>,
    ) -> Result<Arranged, InputError> {
        let design = on.capabilities.window;
        let (order, choice) = match Wanted::of(on.capabilities, parameters) {
            Wanted::Cheapest => return self.cheapest(bodies, collisions, parameters, on),
            Wanted::Order(Order::AsGiven, choice)
                if !parameters.verify_order && design.is_none() =>
            {
                return Ok(Arranged::as_given(choice));
            }
            Wanted::Order(order, choice) => (order, choice),
        };
        let window = IssueWindow::of(on.capabilities, parameters)?;
        let mut input = self.buffers.gather(bodies, collisions, on.shapes);
        let passes = parameters.contact_iterations.saturating_add(parameters.friction_iterations);
        if design.is_some() && passes == 0 {
            // Without a pass there is nobody to take them.
            input.pairs = &[];
        }
        self.orderer.set_limit(on.entries_max(input.moving.len()));
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
        let live = match design {
            Some(design) => {
                let room = Room::of(&design, passes, on.capabilities.collisions_per_issue);
                let settled = self.lives.settle(schedule, &input, room);
                let report = self.lives.report();
                settled.map_err(|crowded| refused(crowded, report, room, &input, on.shapes))?;
                Some(report)
            }
            None => None,
        };
        Ok(Arranged { order: self.orderer.made(), choice, scheduled: true, verified, live })
    }

    /// Orders the collisions of a step for a pipeline that waits on hazards: whichever order takes
    /// the fewest cycles.
    fn cheapest<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        on: Hardware<'_>,
    ) -> Result<Arranged, InputError> {
        let input = self.buffers.gather(bodies, collisions, on.shapes);
        self.orderer.set_limit(on.entries_max(input.moving.len()));
        // A window beyond what can be ordered leaves the order as given.
        let window = IssueWindow::of(on.capabilities, parameters).ok();
        let pipeline = Interlock::of(on.capabilities, parameters);
        let costs = self.orderer.cheapest(&input, window, &pipeline)?;
        let (order, choice) = (self.orderer.made(), OrderChoice::Cheapest(costs));
        Ok(match order {
            Order::AsGiven => Arranged::as_given(choice),
            _ => Arranged { order, choice, scheduled: true, verified: None, live: None },
        })
    }

    /// The schedule made last.
    pub(super) fn schedule(&self) -> &Schedule {
        self.orderer.schedule()
    }

    /// Places, marks and orders of the bodies, of the schedule made last.
    pub(super) fn lives(&self) -> &Lives {
        &self.lives
    }
}

/// The order that a step is to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wanted {
    /// This one.
    Order(Order, OrderChoice),
    /// Whichever costs a pipeline that waits on hazards least.
    Cheapest,
}

impl Wanted {
    fn of(capabilities: &Capabilities, parameters: &StepParameters) -> Self {
        match (parameters.order, capabilities.window) {
            (Some(order), _) => Self::Order(order, OrderChoice::Asked),
            (None, Some(_)) => Self::Order(Order::HazardFree, OrderChoice::LiveBodies),
            (None, None) if !capabilities.interlocked => {
                Self::Order(Order::HazardFreeNearby, OrderChoice::NoInterlock)
            }
            // Only an order that keeps its empty entries can be verified.
            (None, None) if parameters.verify_order => {
                Self::Order(Order::HazardFreeNearby, OrderChoice::Asked)
            }
            (None, None) => Self::Cheapest,
        }
    }
}

/// Whether the collisions of a step may be sent as the caller writes them, one after the other.
pub(super) fn in_order_of_writing(
    capabilities: &Capabilities,
    parameters: &StepParameters,
) -> bool {
    let order = match parameters.order {
        Some(order) => order == Order::AsGiven,
        None => capabilities.interlocked,
    };
    order && !parameters.verify_order && capabilities.window.is_none()
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
    let demand = SceneNeeds { bodies, collisions, inertia: needed(shapes) };
    let carriers = demand.carriers(|variant| {
        let Ok(window) = IssueWindow::of_profile(variant.profile, parameters) else { return false };
        let apart = window.depth() as usize * window.per_issue() as usize;
        let of_body = uses.saturating_sub(1).saturating_mul(apart).saturating_add(1);
        match variant.profile.flow {
            Flow::Window(window) if of_body > window.lag as usize => return false,
            _ => {}
        }
        // What took more than the limit here takes no less at a greater depth.
        let as_here = if window.depth() >= depth { limit.saturating_add(1) } else { 0 };
        let entries = collisions.max(of_body).max(as_here);
        SceneNeeds { collisions: entries, ..demand }.has_room(variant)
    });
    InputError::OrderTooLong { collisions, bodies, limit, depth, body, uses, carriers }
}

/// An order in which bodies live too long, or too many at once.
#[cold]
fn refused(
    crowded: Crowded,
    LiveReport { most_alive: alive, longest_span, .. }: LiveReport,
    room: Room,
    input: &OrderInput<'_>,
    shapes: &[Shape],
) -> InputError {
    let (bodies, collisions) = (input.moving.len(), input.pairs.len());
    let demand = SceneNeeds { bodies, collisions, inertia: needed(shapes) };
    let held = match crowded {
        Crowded::Span { .. } => 0,
        Crowded::Places { held } => held,
    };
    let carriers = demand.carriers(|variant| match variant.profile.flow {
        Flow::Passes => true,
        Flow::Window(window) => window.lag > longest_span && window.slots > held,
    });
    let at = |number: u32| usize::try_from(number).unwrap_or(usize::MAX);
    match crowded {
        Crowded::Span { body, first, last } => InputError::SpanTooLong {
            body: at(body),
            first: at(first),
            last: at(last),
            lag: room.lag,
            carriers,
        },
        Crowded::Places { held } => {
            InputError::TooManyLive { held, alive, places: room.places, carriers }
        }
    }
}
