//! The accelerator as a caller sees it, and the first half of a step.
//!
//! A step is five calls there and five back. [`Accelerator::submit`] checks, orders, reserves,
//! packs (`pack.rs`) and starts; [`InFlight::wait`] waits, takes back, checks, reads and commits
//! (`in_flight.rs`). The caller's bodies change in the last call, and only there.

use std::fmt;
use std::sync::Arc;

use pgs_support::float_env::standard;

use super::impulses::ImpulsesOut;
use super::in_flight::{Flight, InFlight, Started};
use super::ordering::Ordering;
use super::pack::{Engines, PackedStep};
use super::report::StepReport;
use super::retry::with_retries;
use super::stopwatch::Stopwatch;
use super::unique_id::UniqueId;
use crate::beat::pack::pool::PackPool;
use crate::board::bank::{Bank, PerBank};
use crate::board::cancellation::Cancellation;
use crate::board::device::Device;
use crate::board::open::{self, BoardDescription, Found, OpenOptions};
use crate::control_block::Capabilities;
use crate::error::{Error, OpenError};
use crate::platform::{Deadline, System};
use crate::record::result::Record;
use crate::scene::{Bodies, Collisions, Impulses, Shape, StepParameters};
use crate::validate::{Limits, validate_shapes};

/// Finds the board that the options ask for.
pub(crate) fn find(options: &OpenOptions) -> Result<Found, OpenError> {
    open::find(&options.board, &options.memory, &options.manager, &System::default())
}

/// An open accelerator.
///
/// Dropping it stops the DMA channels and frees their memory. It belongs to the process that opened it:
/// in a forked child its calls are refused, and dropping it frees memory of the child alone.
pub struct Accelerator {
    board: BoardDescription,
    pub(super) device: Device,
    pub(super) limits: Limits,
    pub(super) shapes: Vec<Shape>,
    /// How often shapes were loaded.
    pub(super) shapes_loaded: u64,
    /// The bank of the step that was started last. A step that is not prepared goes into it.
    pub(super) bank: Bank,
    /// The step that lies in each bank.
    pub(super) packed: PerBank<Option<PackedStep>>,
    /// The ordering of the step in each bank.
    pub(super) orderings: PerBank<Ordering>,
    /// The step in flight that was detached.
    pub(super) detached: Option<UniqueId>,
    /// Results of a step until all are checked. The memory is kept, so that a step allocates
    /// nothing.
    pub(super) staged: Vec<Record>,
    pub(super) impulses: ImpulsesOut,
}

/// Prints the board and a summary of the step in each bank, but no records, results or tables:
/// their size grows with the step.
impl fmt::Debug for Accelerator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Accelerator")
            .field("board", &self.board)
            .field("capabilities", &self.device.capabilities)
            .field("shapes", &self.shapes.len())
            .field("packed", &self.packed)
            .field("dead", &self.device.dead)
            .finish_non_exhaustive()
    }
}

impl Accelerator {
    /// Opens a board, identifies its bitstream and resets it.
    ///
    /// # Errors
    /// [`Error::Open`]: no such board, not a bitstream that this driver knows, or DMA cores that
    /// do not behave as they should.
    pub fn open(options: OpenOptions) -> Result<Self, Error> {
        standard(|| {
            let mut accelerator = Self::on(find(&options)?, options.length_width)?;
            accelerator.device.packers = PackPool::new(options.pack_threads);
            Ok(accelerator)
        })
    }

    /// Opens the accelerator of a board that was found.
    pub(crate) fn on(found: Found, length_width: Option<u32>) -> Result<Self, Error> {
        let device = Device::open(found.platform, length_width)?;
        Ok(Self::assemble(found.description, device))
    }

    /// Makes the accelerator of a board that was brought up.
    pub(crate) fn assemble(board: BoardDescription, device: Device) -> Self {
        let Capabilities { variant, version, clock_khz, .. } = device.capabilities;
        log::info!(
            "opened {board}: profile {}, interface {}.{}, {clock_khz} kHz",
            variant.profile.name,
            version.0,
            version.1
        );
        Self {
            board,
            limits: Limits::of(&device.capabilities),
            device,
            shapes: Vec::new(),
            shapes_loaded: 0,
            bank: Bank::First,
            packed: PerBank::default(),
            orderings: PerBank::default(),
            detached: None,
            staged: Vec::new(),
            impulses: ImpulsesOut::default(),
        }
    }

    /// The board that was opened, and the reason for the choice.
    #[must_use]
    pub fn board(&self) -> &BoardDescription {
        &self.board
    }

    /// The capabilities that the bitstream reports.
    #[must_use]
    pub fn capabilities(&self) -> &Capabilities {
        &self.device.capabilities
    }

    /// Loads the shapes that bodies refer to by index, in place of all earlier ones. The
    /// bitstream's table limits their number. A bitstream of world inertia with streamed masses (interface
    /// 1.2) takes any number: each body then brings its own mass. A step that
    /// was [prepared](InFlight::prepare) with the earlier shapes is refused from now on.
    ///
    /// # Errors
    /// [`Error::Input`]: a shape that the bitstream cannot take, or too many; the earlier shapes
    /// stay. [`Error::Step`]: the board went away. [`Error::MustReopen`] after a fault that could not
    /// be cleared.
    pub fn set_shapes(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        standard(|| {
            self.settle()?;
            validate_shapes(shapes, &self.limits)?;
            if let Err(error) = self.device.platform.check_present() {
                return Err(self.device.fail(error.into(), &self.shapes));
            }
            self.device.load_shapes(shapes);
            self.shapes_loaded += 1;
            self.shapes.clear();
            self.shapes.extend_from_slice(shapes);
            Ok(())
        })
    }

    /// Lets `cancellation` end steps early, in place of an earlier one.
    pub fn set_cancellation(&mut self, cancellation: Cancellation) {
        self.device.cancellation = Some(cancellation);
    }

    /// Solves the contacts of one time step and integrates it.
    ///
    /// The board takes the collisions in the [order](StepParameters::order) that the parameters ask
    /// for. Static bodies stay as they are, unless they are [kinematic](StepParameters::kinematic). The bodies change only if the step succeeds, and then
    /// all at once.
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

    /// The impulses of each collision, in the caller's order, of the last step that succeeded and
    /// [gave them out](StepParameters::impulses_out); empty before the first. An empty collision has
    /// zeros.
    #[must_use]
    pub fn impulses(&self) -> &[Impulses] {
        &self.impulses.committed
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
