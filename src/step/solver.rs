//! This file is the accelerator as a caller sees it, and the first half of a step.
//!
//! Validate, order, reserve, pack, hand over, start; then, in [`InFlight`], wait, take back, check,
//! unpack, commit: nothing of the caller's changes before the last.

use std::sync::Arc;

use super::board::{self, BoardDescription, Found, OpenOptions};
use super::cancellation::Cancellation;
use super::device::Device;
use super::in_flight::{Flight, InFlight, Started, Stopwatch};
use super::ordering::{Arranged, Hardware, Ordering};
use super::packing::Load;
use super::plan::Plan;
use super::report::{HostTimes, StepReport};
use super::retry::with_retries;
use super::symptom::Symptom;
use crate::accelerator::Capabilities;
use crate::error::{Error, OpenError};
use crate::order::Ordered;
use crate::platform::{Deadline, System};
use crate::scene::validate::{Limits, Quick, preflight, validate, validate_shapes};
use crate::scene::{Bodies, Collisions, InputError, Pose, Shape, StepParameters, Velocity};

/// Finds the board that the options ask for.
pub(crate) fn find(options: &OpenOptions) -> Result<Found, OpenError> {
    board::find(&options.board, &options.memory, &System::default())
}

/// What a step is made of, once its collisions are in order.
struct Job<'a, B: ?Sized, C: ?Sized> {
    load: Load<'a, B, C>,
    /// Whether all collisions are sent.
    all: bool,
    parameters: &'a StepParameters,
    limits: &'a Limits,
    /// The whole of validation.
    check: &'a dyn Fn() -> Result<(), InputError>,
}

/// Why a step was not started.
#[derive(Debug)]
enum Stop {
    Input(InputError),
    Symptom(Symptom),
}

impl<S: Into<Symptom>> From<S> for Stop {
    fn from(symptom: S) -> Self {
        Self::Symptom(symptom.into())
    }
}

/// An open accelerator.
///
/// Dropping it stops the DMA channels and frees their memory.
#[derive(Debug)]
pub struct Accelerator {
    board: BoardDescription,
    pub(super) device: Device,
    limits: Limits,
    pub(super) shapes: Vec<Shape>,
    pub(super) ordering: Ordering,
    /// Results of a step until all are checked. Kept, so that a step allocates nothing.
    pub(super) spare: Vec<(Pose, Velocity)>,
}

impl Accelerator {
    /// Opens a board, identifies its bitstream and resets it.
    ///
    /// # Errors
    /// [`Error::Open`]: no such board, not a bitstream that this driver knows, or DMA cores that
    /// do not behave as they should.
    pub fn open(options: OpenOptions) -> Result<Self, Error> {
        Self::on(find(&options)?, options.length_width)
    }

    /// Opens the accelerator of a board that was found.
    pub(super) fn on(found: Found, length_width: Option<u32>) -> Result<Self, Error> {
        let device = Device::open(found.platform, length_width)?;
        Ok(Self::assemble(found.description, device))
    }

    /// The accelerator of a board that was brought up.
    pub(crate) fn assemble(board: BoardDescription, device: Device) -> Self {
        let Capabilities { variant, version, clock_khz, .. } = device.capabilities;
        log::info!(
            "opened {board}: profile {}, interface {}.{}, {clock_khz} kHz",
            variant.profile.name,
            version.0,
            version.1
        );
        let limits = Limits {
            variant,
            flush_subnormals: device.capabilities.flush_subnormals,
            // An index has to name every body, whatever the bitstream says.
            body_capacity: device.capabilities.body_capacity.min(variant.body_capacity()),
            collision_capacity: device.capabilities.collision_capacity,
            shape_capacity: device.capabilities.shape_capacity,
            memory_bytes: device.capabilities.memory_bytes,
            bytes_per_body: device.capabilities.bytes_per_body,
            bytes_per_collision: device.capabilities.bytes_per_collision,
        };
        let ordering = Ordering::default();
        Self { board, device, limits, shapes: Vec::new(), ordering, spare: Vec::new() }
    }

    /// Which board was opened, and why.
    #[must_use]
    pub fn board(&self) -> &BoardDescription {
        &self.board
    }

    /// What the bitstream says of itself.
    #[must_use]
    pub fn capabilities(&self) -> &Capabilities {
        &self.device.capabilities
    }

    /// Loads the shapes that bodies refer to by index, in place of all earlier ones.
    ///
    /// # Errors
    /// [`Error::Input`]: a shape that the bitstream cannot take, or too many; the earlier shapes
    /// stay. [`Error::MustReopen`] after a fault that could not be cleared.
    pub fn set_shapes(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        self.device.settle(&self.shapes)?;
        validate_shapes(shapes, &self.limits)?;
        self.device.control.load_shapes(shapes, self.limits.variant.inertia);
        self.shapes.clear();
        self.shapes.extend_from_slice(shapes);
        Ok(())
    }

    /// From now on this ends steps early, in place of an earlier one.
    pub fn set_cancellation(&mut self, cancellation: Cancellation) {
        self.device.cancellation = Some(cancellation);
    }

    /// Solves the contacts of one time step and integrates it.
    ///
    /// Collisions are taken in the [order](StepParameters::order) that the parameters ask for.
    /// Static bodies are left as they are. The bodies change only if the step succeeds, and then all
    /// at once.
    ///
    /// Units: metres, kilograms, seconds, radians, world frame.
    ///
    /// # Errors
    /// [`Error::Input`]: the input was refused and nothing was sent. [`Error::Step`]: a fault of
    /// the board; [`Error::may_retry`] and [`Error::must_reopen`] say what to do.
    /// [`Error::MustReopen`] after a fault that could not be cleared.
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

    /// Starts a [step](Self::step) and returns at once: the caller may do other work until it asks
    /// for the results with [`InFlight::wait`].
    ///
    /// The bodies are copied here, and looked at again only there.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn submit<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<InFlight<'_>, Error> {
        self.device.settle(&self.shapes)?;
        let mut watch = Stopwatch::start();
        let mut host = HostTimes::default();
        let Self { ordering, device, limits, shapes, .. } = self;
        let quick = Quick::new(preflight(bodies, collisions, shapes, parameters, limits)?);
        // What is not right is said by the whole of validation, before anything else is.
        let check = || validate(bodies, collisions, shapes, parameters, limits);
        host.validate = watch.lap();
        let on = Hardware { capabilities: &device.capabilities, limits, shapes };
        let arranged = match ordering.arrange(bodies, collisions, parameters, on) {
            Ok(arranged) => arranged,
            Err(error) => return Err(check().err().unwrap_or(error).into()),
        };
        host.order = watch.lap();
        let accesses = (device.counts.reads(), device.counts.writes());
        let mut empty = 0;
        let Arranged { scheduled, live, .. } = arranged;
        let launched = if scheduled {
            let ordered = Ordered { collisions, schedule: ordering.schedule() };
            let lives = live.map(|_| ordering.lives());
            // Those that fill the last issue are of the order's making too.
            let entries = lives.map_or(ordered.len(), |lives| lives.words().len());
            empty = entries.saturating_sub(ordering.schedule().collisions());
            let all = ordering.schedule().collisions() == collisions.len();
            let load = Load {
                bodies,
                collisions: &ordered,
                scheduled,
                lives,
                shapes,
                quick: Some(&quick),
            };
            let job = Job { load, all, parameters, limits, check: &check };
            launch(device, &job, &mut host, &mut watch)
        } else {
            let quick = Some(&quick);
            let load = Load { bodies, collisions, scheduled, lives: None, shapes, quick };
            let job = Job { load, all: true, parameters, limits, check: &check };
            launch(device, &job, &mut host, &mut watch)
        };
        let (plan, started) = launched.map_err(|stop| match stop {
            Stop::Input(error) => error.into(),
            Stop::Symptom(symptom) => device.fail(symptom, shapes),
        })?;
        let flight = Flight {
            plan,
            started,
            bodies: bodies.len(),
            collisions: collisions.len(),
            empty,
            arranged,
            host,
            watch,
            accesses,
        };
        Ok(InFlight::new(self, flight))
    }
}

/// Packs a step and starts it; its plan, and what was started, if there is anything to stream.
///
/// Input is looked at while it is packed. Where it is not all packed, or the board is touched
/// before, or the step ends early, it is validated first.
fn launch<B: Bodies + ?Sized, C: Collisions + ?Sized>(
    device: &mut Device,
    job: &Job<'_, B, C>,
    host: &mut HostTimes,
    watch: &mut Stopwatch,
) -> Result<(Plan, Option<Started>), Stop> {
    let Job { load, all, parameters, limits, check } = job;
    let Load { bodies, collisions, lives, shapes, .. } = *load;
    let plan = Plan {
        bodies: lives.map_or(bodies.len(), |lives| lives.velocities().len()),
        collisions: lives.map_or(collisions.len(), |lives| lives.words().len()),
        passes: u64::from(parameters.contact_iterations)
            + u64::from(parameters.friction_iterations),
        variant: limits.variant,
    };
    let cancelled = device.check_cancelled();
    if !all || plan.bodies == 0 || cancelled.is_err() || !device.has_room(&plan) {
        check().map_err(Stop::Input)?;
    }
    cancelled?;
    if plan.bodies == 0 {
        return Ok((plan, None));
    }
    device.reserve_or_reset(&plan, shapes)?;
    let (sent, good) = device.pack(&plan, load);
    if !good {
        check().map_err(Stop::Input)?;
    }
    host.pack = watch.lap();
    let limit = plan.deadline(parameters, &device.capabilities);
    let deadline = Deadline::after(&*device.platform, limit);
    let doorbells = device.start(&plan, parameters)?;
    host.start = watch.lap();
    Ok((plan, Some(Started { sent, deadline, doorbells })))
}
