//! A step on its way: packed into a bank, then started.

use super::ordering::OrderSummary;
use super::packing::SentSums;
use super::report::HostTimes;
use super::stopwatch::Stopwatch;
use super::unique_id::UniqueId;
use crate::board::bank::Bank;
use crate::board::plan::Plan;
use crate::platform::Deadline;
use crate::scene::StepParameters;

/// A step whose records lie in a bank.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedStep {
    /// Tells this packing from every other.
    pub(super) id: UniqueId,
    pub(super) bank: Bank,
    pub(super) plan: Plan,
    /// The sums of the words sent; `None` if no body moves, or there is none, and nothing is
    /// streamed.
    pub(super) sent: Option<SentSums>,
    pub(super) parameters: StepParameters,
    /// Number of the caller's bodies.
    pub(super) bodies: usize,
    /// Number of the caller's collisions.
    pub(super) given: usize,
    /// Number of them with contact points.
    pub(super) collisions: usize,
    /// Empty entries that are sent.
    pub(super) empty: usize,
    pub(super) order_summary: OrderSummary,
    /// `Accelerator::shapes_loaded` at the time of packing.
    pub(super) shapes_loaded: u64,
    pub(super) host: HostTimes,
}

/// The state of the DMA engines while a step is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Engines {
    /// Without work: they may be stopped and reset, and all memory but the bank's may be freed.
    Idle,
    /// At work on another step, which nothing may disturb.
    Working,
}

/// The state of a step between its start and its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flight {
    pub(super) step: PackedStep,
    /// `None` where no body moves, or there is none, and nothing is streamed.
    pub(super) started: Option<Started>,
    pub(super) watch: Stopwatch,
    /// Register reads and writes before the step.
    pub(super) accesses: (u64, u64),
}

/// The deadline and the doorbells of a step on the board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Started {
    pub(super) deadline: Deadline,
    pub(super) doorbells: u64,
}
