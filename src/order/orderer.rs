//! Makes an order of the requested kind.

use pgs_support::float_env::standard;

use super::groups::Groups;
use super::interlock::{Interlock, StallCounter};
use super::schedule::EMPTY;
use super::{IssueWindow, Order, OrderError, OrderInput, Schedule};

/// Makes orders, and keeps its memory from one to the next: it allocates nothing once it has made
/// the same order of a scene of the same size.
#[derive(Debug)]
pub struct Orderer {
    groups: Groups,
    schedule: Schedule,
    /// Collisions of each body.
    uses: Vec<u32>,
    stalls: StallCounter,
    limit: usize,
}

impl Default for Orderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Orderer {
    /// The default limit of a schedule's length, entries.
    pub const ENTRIES_MAX: usize = 1 << 26;

    /// Makes an orderer that has allocated nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            groups: Groups::default(),
            schedule: Schedule::default(),
            uses: Vec::new(),
            stalls: StallCounter::default(),
            limit: Self::ENTRIES_MAX,
        }
    }

    /// Sets the largest length of a schedule, in entries, empty ones included.
    pub fn set_limit(&mut self, entries: usize) {
        self.limit = entries.min(Self::ENTRIES_MAX);
    }

    /// Orders the collisions of a step.
    ///
    /// Only [`Order::HazardFree`] uses the window. The order is a function of the arguments alone.
    ///
    /// # Errors
    /// [`OrderError`]: a pair with a body that does not exist or with one body twice, too many
    /// bodies or collisions, or a body with too many collisions: the schedule would be longer than
    /// the [limit](Self::set_limit).
    pub fn order(
        &mut self,
        input: &OrderInput<'_>,
        order: Order,
        window: IssueWindow,
    ) -> Result<&Schedule, OrderError> {
        input.check()?;
        match order {
            Order::AsGiven => as_given(input, &mut self.schedule),
            Order::Interleaved => self.schedule.interleave(input.pairs.len()),
            Order::HazardFree => {
                let Self { groups, schedule, limit, .. } = self;
                standard(|| groups.place(input, window, *limit, schedule))?;
            }
        }
        Ok(&self.schedule)
    }

    /// Orders the collisions of a step for a pipeline that waits on hazards. Picks the order with
    /// fewer cycles, as given or without hazards, and returns it with the costs of both.
    ///
    /// Such a pipeline waits by itself, and the order has no empty entries. A body with many
    /// collisions makes both orders wait about as long. The order as given is therefore taken
    /// unless the other one saves more than one cycle in a hundred, and wherever there is no window
    /// to order for. Neither order has collisions without contact points. Time and memory are
    /// linear in the input.
    ///
    /// # Errors
    /// [`OrderError`]: a pair with a body that does not exist or with one body twice, too many
    /// bodies or collisions.
    pub(crate) fn cheapest(
        &mut self,
        input: &OrderInput<'_>,
        window: Option<IssueWindow>,
        pipeline: &Interlock,
    ) -> Result<(Order, OrderCosts), OrderError> {
        input.check()?;
        let least = pipeline
            .cycles_without_hazards(input.collisions())
            .max(pipeline.cycles_of_one_body(self.most_uses(input)));
        let enough = one_percent_more(least);
        let as_given = self.cycles_as_given(input, pipeline, enough);
        if as_given <= enough {
            return Ok((Order::AsGiven, OrderCosts { as_given, reordered: None }));
        }
        let made = window.map(|window| self.order(input, Order::HazardFree, window).map(drop));
        let reordered = match made {
            Some(Ok(())) => {
                self.schedule.drop_empty();
                let entries = self.schedule.entries.iter().copied();
                Some(self.stalls.cycles(input, entries, pipeline, u64::MAX))
            }
            None | Some(Err(OrderError::TooLong { .. })) => None,
            Some(Err(error)) => return Err(error),
        };
        let enough = reordered.map_or(u64::MAX, one_percent_more);
        let as_given = self.cycles_as_given(input, pipeline, enough);
        let order = if as_given > enough { Order::HazardFree } else { Order::AsGiven };
        Ok((order, OrderCosts { as_given, reordered }))
    }

    /// Makes [`Order::AsGiven`] without the empty entries, of an input that was ordered before.
    pub(crate) fn as_given_without_empty(&mut self, input: &OrderInput<'_>) {
        as_given(input, &mut self.schedule);
        self.schedule.drop_empty();
    }

    /// Makes [`Order::Interleaved`] of this number of collisions.
    pub(crate) fn interleave(&mut self, collisions: usize) {
        self.schedule.interleave(collisions);
    }

    /// Cycles of the order as given without its empty entries; a lower bound above `limit`.
    fn cycles_as_given(&mut self, input: &OrderInput<'_>, pipeline: &Interlock, limit: u64) -> u64 {
        let entries = input.taking_part().map(|(index, _)| index);
        self.stalls.cycles(input, entries, pipeline, limit)
    }

    /// Collisions of the moving body that has the most.
    fn most_uses(&mut self, input: &OrderInput<'_>) -> usize {
        self.uses.clear();
        self.uses.resize(input.moving.len(), 0);
        for body in input.taking_part().flat_map(|(_, pair)| pair) {
            self.uses[body as usize] += 1;
        }
        let moving = self.uses.iter().zip(input.moving).filter(|(_, moving)| **moving);
        moving.map(|(uses, _)| *uses as usize).max().unwrap_or(0)
    }

    /// The schedule of the last order; empty before the first.
    #[must_use]
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }
}

/// Makes the order as given. The entry of a collision without contact points is empty.
fn as_given(input: &OrderInput<'_>, schedule: &mut Schedule) {
    schedule.clear();
    let entry = |(index, pair): (u32, &[u32; 2])| match OrderInput::takes_part(*pair) {
        true => index,
        false => EMPTY,
    };
    schedule.entries.extend((0..).zip(input.pairs).map(entry));
    schedule.empty = input.pairs.len() - input.collisions();
}

/// The cost of two orders on a pipeline that waits on hazards: cycles of all passes of a step,
/// including stalls. Waits for memory and the fill of the pipeline are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct OrderCosts {
    /// Cost of [`Order::AsGiven`]. Where the other order was taken this is a lower bound, because
    /// counting ends as soon as the cost is known to be higher.
    pub as_given: u64,
    /// Cost of [`Order::HazardFree`] without empty entries. `None` where this order was not made:
    /// hardly any order takes fewer cycles than as given, or a body has too many collisions to
    /// order them.
    pub reordered: Option<u64>,
}

/// One part in a hundred more: another order must save at least this much.
const fn one_percent_more(cycles: u64) -> u64 {
    cycles.saturating_add(cycles / 100)
}
