//! The report of a step: cycles by kind, bytes, register accesses, host times.

use std::time::Duration;

use pgs_interface::control::IMPULSE_SUM_MAX;

use crate::control_block::time_of;
use crate::control_block::{Saturated, impulse};
use crate::order::{Order, OrderCosts};

/// Clock cycles of a step on the accelerator, by their use.
///
/// If the counter of work or of waits is [saturated](StepReport::saturated), the true count is at
/// least the value here, and the true stalls are at most the stalls here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StepCycles {
    /// From start to done.
    pub total: u64,
    /// By the formula of the interface specification: neither stalled nor waiting.
    pub work: u64,
    /// Cycles in which an issue waited for a velocity to be written back.
    pub stalls: u64,
    /// Cycles in which the accelerator waited for a stream.
    pub waits: u64,
}

/// Host time of a step, by phase, on the host's clock.
///
/// With the emulated board, `wait` is the time that the emulation takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HostTimes {
    /// Checking parameters, shapes and sizes. Packing checks bodies and collisions; only a step
    /// whose buffers have yet to be made checks them here.
    pub validate: Duration,
    /// Putting the collisions in order.
    pub order: Duration,
    /// Making buffers large enough, checking bodies and collisions, and writing their records.
    pub pack: Duration,
    /// Handing over, descriptors, arguments.
    pub start: Duration,
    /// Doorbells, waiting for the accelerator, reading its counters, and taking the buffers back.
    pub wait: Duration,
    /// Reading and checking the results.
    pub unpack: Duration,
    /// Storing the results with the caller.
    pub commit: Duration,
}

/// The part that limits a step: a faster step needs a better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// The pipeline's initiation interval and depth.
    Pipeline,
    /// Waiting for velocities to be written back.
    Hazards,
    /// Memory that delivers less than the pipeline takes; in a tiny step, the latency of its start.
    Streams,
    /// Not known, because a counter of cycles is [saturated](StepReport::saturated).
    Unknown,
}

/// The reason for the order in which the collisions of a step were sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OrderChoice {
    /// The caller chose: [`StepParameters::order`](crate::StepParameters::order) names the order,
    /// the parameters ask to verify it, or the caller wrote the collisions one after the other.
    Asked,
    /// The board does not wait on hazards. Only an order without hazards is solved right.
    NoInterlock,
    /// The board has an issue queue, which keeps hazards apart.
    Queue,
    /// The board waits on hazards, and has no queue. This order takes the fewest cycles of two: the
    /// order as given and the order without hazards.
    Cheapest(OrderCosts),
}

/// The counts, cycles and times of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepReport {
    /// Number of bodies.
    pub bodies: u64,
    /// Number of collisions with contact points.
    pub collisions: u64,
    /// The order in which the collisions were sent. Collisions that were
    /// [written](crate::Accelerator::write) are sent as given, also through the queue
    /// ([`Self::queued`]).
    pub order: Order,
    /// Whether the collisions went through the board's issue queue, which solves them in another
    /// order where they meet hazards.
    pub queued: bool,
    /// The reason for this order.
    pub order_choice: OrderChoice,
    /// Empty entries between the collisions, sent as collisions without contact points: the entries
    /// that [`Order::HazardFree`] added, and in the other orders the caller's own collisions of
    /// count 0.
    pub empty: u64,
    /// Whether the order was to be [verified](crate::StepParameters::verify_order), and has no
    /// hazard.
    pub verified: bool,
    /// Passes over the collisions: contact and friction iterations.
    pub passes: u32,
    /// Clock cycles, as the accelerator counted them.
    pub cycles: StepCycles,
    /// The clock that counts them, kHz.
    pub clock_khz: u32,
    /// Bytes streamed to the accelerator.
    pub bytes_to_device: u64,
    /// Bytes streamed back.
    pub bytes_from_device: u64,
    /// Collisions that met a hazard, over all passes. In an issue queue the oldest one alone meets
    /// one: others pass it.
    pub hazards: u64,
    /// Sum of the accumulated normal impulses after the last contact pass, N s. `None` if the
    /// bitstream does not count it, or if the sum is [`IMPULSE_SUM_MAX`](Self::IMPULSE_SUM_MAX) or
    /// more, as [`saturated`](Self::saturated) tells.
    pub impulse_sum: Option<f64>,
    /// Which counters stopped at their maximum. The true count is that value or more.
    pub saturated: Saturated,
    /// 32-bit register reads.
    pub register_reads: u64,
    /// 32-bit register writes.
    pub register_writes: u64,
    /// Register writes that started something: tails of descriptor rings, and the accelerator's
    /// start.
    pub doorbells: u64,
    /// Interrupts that woke the driver.
    pub interrupts: u64,
    /// Scatter-gather descriptors.
    pub descriptors: u64,
    /// Number of repetitions of the step after faults, within the
    /// [limit](crate::StepParameters::retries). The register accesses are the sum over all
    /// attempts.
    pub retries: u32,
    /// The host's time, by phase.
    pub host: HostTimes,
}

impl StepReport {
    /// The maximum of the sum of impulses, N s.
    pub const IMPULSE_SUM_MAX: f64 = impulse(IMPULSE_SUM_MAX);

    /// Time from start to done on the accelerator: cycles divided by the clock.
    ///
    /// Zero if the bitstream gives no clock.
    #[must_use]
    pub fn modelled_time(&self) -> Duration {
        time_of(self.cycles.total, self.clock_khz)
    }

    /// The part that limits the step: the larger of stalls and waits, if it adds more than 2 % to
    /// the pipeline's own cycles; else the pipeline.
    ///
    /// A pass takes the longer of computing and moving its data. Any wait beyond the start of the
    /// streams therefore means that the pipeline is not the limit.
    #[must_use]
    pub fn limit(&self) -> Limit {
        let StepCycles { work, stalls, waits, .. } = self.cycles;
        if self.saturated.stalls() {
            // The true waits are at least this number, the true stalls at most.
            let sure = !self.saturated.work && waits >= stalls && waits.saturating_mul(50) > work;
            return if sure { Limit::Streams } else { Limit::Unknown };
        }
        if stalls.max(waits).saturating_mul(50) <= work {
            Limit::Pipeline
        } else if stalls >= waits {
            Limit::Hazards
        } else {
            Limit::Streams
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(work: u64, stalls: u64, waits: u64) -> StepReport {
        StepReport {
            bodies: 0,
            collisions: 0,
            order: Order::AsGiven,
            order_choice: OrderChoice::Asked,
            queued: false,
            empty: 0,
            verified: false,
            passes: 0,
            cycles: StepCycles { total: work + stalls + waits, work, stalls, waits },
            clock_khz: 275_000,
            bytes_to_device: 0,
            bytes_from_device: 0,
            hazards: 0,
            impulse_sum: None,
            saturated: Saturated::default(),
            register_reads: 0,
            register_writes: 0,
            doorbells: 0,
            interrupts: 0,
            descriptors: 0,
            retries: 0,
            host: HostTimes::default(),
        }
    }

    #[test]
    fn stalls_and_waits_limit_when_they_add_more_than_two_percent() {
        assert_eq!(report(1000, 20, 20).limit(), Limit::Pipeline);
        assert_eq!(report(1000, 21, 20).limit(), Limit::Hazards);
        assert_eq!(report(1000, 20, 21).limit(), Limit::Streams);
        assert_eq!(report(0, 0, 0).limit(), Limit::Pipeline);
    }

    #[test]
    fn a_saturated_counter_tells_the_limit_only_if_no_more_could_change_it() {
        let limit = |work, stalls, waits, saturated| {
            StepReport { saturated, ..report(work, stalls, waits) }.limit()
        };
        let waits = Saturated { waits: true, ..Saturated::default() };
        assert_eq!(limit(1000, 20, 21, waits), Limit::Streams);
        assert_eq!(limit(1000, 22, 21, waits), Limit::Unknown);
        assert_eq!(limit(1000, 0, 20, waits), Limit::Unknown);
        let work = Saturated { work: true, ..Saturated::default() };
        assert_eq!(limit(1000, 20, 21, work), Limit::Unknown);
        let others = Saturated { hazards: true, impulse_sum: true, ..Saturated::default() };
        assert_eq!(limit(1000, 20, 20, others), Limit::Pipeline);
    }
}
