//! The accelerator as a caller sees it.

use std::fmt;

use pgs_support::float_env::standard;

use super::flight::PackedStep;
use super::impulses::ImpulsesOut;
use super::ordering::Ordering;
use super::unique_id::UniqueId;
use crate::beat::pool::PackPool;
use crate::board::bank::{Bank, PerBank};
use crate::board::cancellation::Cancellation;
use crate::board::device::Device;
use crate::board::open::{self, BoardDescription, Found, OpenOptions};
use crate::control_block::Capabilities;
use crate::error::{Error, OpenError};
use crate::platform::System;
use crate::record::result::Record;
use crate::scene::{Impulses, Shape};
use crate::validate::{Limits, validate_shapes};

/// Finds the board that the options ask for.
pub(crate) fn find(options: &OpenOptions) -> Result<Found, OpenError> {
    open::find(&options.board, &options.memory, &options.manager, &System::default())
}

/// An open accelerator.
///
/// Dropping it stops the DMA channels and frees their memory. It belongs to the process that opened
/// it: in a forked child its calls are refused, and dropping it frees memory of the child alone.
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
    /// bitstream's table limits their number. A bitstream of world inertia with streamed masses
    /// takes any number: each body then brings its own mass. A step that
    /// was [prepared](super::InFlight::prepare) with the earlier shapes is refused from now on.
    ///
    /// # Errors
    /// [`Error::Input`]: a shape that the bitstream cannot take, or too many; the earlier shapes
    /// stay. [`Error::Step`]: the board went away. [`Error::MustReopen`] after a fault that could
    /// not be cleared.
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

    /// The impulses of each collision, in the caller's order, of the last step that succeeded and
    /// [gave them out](crate::StepParameters::impulses_out); empty before the first. An empty
    /// collision has zeros.
    #[must_use]
    pub fn impulses(&self) -> &[Impulses] {
        &self.impulses.committed
    }
}
