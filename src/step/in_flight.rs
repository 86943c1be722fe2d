//! This file is the second half of a step: wait, take back, check, unpack, commit.

use std::time::{Duration, Instant};

use super::locate::locate;
use super::ordering::Arranged;
use super::packing::Sent;
use super::plan::Plan;
use super::report::{HostTimes, StepCycles, StepReport};
use super::solver::Accelerator;
use super::symptom::Symptom;
use crate::accelerator::Counters;
use crate::error::Error;
use crate::platform::Deadline;
use crate::scene::{Bodies, InputError};

/// A step that the board works on.
///
/// [`wait`](Self::wait) ends it. Dropped without, by a panic too, it stops and resets the board, in
/// bounded time, and takes the buffers back; the step has then never been, and the accelerator is
/// ready for the next. Even forgotten ([`std::mem::forget`]) it does no harm: the next call that
/// needs the board resets it first.
#[derive(Debug)]
#[must_use = "a step that is not waited for is stopped and was in vain"]
pub struct InFlight<'a> {
    accelerator: &'a mut Accelerator,
    flight: Flight,
}

/// What is known of a step between its start and its end.
#[derive(Debug)]
pub(super) struct Flight {
    pub(super) plan: Plan,
    /// Nothing, where nothing moves and nothing is streamed.
    pub(super) started: Option<Started>,
    /// Bodies and collisions as given.
    pub(super) bodies: usize,
    pub(super) collisions: usize,
    /// Entries that the order added.
    pub(super) empty: usize,
    pub(super) arranged: Arranged,
    pub(super) host: HostTimes,
    pub(super) watch: Stopwatch,
    /// Register reads and writes before the step.
    pub(super) accesses: (u64, u64),
}

/// A step on the board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Started {
    pub(super) sent: Sent,
    pub(super) deadline: Deadline,
    pub(super) doorbells: u64,
}

impl<'a> InFlight<'a> {
    pub(super) fn new(accelerator: &'a mut Accelerator, flight: Flight) -> Self {
        Self { accelerator, flight }
    }

    /// Waits for the results and puts them into the bodies, which must be those that were given to
    /// [`Accelerator::submit`].
    ///
    /// The time between the two calls counts for the deadline and for no phase of
    /// [`StepReport::host`].
    ///
    /// # Errors
    /// As [`Accelerator::step`]. [`InputError::OtherBodies`] if there are more or fewer bodies than
    /// were given: the step is then stopped, and the accelerator is ready for the next;
    /// [`Error::MustReopen`] in its place if the board could not be stopped.
    pub fn wait<B: Bodies + ?Sized>(mut self, bodies: &mut B) -> Result<StepReport, Error> {
        let (found, expected) = (bodies.len(), self.flight.bodies);
        if found != expected {
            let Accelerator { device, shapes, .. } = &mut *self.accelerator;
            device.settle(shapes)?;
            return Err(InputError::OtherBodies { found, expected }.into());
        }
        let ended = self.end(bodies);
        let Self { accelerator, flight } = &mut self;
        let mut report = ended.map_err(|symptom| {
            let Accelerator { device, shapes, ordering, .. } = &mut **accelerator;
            let mut error = device.fail(symptom, shapes);
            if flight.arranged.scheduled {
                let lives = flight.arranged.live.map(|_| ordering.lives());
                locate(&mut error, ordering.schedule(), lives);
            }
            error
        })?;
        for (index, (pose, velocity)) in accelerator.spare.drain(..).enumerate() {
            bodies.commit(index, pose, velocity);
        }
        flight.host.commit = flight.watch.lap();
        report.host = flight.host;
        report.register_reads = accelerator.device.counts.reads() - flight.accesses.0;
        report.register_writes = accelerator.device.counts.writes() - flight.accesses.1;
        log::debug!(
            "step: {} bodies, {} collisions and {} empty entries ({:?}), {} passes, {} cycles ({} \
             stalled, {} waiting), {} hazards",
            report.bodies,
            report.collisions,
            report.empty,
            report.order,
            report.passes,
            report.cycles.total,
            report.cycles.stalls,
            report.cycles.waits,
            report.hazards
        );
        Ok(report)
    }

    /// Everything before commitment; the results are in the accelerator's spare afterwards.
    fn end<B: Bodies + ?Sized>(&mut self, bodies: &B) -> Result<StepReport, Symptom> {
        let Self { accelerator, flight } = self;
        let (plan, live) = (&flight.plan, flight.arranged.live);
        // What the caller did meanwhile.
        flight.watch.lap();
        let Some(Started { sent, deadline, doorbells }) = flight.started else {
            // Nothing moves, and nothing of it is streamed.
            accelerator.unpack(plan, bodies, live, None)?;
            let counts = accelerator.device.capabilities.impulse_sum;
            let counters = Counters { impulse_sum: counts.then_some(0.0), ..Counters::default() };
            return Ok(self.report(&counters));
        };
        let interrupts = accelerator.device.wait(plan, &deadline)?;
        let counters = accelerator.device.collect(&deadline)?;
        accelerator.device.take_back()?;
        flight.host.wait = flight.watch.lap();
        Accelerator::check_received(plan, sent, &counters)?;
        accelerator.unpack(plan, bodies, live, counters.sums.map(|(_, answered)| answered))?;
        flight.host.unpack = flight.watch.lap();

        let mut report = self.report(&counters);
        (report.doorbells, report.interrupts) = (doorbells, interrupts);
        report.descriptors = self.accelerator.device.descriptors();
        Ok(report)
    }

    /// What the step streamed and counted.
    fn report(&self, counters: &Counters) -> StepReport {
        let Flight { plan, arranged, .. } = &self.flight;
        let (work, waits) = (u64::from(counters.work), u64::from(counters.waits));
        let stalls = counters.cycles.saturating_sub(work).saturating_sub(waits);
        StepReport {
            bodies: self.flight.bodies as u64,
            collisions: self.flight.collisions as u64,
            order: arranged.order,
            empty: self.flight.empty as u64,
            verified: arranged.verified,
            live: arranged.live,
            passes: u32::try_from(plan.passes).unwrap_or(u32::MAX),
            cycles: StepCycles { total: counters.cycles, work, stalls, waits },
            clock_khz: self.accelerator.device.capabilities.clock_khz,
            bytes_to_device: plan.bytes_to_device(),
            bytes_from_device: plan.bytes_from_device(),
            hazards: u64::from(counters.hazards),
            impulse_sum: counters.impulse_sum,
            register_reads: 0,
            register_writes: 0,
            doorbells: 0,
            interrupts: 0,
            descriptors: 0,
            retries: 0,
            host: HostTimes::default(),
        }
    }
}

impl Drop for InFlight<'_> {
    /// Stops a step that nobody waited for.
    fn drop(&mut self) {
        let Accelerator { device, shapes, .. } = &mut *self.accelerator;
        device.abandon(shapes);
    }
}

/// Host time by laps.
#[derive(Debug)]
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    /// Begins the first lap.
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the last lap.
    pub(super) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
