//! Planned faults of the emulated board. One line of text gives kind, place and time of each.
//!
//! ```text
//! dma-dec-err@dma2.mm2s,phase=contact2,beat=17
//! stall@dma0.s2mm ; reset-never@dma1
//! irq-drop,step=3
//! ```
//!
//! `text.rs` reads and writes the line, `check.rs` refuses faults that cannot happen, `random.rs`
//! makes a plan from a seed, `shape.rs` knows the packets of a step, and `armed.rs` holds the
//! pending faults while the board runs.
//!
//! A [quirk](crate::Quirks) lasts as long as the board. A fault happens a number of times, once by
//! default. A reset ends the effects of faults; the pending faults stay.

mod armed;
mod check;
mod random;
mod shape;
mod text;

use pgs_interface::axi_dma::Direction;
use pgs_interface::control::ErrorCode;

use crate::config::BoardConfig;

pub(crate) use armed::{Due, Faults, PacketPosition};
pub(crate) use shape::{PassKind, StepShape, pass_of};
pub use text::FaultError;

/// The clock cycle at which a reset ends that begins `now`.
pub(crate) fn end_of_reset(config: &BoardConfig, now: u64, fault: Option<FaultKind>) -> u64 {
    let end = now + config.delays.reset;
    match fault {
        Some(FaultKind::ResetNever) => u64::MAX,
        Some(FaultKind::ResetSlow { ns }) => end.saturating_add(config.cycles(ns)),
        _ => end,
    }
}

/// The kind of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// A data access ends in `DMAIntErr`.
    DmaIntErr,
    /// A data access is answered with a slave error.
    DmaSlvErr,
    /// A data access is answered with a decode error: no memory there.
    DmaDecErr,
    /// A fetched descriptor counts as one with Cmplted set.
    SgIntErr,
    /// A fetch of a descriptor is answered with a slave error.
    SgSlvErr,
    /// A fetch of a descriptor is answered with a decode error.
    SgDecErr,
    /// The write of a descriptor's status is answered with a decode error.
    SgDecErrWrite,
    /// A completed descriptor has `DMAIntErr` in its status, and DMASR has not.
    BdIntErr,
    /// A completed descriptor has `DMASlvErr` in its status, and DMASR has not.
    BdSlvErr,
    /// A completed descriptor has `DMADecErr` in its status, and DMASR has not.
    BdDecErr,
    /// A channel moves no more beats until its core is reset.
    Stall,
    /// Each further beat of a packet takes longer.
    Slow {
        /// Additional clocks a beat.
        clocks: u32,
    },
    /// A packet ends with this beat; the rest of it is lost.
    ShortPacket,
    /// One more beat follows a packet and carries its TLAST. A receiver's buffers need not have
    /// room for it.
    LongPacket,
    /// A packet has no TLAST.
    NoTlast,
    /// The first word of a beat arrives with these bits inverted.
    Corrupt {
        /// The bits.
        mask: u32,
    },
    /// A rising edge of the interrupt line is lost, until the line falls.
    IrqDrop,
    /// A rising edge of the interrupt line arrives late.
    IrqDelay {
        /// Delay, ns.
        ns: u64,
    },
    /// An interrupt without a source.
    IrqSpurious,
    /// Several interrupts without a source, each as soon as the previous one is let through.
    IrqStorm {
        /// Number of interrupts.
        count: u32,
    },
    /// A descriptor's status arrives in memory late, after the interrupt.
    LateCmplted {
        /// Delay, ns.
        ns: u64,
    },
    /// A stopped channel shows Halted late.
    HaltDelay {
        /// Delay, ns.
        ns: u64,
    },
    /// A stopped channel never shows Halted.
    HaltNever,
    /// A reset takes longer.
    ResetSlow {
        /// Additional time, ns.
        ns: u64,
    },
    /// A reset never ends.
    ResetNever,
    /// The programmable logic is loaded anew, with another design.
    OtherBitstream {
        /// The value of its IDENTIFICATION register.
        identification: u32,
    },
    /// The programmable logic is loaded anew, with the same design: every register is as after a
    /// reset. Memory stays. Suspend and resume look the same.
    Reloaded,
    /// The accelerator gives up with a sticky error.
    AcceleratorError {
        /// The error.
        code: ErrorCode,
    },
    /// The accelerator takes and sends nothing any more until it is reset.
    AcceleratorHang,
    /// The accelerator sends all results and never says that it is done.
    NoDone,
    /// The programmable logic loses its power: every register reads all ones, for good.
    PowerLost,
}

/// The effect of a fault on a driver's step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consequence {
    /// The step fails.
    Fatal,
    /// The step takes longer and gives the same results, as long as its deadline allows.
    Survivable,
}

/// The event at which a kind of fault happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Site {
    /// As a beat is moved.
    Beat,
    /// With the last beat of a packet.
    PacketEnd,
    /// As a descriptor is fetched.
    Fetch,
    /// As a descriptor's status is written.
    Completion,
    /// As a channel is stopped.
    Halt,
    /// As a core or the accelerator is reset.
    Reset,
    /// As the interrupt line rises.
    Edge,
    /// In the accelerator.
    Accelerator,
    /// The board as a whole, at any occasion.
    Board,
}

impl FaultKind {
    /// The effect on a driver's step.
    #[must_use]
    pub const fn consequence(self) -> Consequence {
        match self.site() {
            Site::Edge | Site::Halt => Consequence::Survivable,
            _ => match self {
                Self::Slow { .. }
                | Self::IrqSpurious
                | Self::IrqStorm { .. }
                | Self::LateCmplted { .. }
                | Self::ResetSlow { .. } => Consequence::Survivable,
                _ => Consequence::Fatal,
            },
        }
    }

    pub(crate) const fn site(self) -> Site {
        match self {
            Self::DmaIntErr
            | Self::DmaSlvErr
            | Self::DmaDecErr
            | Self::Stall
            | Self::Slow { .. }
            | Self::ShortPacket
            | Self::Corrupt { .. } => Site::Beat,
            Self::LongPacket | Self::NoTlast => Site::PacketEnd,
            Self::SgIntErr | Self::SgSlvErr | Self::SgDecErr => Site::Fetch,
            Self::SgDecErrWrite
            | Self::BdIntErr
            | Self::BdSlvErr
            | Self::BdDecErr
            | Self::LateCmplted { .. } => Site::Completion,
            Self::HaltDelay { .. } | Self::HaltNever => Site::Halt,
            Self::ResetSlow { .. } | Self::ResetNever => Site::Reset,
            Self::IrqDrop | Self::IrqDelay { .. } => Site::Edge,
            Self::AcceleratorError { .. } | Self::AcceleratorHang | Self::NoDone => {
                Site::Accelerator
            }
            Self::IrqSpurious
            | Self::IrqStorm { .. }
            | Self::OtherBitstream { .. }
            | Self::Reloaded
            | Self::PowerLost => Site::Board,
        }
    }
}

/// The part of the board that a fault is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A channel of a DMA.
    Channel(usize, Direction),
    /// A whole DMA.
    Core(usize),
    /// The accelerator.
    Accelerator,
}

/// A phase of a step: selects a packet of a channel, or a phase of the accelerator.
///
/// Contact and friction passes count from 1. A design that streams the collisions once has one
/// packet for all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StepPhase {
    /// Velocities go in.
    Load,
    /// A pass of the contact solver.
    Contact(u32),
    /// A pass of the friction solver.
    Friction(u32),
    /// Poses go in, and the results of integrated bodies come out.
    Poses,
    /// Results come out.
    Results,
}

/// The occasion within the phase. Numbers count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// A beat of the packet; for the accelerator, a record.
    Beat(u64),
    /// A descriptor of the packet.
    Descriptor(u32),
    /// A register access, from the injection on.
    Access(u64),
    /// A stop, reset or edge of the interrupt line, from the injection on.
    Occasion(u32),
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// The kind.
    pub kind: FaultKind,
    /// The part of the board; for `None` the part that comes to such an occasion first.
    pub place: Option<Place>,
    /// The phase; for `None` any phase.
    pub phase: Option<StepPhase>,
    /// The occasion; for `None` the first one.
    pub when: Option<When>,
    /// The one step, counted from 1 at the injection; for `None` any step.
    pub step: Option<u32>,
    /// Number of times, each in another step.
    pub times: u32,
}

impl Fault {
    /// A fault that happens once, at the first occasion in any part.
    #[must_use]
    pub const fn new(kind: FaultKind) -> Self {
        Self { kind, place: None, phase: None, when: None, step: None, times: 1 }
    }

    /// The fault in one channel.
    #[must_use]
    pub const fn on(self, core: usize, direction: Direction) -> Self {
        self.at(Place::Channel(core, direction))
    }

    /// The fault in one part.
    #[must_use]
    pub const fn at(self, place: Place) -> Self {
        Self { place: Some(place), ..self }
    }

    /// The fault in one phase.
    #[must_use]
    pub const fn in_phase(self, phase: StepPhase) -> Self {
        Self { phase: Some(phase), ..self }
    }

    /// The fault at one occasion.
    #[must_use]
    pub const fn when(self, when: When) -> Self {
        Self { when: Some(when), ..self }
    }
}

/// Faults that are injected together. The text of a plan is one line:
/// [`Display`](std::fmt::Display) writes it, [`FromStr`](std::str::FromStr) reads it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultPlan {
    /// The faults. If several are due at once, the first of them happens first.
    pub faults: Vec<Fault>,
}

impl From<Fault> for FaultPlan {
    fn from(fault: Fault) -> Self {
        Self { faults: vec![fault] }
    }
}
