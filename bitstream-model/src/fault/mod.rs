//! Faults that the emulated board can be told to have: what, where, when, on one line.
//!
//! ```text
//! dma-dec-err@dma2.mm2s,phase=contact2,beat=17
//! stall@dma0.s2mm ; reset-never@dma1
//! irq-drop,step=3
//! ```
//!
//! `text.rs` reads and writes that line, `check.rs` refuses what cannot be, `random.rs` makes one from a seed, `shape.rs` knows a step's packets, `armed.rs` is what waits
//! for its occasion while the board runs.
//!
//! Unlike a [quirk](crate::Quirks), which lasts as long as the board, a fault happens as often as it
//! says, once if it does not say. A reset ends what it did and does not forget what is still due.

mod armed;
mod check;
mod random;
mod shape;
mod text;

use pgs_interface::axi_dma::Direction;
use pgs_interface::control::ErrorCode;

use crate::config::BoardConfig;

pub(crate) use armed::{Due, Faults, Turn};
pub(crate) use shape::{StepShape, Streamed};
pub use text::FaultError;

/// When a reset ends that begins `now`, in clocks.
pub(crate) fn end_of_reset(config: &BoardConfig, now: u64, fault: Option<FaultKind>) -> u64 {
    let end = now + config.delays.reset;
    match fault {
        Some(FaultKind::ResetNever) => u64::MAX,
        Some(FaultKind::ResetSlow { ns }) => end.saturating_add(config.cycles(ns)),
        _ => end,
    }
}

/// What goes wrong.
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
    /// Each further beat of a packet takes so many clocks more.
    Slow {
        /// Clocks.
        clocks: u32,
    },
    /// A packet ends with this beat; the rest of it is lost.
    ShortPacket,
    /// A packet is followed by a beat more, which carries its TLAST; received, it is one more than its
    /// buffers must have room for.
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
        /// How late, ns.
        ns: u64,
    },
    /// An interrupt without a source.
    IrqSpurious,
    /// That many interrupts without a source, each as soon as the one before is let through.
    IrqStorm {
        /// How many.
        count: u32,
    },
    /// A descriptor's status arrives in memory late, after the interrupt.
    LateCmplted {
        /// How late, ns.
        ns: u64,
    },
    /// A stopped channel shows Halted late.
    HaltDelay {
        /// How late, ns.
        ns: u64,
    },
    /// A stopped channel never shows Halted.
    HaltNever,
    /// A reset takes longer.
    ResetSlow {
        /// How much longer, ns.
        ns: u64,
    },
    /// A reset never ends.
    ResetNever,
    /// The programmable logic is loaded anew, with another design.
    OtherBitstream {
        /// What its IDENTIFICATION reads.
        identification: u32,
    },
    /// The accelerator gives up with a sticky error.
    AcceleratorError {
        /// Which.
        code: ErrorCode,
    },
    /// The accelerator takes and sends nothing any more until it is reset.
    AcceleratorHang,
    /// The accelerator sends all results and never says that it is done.
    NoDone,
    /// The programmable logic loses its power: every register reads all ones, for good.
    PowerLost,
}

/// What a driver can make of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consequence {
    /// The step fails.
    Fatal,
    /// The step takes longer and gives the same results, as long as its deadline allows.
    Survivable,
}

/// Where a kind of fault strikes.
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
    /// What a driver can make of it.
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
            | Self::PowerLost => Site::Board,
        }
    }
}

/// Which part a fault is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A channel of a DMA.
    Channel(usize, Direction),
    /// A whole DMA.
    Core(usize),
    /// The accelerator.
    Accelerator,
}

/// A phase of a step: which packet of a channel, or what the accelerator is doing.
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
    /// Poses go in, and what was integrated comes out.
    Poses,
    /// Results come out.
    Results,
}

/// The occasion within the phase. Numbers count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// That beat of the packet; of the accelerator, that record.
    Beat(u64),
    /// That descriptor of the packet.
    Descriptor(u32),
    /// That register access, from the injection on.
    Access(u64),
    /// That stop, reset or edge of the interrupt line, from the injection on.
    Occasion(u32),
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// What.
    pub kind: FaultKind,
    /// Where; wherever it comes up first if not said.
    pub place: Option<Place>,
    /// In which phase; in any if not said.
    pub phase: Option<StepPhase>,
    /// At which occasion; the first if not said.
    pub when: Option<When>,
    /// In which step alone, counted from 1 at the injection; in whichever it comes up if not said.
    pub step: Option<u32>,
    /// How often, each time in another step.
    pub times: u32,
}

impl Fault {
    /// A fault that happens once, wherever and whenever it can.
    #[must_use]
    pub const fn new(kind: FaultKind) -> Self {
        Self { kind, place: None, phase: None, when: None, step: None, times: 1 }
    }

    /// The same in one channel.
    #[must_use]
    pub const fn on(self, core: usize, direction: Direction) -> Self {
        self.at(Place::Channel(core, direction))
    }

    /// The same in one part.
    #[must_use]
    pub const fn at(self, place: Place) -> Self {
        Self { place: Some(place), ..self }
    }

    /// The same in one phase.
    #[must_use]
    pub const fn in_phase(self, phase: StepPhase) -> Self {
        Self { phase: Some(phase), ..self }
    }

    /// The same at one occasion.
    #[must_use]
    pub const fn when(self, when: When) -> Self {
        Self { when: Some(when), ..self }
    }
}

/// Faults that are injected together. Its text is one line: [`Display`](std::fmt::Display) writes
/// it, [`FromStr`](std::str::FromStr) reads it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultPlan {
    /// The faults; of several that are due at once the first happens first.
    pub faults: Vec<Fault>,
}

impl From<Fault> for FaultPlan {
    fn from(fault: Fault) -> Self {
        Self { faults: vec![fault] }
    }
}
