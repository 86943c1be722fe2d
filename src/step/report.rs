//! This file says what a step reports: cycles by kind, bytes, register accesses, host times.

use std::time::Duration;

use pgs_interface::control::IMPULSE_SUM_MAX;

use crate::control_block::time_of;
use crate::control_block::{Saturated, impulse};
use crate::order::{LiveReport, Order, OrderCosts, OrderReport};

/// Clock cycles of a step on the accelerator, by what they were spent on.
///
/// Where the counter of work or of waits is [saturated](StepReport::saturated), it is at least this, and the
/// stalls are at most this.
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
    /// Checking parameters, shapes and sizes. Bodies and collisions are looked at while they are
    /// packed, except where a step's buffers have yet to be made.
    pub validate: Duration,
    /// Putting the collisions in order.
    pub order: Duration,
    /// Making buffers large enough, looking at bodies and collisions, and writing their records.
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

/// What limits a step: what would have to be better for it to be faster.
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

/// Why the collisions of a step were sent in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OrderChoice {
    /// The caller chose: [`StepParameters::order`](crate::StepParameters::order) names the order, or
    /// the caller wrote the collisions one after the other.
    Asked,
    /// The board does not wait on hazards. Only an order without hazards is solved right.
    NoInterlock,
    /// The board keeps only live bodies on chip. The order keeps few bodies alive.
    LiveBodies,
    /// The board waits on hazards. Of the order given and the order without hazards this one takes
    /// fewer cycles.
    Cheapest(OrderCosts),
}

/// What one step did.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepReport {
    /// Number of bodies.
    pub bodies: u64,
    /// Number of collisions.
    pub collisions: u64,
    /// The order in which they were sent: [`Order::HazardFree`] where [`Order::HazardFreeNearby`] gave way
    /// to it ([`Orderer::made`](crate::order::Orderer::made)).
    pub order: Order,
    /// Why this order and no other.
    pub order_choice: OrderChoice,
    /// Entries left empty between them, sent as collisions without contact points.
    pub empty: u64,
    /// What that order was proved to be, if it was to be [verified](crate::StepParameters::verify_order):
    /// no hazards; how many bodies are alive at once, and how long.
    pub verified: Option<OrderReport>,
    /// What the order takes of a bitstream that keeps only live bodies.
    pub live: Option<LiveReport>,
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
    /// Collisions that met a hazard, over all passes.
    pub hazards: u64,
    /// Sum of the accumulated normal impulses after the last contact pass, N s; `None` if the bitstream does
    /// not count it, or if the sum is [`IMPULSE_SUM_MAX`](Self::IMPULSE_SUM_MAX) or more, as
    /// [`saturated`](Self::saturated) says.
    pub impulse_sum: Option<f64>,
    /// Which counters stopped at their maximum. What they count is that or more.
    pub saturated: Saturated,
    /// 32-bit register reads.
    pub register_reads: u64,
    /// 32-bit register writes.
    pub register_writes: u64,
    /// Writes that started something: tails of descriptor rings, and the accelerator's start.
    pub doorbells: u64,
    /// Interrupts that woke the driver.
    pub interrupts: u64,
    /// Scatter-gather descriptors.
    pub descriptors: u64,
    /// How often the step was taken again after a fault, as far as it was
    /// [allowed](crate::StepParameters::retries). The register accesses are those of all attempts.
    pub retries: u32,
    /// Where the host's time went.
    pub host: HostTimes,
}

impl StepReport {
    /// Where the sum of the impulses stops, N s.
    pub const IMPULSE_SUM_MAX: f64 = impulse(IMPULSE_SUM_MAX);

    /// Time from start to done on the accelerator: cycles divided by the clock.
    ///
    /// Zero if the bitstream gives no clock.
    #[must_use]
    pub fn modelled_time(&self) -> Duration {
        time_of(self.cycles.total, self.clock_khz)
    }

    /// What limits the step: the larger of stalls and waits, if it adds more than 2 % to the
    /// pipeline's own cycles; else the pipeline.
    ///
    /// A pass takes the longer of computing and moving its data, so that any wait beyond the start
    /// of the streams means that the pipeline is not what limits it.
    #[must_use]
    pub fn limit(&self) -> Limit {
        let StepCycles { work, stalls, waits, .. } = self.cycles;
        if self.saturated.stalls() {
            // Waits are at least so many, stalls at most.
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
            empty: 0,
            verified: None,
            live: None,
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
