//! This file waits for a step's results: on the interrupt, on the clock, and never without end.
//!
//! An interrupt is a hint, the descriptors in memory are the truth. Per wake-up: read all status
//! registers, acknowledge what they show, let the next interrupt through, look once more.

use std::time::Duration;

use super::cancellation::Cancellation;
use super::device::{Device, Statuses};
use super::fault::Fault;
use super::plan::{Plan, bytes};
use crate::accelerator::Counters;
use crate::axi_dma::Progress;
use crate::platform::{Deadline, acquire_from_device, poll_until};

/// How long a descriptor's status may take to reach memory after the interrupt.
const GRACE: Duration = Duration::from_millis(1);
/// Shortest time to wait for an interrupt before looking by oneself.
const SHORTEST_SLICE: Duration = Duration::from_millis(10);
/// How long a step that may be cancelled waits between two looks whether it was.
const CANCEL_LOOK: Duration = Duration::from_millis(10);
/// After so many missing interrupts in a row the driver no longer relies on them.
const MISSED_LIMIT: u32 = 2;

impl Device {
    /// Waits until every chain of the step is complete; the number of interrupts that woke.
    pub(super) fn wait(&mut self, plan: &Plan, deadline: &Deadline) -> Result<u64, Fault> {
        let completion = self.s2mm.len() - 1;
        let mut interrupts = 0;
        let mut slice = self.first_slice(deadline.limit());
        loop {
            // Asked before looking, so that there is one look after the deadline.
            let remaining = deadline.remaining(&*self.platform);
            let woke = self.wait_interrupt(slice.min(remaining))?.is_some();
            let statuses = self.statuses();
            self.check(&statuses)?;
            for (lane, status) in self.lanes_mut().zip(statuses) {
                if lane.channel.pending(status) != 0 {
                    lane.channel.acknowledge(status);
                }
            }
            let mut packet = statuses[completion].complete();
            if woke {
                interrupts += 1;
                self.platform.unmask_interrupt()?;
                // What came between reading and unmasking raised no interrupt.
                let channel = &mut self.s2mm[completion].channel;
                let again = channel.status();
                if channel.pending(again) != 0 {
                    channel.acknowledge(again);
                }
                packet |= again.complete();
            }
            let grace = if packet { GRACE.min(remaining) } else { Duration::ZERO };
            if self.complete_within(plan, grace)? {
                self.note_interrupt(woke || interrupts > 0);
                acquire_from_device();
                return Ok(interrupts);
            }
            if let Some(error) = self.control.sticky_error() {
                let registers = self.dump(&statuses);
                return Err(Fault::Accelerator { error: error.to_string(), registers });
            }
            if remaining.is_zero() {
                return Err(self.late("the end of the results", deadline));
            }
            slice = if packet { GRACE } else { (slice * 2).min(self.longest_slice(deadline)) };
        }
    }

    /// Waits for the interrupt, at most that long, unless the caller cancels.
    fn wait_interrupt(&self, time: Duration) -> Result<Option<u32>, Fault> {
        if self.cancellation.is_none() {
            return Ok(self.platform.wait_interrupt(time)?);
        }
        let mut left = time;
        loop {
            self.check_cancelled()?;
            let piece = left.min(CANCEL_LOOK);
            let came = self.platform.wait_interrupt(piece)?;
            left -= piece;
            if came.is_some() || left.is_zero() {
                return Ok(came);
            }
        }
    }

    /// Waits for the accelerator to say that it is done, then reads its counters.
    pub(super) fn collect(&mut self, deadline: &Deadline) -> Result<Counters, Fault> {
        let gone = || Fault::Gone { region: "the control block".to_owned() };
        let Self { control, cancellation, platform, .. } = self;
        let cancelled = || cancellation.as_ref().is_some_and(Cancellation::is_cancelled);
        let done = poll_until(&**platform, deadline, || match control.take_done() {
            Some(false) => cancelled().then_some(Err(Fault::Cancelled)),
            Some(true) => Some(Ok(())),
            None => Some(Err(gone())),
        });
        match done {
            Some(done) => done?,
            None => return Err(self.late("ap_done", deadline)),
        }
        if let Some(error) = self.control.sticky_error() {
            let registers = self.dump(&self.statuses());
            return Err(Fault::Accelerator { error: error.to_string(), registers });
        }
        Ok(self.control.counters(&self.capabilities))
    }

    /// How long to wait for the first interrupt before looking.
    ///
    /// A quarter of the default deadline is what a step takes at worst: looking earlier costs
    /// register accesses and finds nothing, unless interrupts do not come at all.
    fn first_slice(&self, limit: Duration) -> Duration {
        if self.missed_interrupts >= MISSED_LIMIT { GRACE } else { (limit / 4).max(SHORTEST_SLICE) }
    }

    fn longest_slice(&self, deadline: &Deadline) -> Duration {
        let share = if self.missed_interrupts >= MISSED_LIMIT { 16 } else { 4 };
        (deadline.limit() / share).max(SHORTEST_SLICE)
    }

    fn note_interrupt(&mut self, came: bool) {
        if came {
            self.missed_interrupts = 0;
            return;
        }
        self.missed_interrupts = self.missed_interrupts.saturating_add(1);
        if self.missed_interrupts == 1 {
            log::warn!("a step ended without an interrupt; found by looking");
        } else if self.missed_interrupts == MISSED_LIMIT {
            log::warn!("no interrupts come: polling until one does; is the interrupt connected?");
        }
    }

    /// Errors that the status registers show.
    fn check(&self, statuses: &Statuses) -> Result<(), Fault> {
        for (lane, status) in self.lanes().zip(statuses) {
            let name = lane.channel.name();
            if status.gone() {
                return Err(Fault::Gone { region: name.to_string() });
            }
            if status.errors() != 0 {
                return Err(Fault::Dma {
                    channel: name.to_string(),
                    status: status.to_string(),
                    descriptor: lane.channel.current_descriptor(),
                    registers: self.dump(statuses),
                });
            }
        }
        Ok(())
    }

    /// Whether all chains are complete, or become so within `grace`.
    fn complete_within(&mut self, plan: &Plan, grace: Duration) -> Result<bool, Fault> {
        let Self { s2mm, mm2s, platform, .. } = self;
        let grace = Deadline::after(&**platform, grace);
        let mut next = 0;
        let ended = poll_until(&**platform, &grace, || {
            // Lanes that were complete are not looked at again.
            while next < s2mm.len() + mm2s.len() {
                let place = next;
                let (lane, expected) = match s2mm.get_mut(place) {
                    Some(lane) => (lane, Some(bytes(plan.results(place)))),
                    None => (&mut mm2s[place - s2mm.len()], None),
                };
                let ended = match (lane.ring_mut().progress(), expected) {
                    (Progress::Running, _) => return None,
                    (Progress::Complete { .. }, None) => None,
                    (Progress::Complete { bytes, packet_ended }, Some(expected))
                        if bytes == expected && (packet_ended || expected == 0) =>
                    {
                        None
                    }
                    (ended, _) => Some((place, ended)),
                };
                if ended.is_some() {
                    return Some(ended);
                }
                next += 1;
            }
            Some(None)
        });
        match ended {
            None => Ok(false),
            Some(None) => Ok(true),
            Some(Some((place, progress))) => Err(self.broken_chain(plan, place, progress)),
        }
    }

    /// What a chain says that ended in another way than it should.
    fn broken_chain(&mut self, plan: &Plan, place: usize, progress: Progress) -> Fault {
        let statuses = self.statuses();
        // The channel's own status says more, if it has anything to say.
        if let Err(fault) = self.check(&statuses) {
            return fault;
        }
        let name = self.lanes().nth(place).map(|lane| lane.channel.name().to_string());
        let channel = name.unwrap_or_default();
        match progress {
            Progress::Failed { index, status } => Fault::Descriptor {
                channel,
                index,
                status: status.to_string(),
                registers: self.dump(&statuses),
            },
            Progress::Short { bytes: found } | Progress::Complete { bytes: found, .. } => {
                Fault::PacketLength { channel, expected: bytes(plan.results(place)), found }
            }
            Progress::Running => self.late_with("a descriptor", GRACE, &statuses),
        }
    }

    fn late(&self, awaited: &'static str, deadline: &Deadline) -> Fault {
        self.late_with(awaited, deadline.limit(), &self.statuses())
    }

    fn late_with(&self, awaited: &'static str, limit: Duration, statuses: &Statuses) -> Fault {
        Fault::Deadline { awaited, limit, registers: self.dump(statuses) }
    }
}
