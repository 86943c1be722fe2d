//! Waits for a step's results: on the interrupt, on the clock, and never beyond the deadline.
//!
//! An interrupt is a hint, the descriptors in memory are the truth. Per wake-up: read all status
//! registers, acknowledge what they show, let the next interrupt through, look once more.

use std::time::Duration;

use super::anomalies::Anomaly;
use super::cancellation::Cancellation;
use super::device::{Device, Statuses};
use super::plan::{Plan, bytes};
use super::symptom::Symptom;
use super::symptom::control_block_reset;
use crate::axi_dma::Progress;
use crate::control_block::Counters;
use crate::control_block::time_of;
use crate::fault::{Awaited, Fault};
use crate::platform::{Deadline, acquire_from_device, poll_until};

/// How long the status of descriptors is polled after the interrupt, before the registers are read
/// again.
const GRACE: Duration = Duration::from_millis(1);
/// A status that reaches memory later than this after the interrupt is an anomaly.
const NOTICEABLE: Duration = Duration::from_micros(10);
/// The shortest wait for an interrupt before the driver polls.
const SHORTEST_SLICE: Duration = Duration::from_millis(10);
/// How often a waiting step checks its cancellation.
const CANCEL_LOOK: Duration = Duration::from_millis(10);
/// After this number of missing interrupts in a row the driver no longer relies on them.
const MISSED_LIMIT: u32 = 2;
/// After this number of interrupts that did not end the step, the line stays masked until the step
/// ends, and the driver polls.
const STORM: u64 = 16;

/// The state of all chains of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Chains {
    /// Complete at the first look.
    Complete,
    /// Complete at a later look.
    BecameComplete,
    /// Not complete.
    Running,
}

impl Device {
    /// Waits until every chain of the step is complete; returns the number of interrupts that came.
    pub(crate) fn wait(&mut self, plan: &Plan, deadline: &Deadline) -> Result<u64, Symptom> {
        let completion = self.s2mm.len() - 1;
        // No interrupt before the last ended the step. The limit holds even if the clock stands
        // still.
        let mut interrupts = 0;
        let mut spurious = 0;
        let mut slice = self.first_slice(deadline.limit());
        loop {
            // Read first, so that one more look follows after the deadline.
            let remaining = deadline.remaining(&*self.platform);
            let time = slice.min(remaining);
            let woke = if interrupts < STORM {
                self.wait_interrupt(time)?.is_some()
            } else {
                self.check_cancelled()?;
                self.platform.pause(time);
                // The line is masked; this tells whether the board is still there.
                self.platform.wait_interrupt(Duration::ZERO)?;
                false
            };
            let statuses = self.statuses();
            self.check(&statuses)?;
            let mut pending = false;
            for (port, status) in self.ports_mut().zip(statuses) {
                if port.channel.pending(status) != 0 {
                    pending = true;
                    port.channel.acknowledge(status);
                }
            }
            let mut packet = statuses[completion].complete();
            if woke {
                interrupts += 1;
                spurious += u64::from(!pending);
                if interrupts < STORM {
                    self.platform.unmask_interrupt()?;
                }
                // A completion between reading and unmasking raised no interrupt.
                let channel = &mut self.s2mm[completion].channel;
                let again = channel.status();
                if channel.pending(again) != 0 {
                    channel.acknowledge(again);
                }
                packet |= again.complete();
            }
            let looked = self.platform.now();
            // The wait has taken some of the time that remained.
            let left = deadline.remaining(&*self.platform);
            let grace = if packet { GRACE.min(left) } else { Duration::ZERO };
            let chains = self.complete_within(plan, grace)?;
            // Reading many descriptors takes time, too: complete at the first look is never late.
            let waited = chains != Chains::Complete;
            if packet && waited && self.platform.now().saturating_sub(looked) > NOTICEABLE {
                self.anomalies.tell(Anomaly::LateStatus);
            }
            let odd = woke && !pending;
            if chains != Chains::Running {
                if odd {
                    self.anomalies.tell(Anomaly::SpuriousInterrupt);
                }
                if !packet && self.acknowledge_completion()? {
                    interrupts += 1;
                }
                self.note_interrupt(interrupts > spurious);
                if interrupts >= STORM {
                    // The storm may be over, and the next step relies on interrupts.
                    self.platform.unmask_interrupt()?;
                }
                acquire_from_device();
                return Ok(interrupts);
            }
            if let Some(error) = self.control.sticky_error() {
                return Err(Symptom::Sticky(error));
            }
            if odd {
                // Neither a channel nor the accelerator raised it.
                self.anomalies.tell(Anomaly::SpuriousInterrupt);
            }
            if interrupts >= STORM {
                self.anomalies.tell(Anomaly::InterruptStorm);
            }
            if remaining.is_zero() {
                return Err(Symptom::Late { awaited: Awaited::Results, limit: deadline.limit() });
            }
            slice = match packet || interrupts >= STORM {
                true => GRACE,
                // A spurious interrupt does not lengthen the next wait.
                false if odd => slice,
                false => (slice * 2).min(self.longest_slice(deadline)),
            };
        }
    }

    /// Waits for the interrupt, at most for `time`, unless the caller cancels.
    fn wait_interrupt(&self, time: Duration) -> Result<Option<u32>, Fault> {
        if self.cancellation.is_none() {
            return Ok(self.platform.wait_interrupt(time)?);
        }
        let mut left = time;
        loop {
            self.check_cancelled()?;
            let piece = left.min(CANCEL_LOOK);
            let before = self.platform.now();
            let came = self.platform.wait_interrupt(piece)?;
            left -= piece;
            // A platform without an interrupt returns early, so that the caller polls.
            let early = self.platform.now().saturating_sub(before) < piece;
            if came.is_some() || early || left.is_zero() {
                return Ok(came);
            }
        }
    }

    /// Acknowledges the completion of a step that polling found complete: its interrupt would be
    /// taken for the next step's. Returns whether the interrupt had already come.
    fn acknowledge_completion(&mut self) -> Result<bool, Fault> {
        let Some(port) = self.s2mm.last_mut() else { return Ok(false) };
        let status = port.channel.status();
        if status.gone() || port.channel.pending(status) == 0 {
            return Ok(false);
        }
        port.channel.acknowledge(status);
        let came = self.platform.wait_interrupt(Duration::ZERO)?.is_some();
        if came {
            self.platform.unmask_interrupt()?;
        }
        Ok(came)
    }

    /// Waits for the accelerator's done flag, then reads its counters.
    pub(crate) fn collect(&mut self, deadline: &Deadline) -> Result<Counters, Symptom> {
        let gone = || Symptom::Known(Fault::Gone { region: "the control block".to_owned() });
        let Self { control, cancellation, platform, .. } = self;
        let cancelled = || cancellation.as_ref().is_some_and(Cancellation::is_cancelled);
        let done = poll_until(&**platform, deadline, || match control.take_done() {
            Some(false) => cancelled().then_some(Err(Fault::Cancelled.into())),
            Some(true) => Some(Ok(())),
            None => Some(Err(gone())),
        });
        match done {
            Some(done) => done?,
            None => {
                return Err(Symptom::Late { awaited: Awaited::Done, limit: deadline.limit() });
            }
        }
        if let Some(error) = self.control.sticky_error() {
            return Err(Symptom::Sticky(error));
        }
        let counters = self.control.counters();
        match counters.cycles {
            // All ones: no step takes two thousand years.
            u64::MAX => return Err(gone()),
            // They were read last: the other counters may be as after a reset, too.
            0 => return Err(control_block_reset().into()),
            _ => {}
        }
        let clock_khz = self.capabilities.clock_khz;
        self.took = (clock_khz > 0).then(|| time_of(counters.cycles, clock_khz));
        Ok(counters)
    }

    /// How long to wait for the first interrupt before polling: twice the time of the step before,
    /// so that a lost interrupt costs the time of one step.
    ///
    /// Earlier polling costs register accesses and finds nothing, unless no interrupts come. The
    /// time of the first step is unknown; a quarter of the default deadline is its upper limit.
    fn first_slice(&self, limit: Duration) -> Duration {
        if self.missed_interrupts >= MISSED_LIMIT {
            return GRACE;
        }
        let worst = limit / 4;
        self.took.map_or(worst, |took| worst.min(took.saturating_mul(2))).max(SHORTEST_SLICE)
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
            self.anomalies.tell(Anomaly::MissedInterrupt);
        } else if self.missed_interrupts == MISSED_LIMIT {
            self.anomalies.tell(Anomaly::NoInterrupts);
        }
    }

    /// Fails on the first status register that shows an error, or that a reset has halted.
    fn check(&self, statuses: &Statuses) -> Result<(), Symptom> {
        for (place, (port, status)) in self.ports().zip(statuses).enumerate() {
            let halted = port.running() && status.halted();
            if status.gone() || status.errors() != 0 || halted {
                return Err(Symptom::Status { place, status: *status });
            }
        }
        Ok(())
    }

    /// Whether all chains are complete, or become so within `grace`.
    fn complete_within(&mut self, plan: &Plan, grace: Duration) -> Result<Chains, Symptom> {
        let Self { s2mm, mm2s, platform, .. } = self;
        let grace = Deadline::after(&**platform, grace);
        let mut next = 0;
        let mut found = Chains::Complete;
        let ended = poll_until(&**platform, &grace, || {
            // A port that was complete is not read again.
            while next < s2mm.len() + mm2s.len() {
                let place = next;
                let (port, expected) = match s2mm.get_mut(place) {
                    Some(port) => (port, Some(bytes(plan.results(place)))),
                    None => (&mut mm2s[place - s2mm.len()], None),
                };
                let ended = match (port.ring_mut().progress(), expected) {
                    (Progress::Running, _) => {
                        found = Chains::BecameComplete;
                        return None;
                    }
                    (Progress::Complete { .. }, None) => None,
                    (Progress::Complete { bytes, packet_ended }, Some(expected))
                        if bytes == expected && (packet_ended || expected == 0) =>
                    {
                        None
                    }
                    _ => Some(place),
                };
                if ended.is_some() {
                    return Some(ended);
                }
                next += 1;
            }
            Some(None)
        });
        match ended {
            None => Ok(Chains::Running),
            Some(None) => Ok(found),
            Some(Some(place)) => Err(Symptom::Chain { place }),
        }
    }
}
