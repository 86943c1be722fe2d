//! Records the course of a board's time on request: register accesses, beats, stages, the
//! interrupt.
//!
//! A board without a recorder pays for one look at an empty option a block of beats. A recorded
//! board takes no stretch of time at once, so that each beat has a clock; bits, cycles and counters
//! stay the same. A clock is the accelerator's, counted since the board was built.

mod recorder;

pub(crate) use recorder::{MovedBeats, Recorder, StageCounts, StageLog};

use crate::fault::StepPhase;
use crate::violation::RegisterAccess;
use pgs_interface::axi_dma::Direction;

/// Clocks from `begin` up to and without `end`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// First clock.
    pub begin: u64,
    /// The clock after the last one.
    pub end: u64,
}

impl Span {
    /// Number of clocks.
    #[must_use]
    pub fn clocks(self) -> u64 {
        self.end - self.begin
    }
}

/// The course of a board's time between two clocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// The recorded time.
    pub span: Span,
    /// The clock's frequency.
    pub clock_khz: u32,
    /// Clocks of a register access, which end with it.
    pub access_clocks: u64,
    /// The register accesses, oldest first.
    pub accesses: Vec<RegisterAccess>,
    /// The clocks of the writes that started something: TAILDESC, LENGTH, `ap_start`.
    pub doorbells: Vec<u64>,
    /// The MM2S channels, and then the S2MM channels.
    pub channels: Vec<ChannelRecording>,
    /// The stages of the accelerator, if it is the built-in model.
    pub stages: Vec<StageSpan>,
    /// Clocks in which the accelerator waited for beats or for room. It looks for both every few
    /// clocks, so that a wait is a multiple of that time.
    pub waits: Vec<Span>,
    /// The level of the interrupt line at the begin, and each clock at which it changes.
    pub interrupt: Levels,
}

/// A line of two levels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Levels {
    /// The level at the begin.
    pub first: bool,
    /// The clocks of its edges, oldest first.
    pub edges: Vec<u64>,
}

/// The course of one DMA channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRecording {
    /// Which DMA.
    pub core: usize,
    /// Which of its two channels.
    pub direction: Direction,
    /// The states of its stream port, each up to the next.
    pub port: Vec<PortState>,
    /// The descriptors that were fetched, in the order of time.
    pub descriptors: Vec<DescriptorSpan>,
    /// The packets that began, in the order of time.
    pub packets: Vec<PacketSpan>,
}

/// The stream port between a DMA channel and the FIFO of its stream, from a clock on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortState {
    /// The clock at which the state begins.
    pub begin: u64,
    /// The state.
    pub port: Port,
}

/// A state of a stream port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Port {
    /// Beats of 128 bits move without a pause: TVALID and TREADY are set.
    Moves {
        /// Their number.
        beats: u64,
        /// Clocks of each: the transfers of a stream of less than 128 bits.
        clocks: u64,
        /// Whether the last one carries TLAST.
        last: bool,
    },
    /// No beat moves: at most one of the two is set.
    Rests {
        /// TVALID: the sender waits for the receiver.
        valid: bool,
        /// TREADY: the receiver waits for the sender.
        ready: bool,
    },
}

impl PortState {
    /// The clock after the last beat; the begin of a state without beats.
    #[must_use]
    pub fn end_of_beats(&self) -> u64 {
        match self.port {
            Port::Moves { beats, clocks, .. } => self.begin + beats * clocks,
            Port::Rests { .. } => self.begin,
        }
    }
}

/// A descriptor from its fetch to its status, or to the error, reset or end of the recording that
/// cut it short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DescriptorSpan {
    /// Its time.
    pub span: Span,
    /// Bus address of the descriptor.
    pub address: u64,
    /// Bytes that it moved.
    pub bytes: u64,
    /// Whether its status was written.
    pub ended: bool,
}

/// A packet from its first beat to its last, or to the error, reset or end of the recording that
/// cut it short. A packet that began before the recording is left out; its beats are states of the
/// port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketSpan {
    /// Its time.
    pub span: Span,
    /// The phase whose records it carries.
    pub phase: Option<StepPhase>,
    /// Its beats.
    pub beats: u64,
    /// Descriptors that carried it and have ended.
    pub descriptors: u32,
    /// Whether it has its last beat.
    pub ended: bool,
}

/// A stage of the accelerator's work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Velocities go in.
    Load,
    /// A pass of the contact solver, from 1.
    Contact(u32),
    /// A pass of the friction solver, from 1.
    Friction(u32),
    /// Poses go in, and the results of integrated bodies come out.
    Integrate,
}

/// A stage, its time and its part of the counters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StageSpan {
    /// Which.
    pub stage: Stage,
    /// Its time, the drain of the pipeline included.
    pub span: Span,
    /// Clocks in which a collision waited for a velocity.
    pub stalls: u64,
    /// Clocks in which the accelerator waited for a stream.
    pub waits: u64,
    /// Collisions that met a hazard.
    pub hazards: u64,
    /// Whether the accelerator has ended it: no error, reset or end of the recording cut it short.
    pub ended: bool,
}
