//! The second half of a step: wait, take back, check, read, commit.

use pgs_support::float_env::standard;

use super::accelerator::Accelerator;
use super::flight::{Flight, PackedStep, Started};
use super::locate::locate;
use super::report::{HostTimes, StepCycles, StepReport};
use super::results::{check_received, commit, commit_velocities, impulses_of, read};
use crate::board::symptom::Symptom;
use crate::control_block::{Counters, Saturated};
use crate::error::Error;
use crate::fault::Fault;
use crate::order::Schedule;
use crate::scene::{Bodies, Impulses};
use crate::validate::InputError;

/// A step that the board works on.
///
/// [`wait`](Self::wait) ends it. A step that is dropped without it, also by a panic, stops and
/// resets the board in bounded time and takes the buffers back. Nothing of that step remains, and
/// the accelerator is ready for the next. Even a forgotten step ([`std::mem::forget`]) does no
/// harm: the next call that needs the board resets it first.
///
/// It borrows the accelerator. [`detach`](Self::detach) ends the borrow and lets the step go on.
#[derive(Debug)]
#[must_use = "a step that is dropped in flight is stopped: call `wait` for its results"]
pub struct InFlight<'a> {
    pub(super) accelerator: &'a mut Accelerator,
    pub(super) flight: Flight,
}

/// The counters of a step that has ended and whose results are back in their bank.
#[derive(Debug)]
pub(super) struct Ended {
    counters: Counters,
    report: StepReport,
}

impl<'a> InFlight<'a> {
    pub(super) fn new(accelerator: &'a mut Accelerator, flight: Flight) -> Self {
        Self { accelerator, flight }
    }

    /// Waits for the results and stores them in the bodies, which must be the bodies of the call to
    /// [`Accelerator::submit`] or [`InFlight::prepare`].
    ///
    /// The time between start and this call counts for the deadline and for no phase of
    /// [`StepReport::host`].
    ///
    /// # Errors
    /// As [`Accelerator::step`]. [`InputError::OtherBodies`] if the number of bodies differs from
    /// the number at the start: the step is then stopped, and the accelerator is ready for the
    /// next; [`Error::MustReopen`] in its place if the board could not be stopped.
    pub fn wait<B: Bodies + ?Sized>(mut self, bodies: &mut B) -> Result<StepReport, Error> {
        standard(move || {
            let ended = self.collect(bodies)?;
            self.finish(ended, bodies)
        })
    }

    /// The impulses of the step before, while this one is on the board:
    /// [`Accelerator::impulses`].
    #[must_use]
    pub fn impulses(&self) -> &[Impulses] {
        self.accelerator.impulses()
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

    /// Waits for the board, and takes the buffers of the step back.
    pub(super) fn collect<B: Bodies + ?Sized>(&mut self, bodies: &B) -> Result<Ended, Error> {
        self.accelerator.device.check_process()?;
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
        // The caller's own work since the start belongs to no phase.
        flight.watch.lap();
        let device = &mut accelerator.device;
        let (Some(Started { deadline, doorbells }), Some(sent)) = (flight.started, sent) else {
            // Nothing was streamed.
            let counters = Counters { impulse_sum: Some(0.0), ..Counters::default() };
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

    /// Checks the results and reads them into `Accelerator::staged`.
    pub(super) fn read<B: Bodies + ?Sized>(
        &mut self,
        ended: &Ended,
        bodies: &B,
    ) -> Result<(), Fault> {
        let Self { accelerator, flight } = self;
        let PackedStep { plan, bank, order_summary, given, .. } = &flight.step;
        let Accelerator { device, orderings, staged, impulses, .. } = &mut **accelerator;
        let schedule = order_summary.scheduled.then(|| orderings[*bank].schedule());
        let collision_of =
            |entry| schedule.map_or(Some(entry), |schedule: &Schedule| schedule.get(entry));
        let of_impulses = impulses_of(&device.s2mm, plan, *bank);
        let (impulse_sum, impulses_read) = impulses.read(plan, of_impulses, *given, collision_of);
        let (_, sent_sum) = ended.counters.sums;
        read(device, staged, (plan, *bank), bodies, (sent_sum, impulse_sum))?;
        impulses_read?;
        flight.step.host.unpack = flight.watch.lap();
        Ok(())
    }

    /// Stores the staged results in the bodies.
    pub(super) fn commit<B: Bodies + ?Sized>(
        &mut self,
        ended: Ended,
        bodies: &mut B,
    ) -> StepReport {
        let Self { accelerator, flight } = self;
        match flight.step.parameters.integrate {
            true => commit(&accelerator.staged, bodies),
            false => commit_velocities(&accelerator.staged, bodies),
        }
        if flight.step.parameters.impulses_out {
            accelerator.impulses.commit();
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

    /// Resets the board if it can be reset, and returns the error of the step.
    fn failed(&mut self, symptom: Symptom) -> Error {
        let Accelerator { device, shapes, .. } = &mut *self.accelerator;
        let error = device.fail(symptom, shapes);
        self.located(error)
    }

    /// Adds the caller's own index of a collision or body to an error.
    pub(super) fn located(&self, mut error: Error) -> Error {
        let PackedStep { order_summary, bank, .. } = &self.flight.step;
        if order_summary.scheduled {
            let ordering = &self.accelerator.orderings[*bank];
            locate(&mut error, ordering.schedule());
        }
        error
    }

    /// The report of the step, with everything that is known before the results are read.
    fn report(&self, counters: &Counters) -> StepReport {
        let PackedStep { plan, order_summary, bodies, collisions, empty, .. } = &self.flight.step;
        let (work, waits) = (u64::from(counters.work), u64::from(counters.waits));
        let stalls = counters.cycles.saturating_sub(work).saturating_sub(waits);
        let (reads, writes) = self.accelerator.accesses();
        StepReport {
            bodies: *bodies as u64,
            collisions: *collisions as u64,
            order: order_summary.order,
            order_choice: order_summary.choice,
            queued: plan.queued,
            empty: *empty as u64,
            verified: order_summary.verified,
            passes: u32::try_from(plan.passes.total()).unwrap_or(u32::MAX),
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
    /// Stops a step that the caller did not wait for.
    fn drop(&mut self) {
        let Accelerator { device, shapes, .. } = &mut *self.accelerator;
        standard(|| device.abandon(shapes));
    }
}
