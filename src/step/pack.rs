//! Packs a step into a bank of buffers: check, order, reserve, pack.

use super::accelerator::Accelerator;
use super::flight::{Engines, PackedStep};
use super::ordering::{OrderSummary, Ordering, OrderingContext};
use super::packing::{PackInput, SentSums};
use super::report::HostTimes;
use super::reserve::{refuse, reserve};
use super::stopwatch::Stopwatch;
use super::unique_id::UniqueId;
use crate::board::bank::Bank;
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::error::Error;
use crate::order::Ordered;
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::validate::{InputError, Limits, Scene, preflight, validate};

/// The caller's arguments of a step, with the board's shapes and limits.
struct Input<'a, B: ?Sized, C: ?Sized> {
    bodies: &'a B,
    collisions: &'a C,
    parameters: &'a StepParameters,
    shapes: &'a [Shape],
    limits: &'a Limits,
}

impl<'a, B: Bodies + ?Sized, C: Collisions + ?Sized> Input<'a, B, C> {
    /// Refuses sizes and parameters that no bodies or collisions could make right.
    fn check(&self) -> Result<Scene<'a>, InputError> {
        preflight(self.bodies, self.collisions, self.shapes, self.parameters, self.limits)
    }

    /// Refuses everything that packing would find, and names it.
    fn check_all(&self) -> Result<(), InputError> {
        validate(self.bodies, self.collisions, self.shapes, self.parameters, self.limits)
    }

    /// Orders the collisions.
    fn order(&self, ordering: &mut Ordering, device: &Device) -> Result<OrderSummary, InputError> {
        let capabilities = &device.capabilities;
        let context = OrderingContext { capabilities, limits: self.limits, shapes: self.shapes };
        let order_summary = ordering.order(self.bodies, self.collisions, self.parameters, context);
        // An error of the input is reported before an error of its order.
        order_summary.or_else(|error| self.check_all().and(Err(error)))
    }

    /// Lays the step out over the channels.
    fn plan(&self, ordering: &Ordering, order_summary: &OrderSummary, device: &Device) -> Plan {
        let bodies = self.bodies.len();
        let collisions = match bodies {
            // Nothing is streamed.
            0 => 0,
            _ if order_summary.scheduled => ordering.schedule().len(),
            _ => self.collisions.len(),
        };
        Plan {
            bodies,
            collisions,
            passes: self.parameters.passes(),
            variant: self.limits.variant,
            streamed_masses: device.capabilities.streams_masses(self.shapes.len()),
            queued: order_summary.queued,
        }
    }

    /// Writes the records into the bank. Returns the sums, whether the checks passed all input, and
    /// the number of paddings.
    fn pack(
        &self,
        device: &mut Device,
        (ordering, order_summary): (&Ordering, &OrderSummary),
        (plan, bank): (&Plan, Bank),
        scene: &Scene<'a>,
    ) -> (SentSums, bool, usize) {
        let Self { bodies, collisions, .. } = *self;
        if order_summary.scheduled {
            let schedule = ordering.schedule();
            let added = plan.collisions.saturating_sub(schedule.collisions());
            let added = order_summary.empty.map(|_| added);
            let collisions = &Ordered { collisions, schedule };
            let input = PackInput { bodies, collisions, added, scene };
            device.pack(plan, bank, &input)
        } else {
            let input = PackInput { bodies, collisions, added: None, scene };
            device.pack(plan, bank, &input)
        }
    }
}

impl Accelerator {
    /// Packs a step into a bank that no engine works on: check, order, reserve, pack.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        (bank, engines): (Bank, Engines),
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        watch: &mut Stopwatch,
    ) -> Result<PackedStep, Error> {
        self.forget(bank);
        let mut host = HostTimes::default();
        let Self { orderings, device, limits, shapes, packed, .. } = self;
        let input = Input { bodies, collisions, parameters, shapes, limits };

        let scene = input.check()?;
        host.validate = watch.lap();

        let order_summary = input.order(&mut orderings[bank], device)?;
        host.order = watch.lap();

        let ordering = &orderings[bank];
        let plan = input.plan(ordering, &order_summary, device);
        let given = collisions.len();
        let ordered = ordering.schedule().collisions();
        let all_sent =
            !order_summary.scheduled || ordered + order_summary.empty.unwrap_or(0) == given;
        let cancelled = engines == Engines::Idle && device.check_cancelled().is_err();
        // Packing checks everything that it sends. The full check is for the rest: input that is
        // not sent, and input whose error another error would hide.
        if !all_sent || plan.bodies == 0 || cancelled || !device.has_room(&plan, bank) {
            input.check_all()?;
        }
        reserve((&mut *device, packed), shapes, (&plan, bank), engines)
            .map_err(|symptom| refuse(device, shapes, symptom, engines))?;

        let (mut sent, mut paddings) = (None, 0);
        if plan.bodies > 0 {
            let order = (ordering, &order_summary);
            let (sums, good, padded) = input.pack(device, order, (&plan, bank), &scene);
            if !good {
                input.check_all()?;
                // The input is right now, and was not right when it was packed.
                return Err(InputError::Unsteady.into());
            }
            (sent, paddings) = (Some(sums), padded);
        }
        host.pack = watch.lap();

        let without_points = match sent {
            // Nothing could move, so that validation has refused every other collision.
            None => given,
            Some(_) => order_summary.empty.unwrap_or(paddings),
        };
        Ok(self.keep(PackedStep {
            id: UniqueId::new(),
            bank,
            plan,
            sent,
            parameters: *parameters,
            bodies: bodies.len(),
            given,
            collisions: given.saturating_sub(without_points),
            empty: paddings,
            order_summary,
            shapes_loaded: self.shapes_loaded,
            host,
        }))
    }

    /// Records which step lies in a bank.
    pub(super) fn keep(&mut self, step: PackedStep) -> PackedStep {
        self.packed[step.bank] = Some(step);
        step
    }

    /// Forgets the step in a bank, and takes its buffers back. The earlier step is gone even if the
    /// next packing ends in a refusal or in a panic of the caller's code.
    pub(super) fn forget(&mut self, bank: Bank) {
        self.packed[bank] = None;
        self.device.take_back_unused(bank);
    }
}
