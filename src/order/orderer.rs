//! Makes an order of the requested kind.

use pgs_support::float_env::standard;

use super::groups::Groups;
use super::interlock::{Interlock, StallCounter};
use super::schedule::EMPTY;
use super::sweep::Sweep;
use super::tail::Tail;
use super::{IssueWindow, Order, OrderError, OrderInput, Schedule};

/// Makes orders, and keeps its memory from one to the next. For [`Order::AsGiven`] and the orders
/// without hazards it allocates nothing once it has [made](Self::made) the same order of a scene of
/// the same size.
#[derive(Debug)]
pub struct Orderer {
    sweep: Sweep,
    tail: Tail,
    groups: Groups,
    schedule: Schedule,
    /// Collisions of each body.
    uses: Vec<u32>,
    stalls: StallCounter,
    limit: usize,
    made: Order,
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
            sweep: Sweep::default(),
            tail: Tail::default(),
            groups: Groups::default(),
            schedule: Schedule::default(),
            uses: Vec::new(),
            stalls: StallCounter::default(),
            limit: Self::ENTRIES_MAX,
            made: Order::AsGiven,
        }
    }

    /// Sets the largest length of a schedule, in entries, empty ones included.
    pub fn set_limit(&mut self, entries: usize) {
        self.limit = entries.min(Self::ENTRIES_MAX);
    }

    /// Orders the collisions of a step.
    ///
    /// Only the orders without hazards use the window. The order is a function of the arguments
    /// alone. Collisions without contact points ([`OrderInput::EMPTY`]) change nothing for the
    /// others.
    ///
    /// # Errors
    /// [`OrderError`]: arrays of unequal lengths, a pair with a body that does not exist or with
    /// one body twice, too many bodies or collisions, or a body with too many collisions: the
    /// schedule would be longer than the [limit](Self::set_limit).
    pub fn order(
        &mut self,
        input: &OrderInput<'_>,
        order: Order,
        window: IssueWindow,
    ) -> Result<&Schedule, OrderError> {
        standard(|| self.make(input, order, window))?;
        Ok(&self.schedule)
    }

    fn make(
        &mut self,
        input: &OrderInput<'_>,
        order: Order,
        window: IssueWindow,
    ) -> Result<(), OrderError> {
        input.check()?;
        let schedule = &mut self.schedule;
        let mut made = order;
        match order {
            Order::AsGiven => as_given(input, schedule),
            Order::HazardFree => {
                self.sweep.run(input);
                self.place(window, self.limit)?;
            }
            Order::HazardFreeNearby => {
                self.sweep.as_given(input);
                let collisions = self.sweep.collisions.len();
                let most = nearby_entries_max(collisions, self.most_uses(input), window);
                if self.place(window, self.limit.min(most)).is_err() {
                    made = Order::HazardFree;
                    self.sweep.run(input);
                    self.place(window, self.limit)?;
                }
            }
        }
        self.made = made;
        Ok(())
    }

    /// Orders the collisions of a step for a pipeline that waits on hazards. Picks the order with
    /// fewer cycles: as given, or near to it and without hazards. [`made`](Self::made) tells the
    /// choice.
    ///
    /// Such a pipeline waits by itself, and the order has no empty entries. A body with many
    /// collisions makes both orders wait about as long. The order as given is therefore taken
    /// unless the other one saves more than one cycle in a hundred, and wherever there is no window
    /// to order for. Neither order has collisions without contact points. Time and memory are
    /// linear in the input.
    ///
    /// # Errors
    /// [`OrderError`]: arrays of unequal lengths, a pair with a body that does not exist or with
    /// one body twice, too many bodies or collisions.
    pub(crate) fn cheapest(
        &mut self,
        input: &OrderInput<'_>,
        window: Option<IssueWindow>,
        pipeline: &Interlock,
    ) -> Result<OrderCosts, OrderError> {
        input.check()?;
        self.made = Order::AsGiven;
        let given = || input.taking_part().map(|(index, _)| index);
        let collisions = input.collisions();
        let uses = self.most_uses(input);
        let no_order_beats =
            pipeline.cycles_without_hazards(collisions).max(pipeline.cycles_of_one_body(uses));
        let longest = window.map_or(0, |window| nearby_entries_max(collisions, uses, window));
        let counted_to =
            one_percent_more(pipeline.cycles_without_hazards(longest).max(no_order_beats));
        let mut as_given = self.stalls.cycles(input, given(), pipeline, counted_to);
        let window = match window {
            Some(window) if as_given > one_percent_more(no_order_beats) => window,
            _ => return Ok(OrderCosts { as_given, reordered: None }),
        };
        match self.order(input, Order::HazardFreeNearby, window) {
            Ok(_) => {}
            Err(OrderError::TooLong { .. }) => {
                self.made = Order::AsGiven;
                return Ok(OrderCosts { as_given, reordered: None });
            }
            Err(error) => return Err(error),
        }
        // Without its empty entries the order takes no longer.
        let mut reordered = pipeline.cycles_without_hazards(self.schedule.len());
        self.schedule.drop_empty();
        if as_given <= one_percent_more(reordered) {
            let entries = self.schedule.entries.iter().copied();
            reordered = self.stalls.cycles(input, entries, pipeline, u64::MAX);
            let enough = one_percent_more(reordered);
            if counted_to < enough {
                as_given = self.stalls.cycles(input, given(), pipeline, enough);
            }
            if as_given <= enough {
                self.made = Order::AsGiven;
            }
        }
        Ok(OrderCosts { as_given, reordered: Some(reordered) })
    }

    /// Makes [`Order::AsGiven`] without the empty entries, of an input that was ordered before.
    pub(crate) fn as_given_without_empty(&mut self, input: &OrderInput<'_>) {
        as_given(input, &mut self.schedule);
        self.schedule.drop_empty();
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

    /// Places the swept collisions without hazards, in at most `limit` entries.
    fn place(&mut self, window: IssueWindow, limit: usize) -> Result<(), OrderError> {
        let static_rank = self.sweep.static_rank();
        let sweep = &mut self.sweep.collisions;
        self.tail.bring_forward(sweep, window.entries(), static_rank);
        self.groups.place(sweep, static_rank, window, limit, &mut self.schedule)
    }

    /// The kind of the last order: the requested kind, or [`Order::HazardFree`] in its place. After
    /// an error the value has no meaning.
    #[must_use]
    pub fn made(&self) -> Order {
        self.made
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

/// Largest number of entries of [`Order::HazardFreeNearby`] for `collisions` collisions, if the
/// busiest moving body has `uses` of them.
///
/// In every order the uses of a body lie a window apart. Beyond that, one entry in 64 and four
/// windows may be empty. This is a choice: it leaves most piles of the thesis' cubes where they are
/// (`pgs thesis order --grid` shows the empty entries of either order).
pub(super) fn nearby_entries_max(collisions: usize, uses: usize, window: IssueWindow) -> usize {
    let entries = collisions.max(uses.saturating_sub(1) * window.entries());
    // One empty entry in 64 is one beside 63 others.
    entries + entries / 63 + 4 * window.entries()
}

/// The cost of two orders on a pipeline that waits on hazards: cycles of all passes of a step,
/// including stalls. Waits for memory and the fill of the pipeline are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct OrderCosts {
    /// Cost of [`Order::AsGiven`]. Where the other order was taken this is a lower bound, because
    /// counting ends as soon as the cost is known to be higher.
    pub as_given: u64,
    /// Cost of [`Order::HazardFreeNearby`] without empty entries. `None` where this order was not
    /// made: hardly any order takes fewer cycles than as given, or a body has too many collisions
    /// to order them. Where it was taken this is an upper bound.
    pub reordered: Option<u64>,
}

/// One part in a hundred more: another order must save at least this much.
const fn one_percent_more(cycles: u64) -> u64 {
    cycles.saturating_add(cycles / 100)
}
