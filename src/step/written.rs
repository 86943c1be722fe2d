//! Packs a step whose collisions the caller writes as it finds them.

use pgs_support::float_env::standard_around;

use super::accelerator::Accelerator;
use super::flight::{Engines, PackedStep};
use super::in_flight::InFlight;
use super::ordering::{OrderSummary, in_order_of_writing};
use super::prepared::Prepared;
use super::report::{HostTimes, OrderChoice};
use super::reserve::{refuse, reserve};
use super::stopwatch::Stopwatch;
use super::unique_id::UniqueId;
use crate::beat::Target;
use crate::beat::writer::Writer;
use crate::board::bank::Bank;
use crate::board::plan::Plan;
use crate::error::Error;
use crate::scene::{Bodies, Collision, Collisions, StepParameters};
use crate::validate::{InputError, preflight, validate};

impl Accelerator {
    /// Packs a step whose collisions `narrow_phase` writes, at most `announced` of them. Their
    /// records go straight into the memory that the board reads, and the caller needs no array of
    /// them.
    ///
    /// The board takes them in the order in which they are written, and solves them in this order,
    /// too, unless it has an issue queue and no order is named. The parameters must ask for
    /// [`Order::AsGiven`](crate::order::Order::AsGiven), or for no order on a bitstream that waits
    /// on hazards. A step that is to verify its order wants all collisions at once.
    ///
    /// The step takes the place of the one that was started last; [`Self::start`] starts it. A step
    /// that is stepped or submitted before that start takes its place in turn, and the written step
    /// is then refused. [`StepReport::host`](crate::StepReport::host) counts the narrow phase as
    /// packing.
    ///
    /// `narrow_phase` runs in the caller's own [floating-point
    /// environment](crate#the-floating-point-environment).
    ///
    /// ```
    /// use zynq_pgs::{Accelerator, Body, Collision, Contact, OpenOptions, Pose, Shape};
    /// # use zynq_pgs::{StepParameters, Velocity};
    ///
    /// # fn main() -> Result<(), zynq_pgs::Error> {
    /// let mut board = Accelerator::open(OpenOptions::default())?;
    /// board.set_shapes(&[Shape::isotropic(1.0, 6.0)])?;
    /// // Cubes of 1 m, one on the other.
    /// let at = |y| Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
    /// let cube = |y| Body { pose: at(y), velocity: Velocity::default(), shape: 0 };
    /// let mut tower: Vec<Body> = (0_u8..10).map(|floor| cube(f32::from(floor))).collect();
    ///
    /// let step = board.write(&tower, 9, &StepParameters::default(), |records| {
    ///     for (below, (body_b, body_a)) in tower.iter().zip((0..9).zip(1..)) {
    ///         let [x, y, z] = below.pose.position;
    ///         let corners = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]];
    ///         let contacts = corners.map(|[dx, dz]| Contact {
    ///             point: [x + dx, y + 0.5, z + dz],
    ///             distance: 0.0,
    ///         });
    ///         let normal = [0.0, 1.0, 0.0];
    ///         records.push(&Collision { body_a, body_b, normal, count: 4, contacts });
    ///     }
    /// })?;
    /// let report = board.start(&step)?.wait(&mut tower)?;
    /// assert_eq!(report.collisions, 9);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Input`] as [`Self::step`], and [`InputError::WrittenInOrder`],
    /// [`InputError::WrittenWarm`],
    /// [`InputError::MoreThanAnnounced`]. [`Error::Step`] if memory is too small for `announced`
    /// collisions, or the step was cancelled; [`Error::MustReopen`] after a fault that could not be
    /// cleared.
    pub fn write<B: Bodies + ?Sized>(
        &mut self,
        bodies: &B,
        announced: usize,
        parameters: &StepParameters,
        narrow_phase: impl FnOnce(&mut Writer<'_>),
    ) -> Result<Prepared, Error> {
        standard_around(|caller| {
            let narrow_phase = |writer: &mut Writer<'_>| caller.run(|| narrow_phase(writer));
            self.settle()?;
            let into = (self.bank, Engines::Idle);
            let step = self.pack_written(into, bodies, announced, parameters, narrow_phase)?;
            Ok(Prepared { bank: step.bank, id: step.id })
        })
    }

    /// Packs as [`pack`](Self::pack) does, with collisions that `narrow_phase` writes.
    fn pack_written<B: Bodies + ?Sized>(
        &mut self,
        (bank, engines): (Bank, Engines),
        bodies: &B,
        announced: usize,
        parameters: &StepParameters,
        narrow_phase: impl FnOnce(&mut Writer<'_>),
    ) -> Result<PackedStep, Error> {
        self.forget(bank);
        let mut watch = Stopwatch::start();
        let mut host = HostTimes::default();
        let Self { device, limits, shapes, packed, .. } = self;
        if !in_order_of_writing(&device.capabilities, parameters) {
            return Err(InputError::WrittenInOrder.into());
        }
        if parameters.warm_start {
            return Err(InputError::WrittenWarm.into());
        }
        let scene = preflight(bodies, &Announced(announced), shapes, parameters, limits)?;
        host.validate = watch.lap();

        let variant = limits.variant;
        let passes = parameters.passes();
        let streamed_masses = device.capabilities.streams_masses(shapes.len());
        // A caller who names no order leaves it to the queue.
        let queued = parameters.order.is_none() && device.capabilities.queue > 0;
        let mut plan = Plan {
            bodies: bodies.len(),
            collisions: announced,
            passes,
            variant,
            streamed_masses,
            queued,
        };
        reserve((&mut *device, packed), shapes, (&plan, bank), engines)
            .map_err(|symptom| refuse(device, shapes, symptom, engines))?;

        let target = Target { scene: &scene, streamed_masses };
        let check_bodies = || validate(bodies, &Announced(0), shapes, parameters, limits);
        let (sent, written) =
            device.pack_written(&plan, bank, target, bodies, check_bodies, narrow_phase)?;
        plan.collisions = if sent.is_some() { written.collisions } else { 0 };
        host.pack = watch.lap();
        Ok(self.keep(PackedStep {
            id: UniqueId::new(),
            bank,
            plan,
            sent,
            parameters: *parameters,
            bodies: plan.bodies,
            given: written.collisions,
            collisions: written.collisions - written.paddings,
            empty: if sent.is_some() { written.paddings } else { 0 },
            order_summary: OrderSummary::as_given(OrderChoice::Asked, queued),
            shapes_loaded: self.shapes_loaded,
            host,
        }))
    }
}

impl InFlight<'_> {
    /// As [`Accelerator::write`], while the board works on this step: see [`Self::prepare`].
    ///
    /// # Errors
    /// The errors of [`Accelerator::write`] and of [`Self::prepare`].
    pub fn write<B: Bodies + ?Sized>(
        &mut self,
        bodies: &B,
        announced: usize,
        parameters: &StepParameters,
        narrow_phase: impl FnOnce(&mut Writer<'_>),
    ) -> Result<Prepared, Error> {
        standard_around(|caller| {
            let narrow_phase = |writer: &mut Writer<'_>| caller.run(|| narrow_phase(writer));
            self.accelerator.device.check_process()?;
            let into = (self.flight.step.bank.other(), Engines::Working);
            let step =
                self.accelerator.pack_written(into, bodies, announced, parameters, narrow_phase)?;
            self.hand_over(step)
        })
    }
}

/// A number of collisions whose values do not exist yet.
struct Announced(usize);

impl Collisions for Announced {
    fn len(&self) -> usize {
        self.0
    }

    fn collision(&self, _: usize) -> Collision {
        Collision::NOTHING
    }
}
