//! The second half of a step: wait, take back, check, read, commit.

use pgs_support::float_env::standard;

use super::accelerator::Accelerator;
use super::locate::locate;
use super::pack::PackedStep;
use super::report::{HostTimes, StepCycles, StepReport};
use super::results::{check_received, commit, commit_velocities, read};
use super::stopwatch::Stopwatch;
use crate::board::symptom::Symptom;
use crate::control_block::{Counters, Saturated};
use crate::error::Error;
use crate::fault::Fault;
use crate::platform::Deadline;
use crate::scene::Bodies;
use crate::validate::InputError;

/// A step that the board works on.
///
/// [`wait`](Self::wait) ends it. Dropped without, by a panic too, it stops and resets the board, in
/// bounded time, and takes the buffers back; the step has then never been, and the accelerator is
/// ready for the next. Even forgotten ([`std::mem::forget`]) it does no harm: the next call that
/// needs the board resets it first.
#[derive(Debug)]
#[must_use = "a step that is not waited for is stopped and was in vain"]
pub struct InFlight<'a> {
    pub(super) accelerator: &'a mut Accelerator,
    pub(super) flight: Flight,
}

/// What is known of a step between its start and its end.
#[derive(Debug)]
pub(super) struct Flight {
    pub(super) step: PackedStep,
    /// Nothing, where nothing moves and nothing is streamed.
    pub(super) started: Option<Started>,
    pub(super) watch: Stopwatch,
    /// Register reads and writes before the step.
    pub(super) accesses: (u64, u64),
}

/// A step on the board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Started {
    pub(super) deadline: Deadline,
    pub(super) doorbells: u64,
}

/// What the board said at the end of a step, whose results are back in their bank.
#[derive(Debug)]
pub(super) struct Ended {
    counters: Counters,
    report: StepReport,
}

impl<'a> InFlight<'a> {
    pub(super) fn new(accelerator: &'a mut Accelerator, flight: Flight) -> Self {
        Self { accelerator, flight }
    }

    /// Waits for the results and puts them into the bodies, which must be those that were given to
    /// [`Accelerator::submit`] or [`InFlight::prepare`].
    ///
    /// The time between start and this call counts for the deadline and for no phase of
    /// [`StepReport::host`].
    ///
    /// # Errors
    /// As [`Accelerator::step`]. [`InputError::OtherBodies`] if there are more or fewer bodies than
    /// were given: the step is then stopped, and the accelerator is ready for the next;
    /// [`Error::MustReopen`] in its place if the board could not be stopped.
    pub fn wait<B: Bodies + ?Sized>(mut self, bodies: &mut B) -> Result<StepReport, Error> {
        standard(move || {
            let ended = self.collect(bodies)?;
            self.finish(ended, bodies)
        })
    }

    /// Checks, reads and stores the results.
    pub(super) fn finish<B: Bodies + ?Sized>(
        &mut self,
        ended: Ended,
        bodies: &mut B,
    ) -> Result<StepReport, Error> {
        let read = self.read(&ended, bodies);
        read.map_err(|fault| self.failed(fault.into()))?;
        Ok(self.commit(ended, bodies))
    }

    /// Waits for the board, and takes back what it held of the step.
    pub(super) fn collect<B: Bodies + ?Sized>(&mut self, bodies: &B) -> Result<Ended, Error> {
        let (found, expected) = (bodies.len(), self.flight.step.bodies);
        if found != expected {
            let Accelerator { device, shapes, .. } = &mut *self.accelerator;
            device.settle(shapes)?;
            return Err(InputError::OtherBodies { found, expected }.into());
        }
        self.take_results().map_err(|symptom| self.failed(symptom))
    }

    fn take_results(&mut self) -> Result<Ended, Symptom> {
        let Self { accelerator, flight } = self;
        let PackedStep { plan, bank, sent, .. } = flight.step;
        // What the caller did meanwhile.
        flight.watch.lap();
        let device = &mut accelerator.device;
        let (Some(Started { deadline, doorbells }), Some(sent)) = (flight.started, sent) else {
            // Nothing moves, and nothing of it is streamed.
            let counts = device.capabilities.impulse_sum;
            let counters = Counters { impulse_sum: counts.then_some(0.0), ..Counters::default() };
            return Ok(Ended { counters, report: self.report(&counters) });
        };
        let interrupts = device.wait(&plan, &deadline)?;
        let counters = device.collect(&deadline)?;
        device.take_back(bank)?;
        flight.step.host.wait += flight.watch.lap();
        check_received(&plan, sent, &counters)?;
        let mut report = self.report(&counters);
        (report.doorbells, report.interrupts) = (doorbells, interrupts);
        report.descriptors = self.accelerator.device.descriptors();
        Ok(Ended { counters, report })
    }

    /// Checks and reads the results, which are in the accelerator's spare afterwards.
    pub(super) fn read<B: Bodies + ?Sized>(
        &mut self,
        ended: &Ended,
        bodies: &B,
    ) -> Result<(), Fault> {
        let Self { accelerator, flight } = self;
        let PackedStep { plan, bank, arranged, .. } = &flight.step;
        let Accelerator { device, orderings, spare, .. } = &mut **accelerator;
        let lives = arranged.live.map(|_| orderings[*bank].lives());
        // A step that was not started has no sums.
        let answered = ended.counters.sums.map(|(_, answered)| answered);
        read(device, spare, (plan, *bank), bodies, lives, answered)?;
        flight.step.host.unpack = flight.watch.lap();
        Ok(())
    }

    /// Puts what was read into the bodies.
    pub(super) fn commit<B: Bodies + ?Sized>(
        &mut self,
        ended: Ended,
        bodies: &mut B,
    ) -> StepReport {
        let Self { accelerator, flight } = self;
        match flight.step.parameters.integrate {
            true => commit(&accelerator.spare, bodies),
            false => commit_velocities(&accelerator.spare, bodies),
        }
        flight.step.host.commit = flight.watch.lap();
        let mut report = ended.report;
        report.host = flight.step.host;
        log::debug!(
            "step: {} bodies, {} collisions and {} empty entries ({:?}), {} passes, {} cycles ({} \
             stalled, {} waiting), {} hazards{}",
            report.bodies,
            report.collisions,
            report.empty,
            report.order,
            report.passes,
            report.cycles.total,
            report.cycles.stalls,
            report.cycles.waits,
            report.hazards,
            if report.saturated == Saturated::default() { "" } else { "; counters are saturated" },
        );
        report
    }

    /// The error of the step, after which the board is ready for the next if it can be.
    fn failed(&mut self, symptom: Symptom) -> Error {
        let Accelerator { device, shapes, .. } = &mut *self.accelerator;
        let error = device.fail(symptom, shapes);
        self.located(error)
    }

    /// Says of which of the caller's collisions an error speaks.
    pub(super) fn located(&self, mut error: Error) -> Error {
        let PackedStep { arranged, bank, .. } = &self.flight.step;
        if arranged.scheduled {
            let ordering = &self.accelerator.orderings[*bank];
            let lives = arranged.live.map(|_| ordering.lives());
            locate(&mut error, ordering.schedule(), lives);
        }
        error
    }

    /// What the step streamed and counted, so far.
    fn report(&self, counters: &Counters) -> StepReport {
        let PackedStep { plan, arranged, bodies, collisions, empty, .. } = &self.flight.step;
        let (work, waits) = (u64::from(counters.work), u64::from(counters.waits));
        let stalls = counters.cycles.saturating_sub(work).saturating_sub(waits);
        let (reads, writes) = self.accelerator.accesses();
        StepReport {
            bodies: *bodies as u64,
            collisions: *collisions as u64,
            order: arranged.order,
            order_choice: arranged.choice,
            empty: *empty as u64,
            verified: arranged.verified,
            live: arranged.live,
            passes: u32::try_from(plan.passes).unwrap_or(u32::MAX),
            cycles: StepCycles { total: counters.cycles, work, stalls, waits },
            clock_khz: self.accelerator.device.capabilities.clock_khz,
            bytes_to_device: plan.bytes_to_device(),
            bytes_from_device: plan.bytes_from_device(),
            hazards: u64::from(counters.hazards),
            impulse_sum: counters.impulse_sum,
            saturated: counters.saturated,
            register_reads: reads - self.flight.accesses.0,
            register_writes: writes - self.flight.accesses.1,
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
        standard(|| device.abandon(shapes));
    }
}
