//! The first half of a step.
//!
//! A step is five calls there and five back. [`Accelerator::submit`] checks, orders, reserves,
//! packs (`pack.rs`) and starts; [`InFlight::wait`] waits, takes back, checks, reads and commits
//! (`in_flight.rs`). The caller's bodies change in the last call, and only there.

use std::sync::Arc;

use pgs_support::float_env::standard;

use super::accelerator::Accelerator;
use super::flight::{Engines, Flight, PackedStep, Started};
use super::in_flight::InFlight;
use super::report::StepReport;
use super::retry::with_retries;
use super::stopwatch::Stopwatch;
use crate::error::Error;
use crate::platform::Deadline;
use crate::scene::{Bodies, Collisions, StepParameters};

impl Accelerator {
    /// Solves the contacts of one time step and integrates it.
    ///
    /// The board takes the collisions in the [order](StepParameters::order) that the parameters ask
    /// for. Static bodies stay as they are, unless they are
    /// [kinematic](StepParameters::kinematic). The bodies change only if the step succeeds, and
    /// then all at once.
    ///
    /// Units: metres, kilograms, seconds, radians, world frame.
    ///
    /// # Errors
    /// [`Error::Input`]: the input was refused and nothing was sent. [`Error::Step`]: a fault of
    /// the board; [`Error::may_retry`] and [`Error::must_reopen`] say what to do.
    /// [`Error::MustReopen`] after a fault that could not be cleared. [`Error::OtherProcess`] in a child
    /// that was forked since the opening; so of every call.
    pub fn step<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &mut B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<StepReport, Error> {
        let counts = Arc::clone(&self.device.counts);
        let (reads, writes) = (counts.reads(), counts.writes());
        let (mut report, retries) = with_retries(parameters.retries, || {
            self.submit(bodies, collisions, parameters)?.wait(bodies)
        })?;
        report.retries = retries;
        report.register_reads = counts.reads() - reads;
        report.register_writes = counts.writes() - writes;
        Ok(report)
    }

    /// Starts a [step](Self::step) and returns at once. The caller may do other work until it asks
    /// for the results with [`InFlight::wait`].
    ///
    /// This call copies the bodies; only [`InFlight::wait`] touches them again.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn submit<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<InFlight<'_>, Error> {
        standard(move || {
            self.settle()?;
            let (mut watch, accesses) = (Stopwatch::start(), self.accesses());
            let into = (self.bank, Engines::Idle);
            let step = self.pack(into, bodies, collisions, parameters, &mut watch)?;
            let flight = self.begin(step, watch, accesses)?;
            Ok(InFlight::new(self, flight))
        })
    }

    /// Register reads and writes so far.
    pub(super) fn accesses(&self) -> (u64, u64) {
        (self.device.counts.reads(), self.device.counts.writes())
    }

    /// Starts a step that lies in its bank, while no other is in flight.
    pub(super) fn begin(
        &mut self,
        step: PackedStep,
        watch: Stopwatch,
        accesses: (u64, u64),
    ) -> Result<Flight, Error> {
        let PackedStep { plan, parameters, bank, .. } = &step;
        let mut flight = Flight { step, started: None, watch, accesses };
        self.bank = *bank;
        if step.sent.is_some() {
            let device = &mut self.device;
            let limit = plan.deadline(parameters, &device.capabilities);
            let deadline = Deadline::after(&*device.platform, limit);
            let armed = device.arm(plan, *bank, parameters);
            flight.step.host.start += flight.watch.lap();
            let doorbells = armed
                .and_then(|()| device.start())
                .map_err(|symptom| device.fail(symptom, &self.shapes))?;
            // From here on the board is at work.
            flight.step.host.wait = flight.watch.lap();
            flight.started = Some(Started { deadline, doorbells });
        }
        Ok(flight)
    }
}
