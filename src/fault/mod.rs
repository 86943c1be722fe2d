//! The faults of a step that has begun: one per cause, each with a stable name.
mod channel;
pub(crate) mod diagnosis;
pub(crate) mod phase;

pub use channel::ChannelFault;
pub use diagnosis::{ChannelState, ControlState, Diagnosis};
pub use phase::Phase;

use std::fmt;
use std::time::Duration;

use pgs_interface::control::ErrorCode;
use thiserror::Error;

use crate::axi_dma::{ChannelName, Direction, DmaError};
use crate::control_block::ControlError;
use crate::platform::PlatformError;

/// The cause of a failed step.
///
/// Among several errors the fault is the one that explains the others. A board that is gone,
/// another bitstream and a reset of the logic come first, then an error of a channel, an error of a
/// descriptor, the accelerator's own error, a packet of a wrong length, and a deadline last.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Fault {
    /// A channel failed, or a packet has another length than the results.
    #[error("{}", cause.text(at))]
    Channel {
        /// The way in which it failed.
        cause: ChannelFault,
        /// The channel, as it was found.
        at: Box<ChannelState>,
    },
    /// The accelerator stopped with an error.
    #[error("{0}")]
    Accelerator(Box<AcceleratorError>),
    /// An awaited event did not come in time.
    #[error(
        "{awaited} did not come within {limit:?}, in {phase}{}: give the step a longer deadline, \
         or look at what the streams wait for", behind_text(*behind)
    )]
    Deadline {
        /// The event.
        awaited: Awaited,
        /// The time limit.
        limit: Duration,
        /// The phase of the step.
        phase: Phase,
        /// The one channel that is behind all others of its direction, if any.
        behind: Option<ChannelName>,
    },
    /// The caller ended the step.
    #[error("the step was cancelled")]
    Cancelled,
    /// The checksum shows that words changed on their way.
    #[error(
        "the words {} add up to {found:#010x}, expected {expected:#010x}: memory or a stream is \
         corrupt; see `pgs check`", way(*direction)
    )]
    Checksum {
        /// The way: [`Direction::Mm2s`] leads to the accelerator.
        direction: Direction,
        /// Sum of the words that were sent.
        expected: u32,
        /// Sum of the words that arrived.
        found: u32,
    },
    /// A result is not a number.
    #[error(
        "the result of body {body} is not finite: the scene diverges (shorten the time step), or \
         the accelerator computes wrongly"
    )]
    NotFinite {
        /// The first such body.
        body: usize,
    },
    /// An impulse that came out is not a number.
    #[error(
        "the impulses of collision {collision} are not finite: the scene diverges (shorten the \
         time step), or the accelerator computes wrongly"
    )]
    ImpulseNotFinite {
        /// The first such collision.
        collision: usize,
    },
    /// The numbers beside the impulses of an issue queue name a collision twice, or one that does
    /// not exist.
    #[error(
        "expected each of {collisions} collisions once among the impulses of the {kind} passes, \
         found number {number} at place {at}, {}: the bitstream's issue queue is wrong; choose \
         the order as given, which passes by the queue", number_text(*number, *collisions)
    )]
    ImpulseNumber {
        /// The kind of passes: contact or friction.
        kind: &'static str,
        /// Place in the order of issue, from 0.
        at: usize,
        /// The number found there.
        number: usize,
        /// Collisions sent.
        collisions: usize,
    },
    /// Registers read all ones.
    #[error(
        "{region} reads all ones: is the bitstream still loaded, its power on and its clock \
         running?"
    )]
    Gone {
        /// The register region.
        region: String,
    },
    /// The logic was reset, and not by this driver.
    #[error(
        "the logic was reset: {region} is as after a reset, which this driver did not ask for; was \
         the bitstream loaded again, or the system suspended?"
    )]
    LogicReset {
        /// The register region that shows it.
        region: String,
    },
    /// Another bitstream was loaded.
    #[error(
        "{register} reads {found:#010x}, {expected:#010x} when the board was opened: another \
         bitstream was loaded; open the board again, with nobody loading one meanwhile"
    )]
    OtherBitstream {
        /// The first register that differs.
        register: &'static str,
        /// Its value when the board was opened.
        expected: u32,
        /// Its value now.
        found: u32,
    },
    /// A DMA core is not in the expected state.
    #[error(transparent)]
    Core(#[from] DmaError),
    /// The control block is not in the expected state.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// DMA memory does not suffice for a step of this size.
    #[error("no DMA memory for this step: give a smaller one, or reserve more")]
    NoMemory(#[source] PlatformError),
    /// Memory or the interrupt failed.
    #[error(transparent)]
    Platform(#[from] PlatformError),
}

fn behind_text(behind: Option<ChannelName>) -> String {
    behind.map(|channel| format!(", where {channel} is behind the others")).unwrap_or_default()
}

fn number_text(number: usize, collisions: usize) -> &'static str {
    if number < collisions { "for the second time" } else { "which no collision has" }
}

fn way(direction: Direction) -> &'static str {
    match direction {
        Direction::Mm2s => "to the accelerator",
        Direction::S2mm => "from the accelerator",
    }
}

impl Fault {
    /// A name that stays the same from version to version: `dma-decode-error`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Channel { cause, .. } => cause.name(),
            Self::Accelerator(error) => error.name(),
            Self::Deadline { awaited: Awaited::Results, .. } => "deadline",
            Self::Deadline { awaited: Awaited::Done, .. } => "no-done",
            Self::Cancelled => "cancelled",
            Self::Checksum { .. } => "checksum",
            Self::NotFinite { .. } => "not-finite",
            Self::ImpulseNotFinite { .. } => "impulse-not-finite",
            Self::ImpulseNumber { .. } => "impulse-number",
            Self::Gone { .. }
            | Self::Core(DmaError::Gone { .. })
            | Self::Control(ControlError::Gone) => "gone",
            Self::LogicReset { .. } => "logic-reset",
            Self::OtherBitstream { .. } => "other-bitstream",
            Self::Core(DmaError::FirstDescriptor { .. }) => "first-descriptor",
            Self::Core(_) => "dma-state",
            Self::Control(_) => "accelerator-state",
            Self::NoMemory(_) => "no-memory",
            Self::Platform(_) => "platform",
        }
    }

    /// The channel that the fault concerns, if it concerns one.
    #[must_use]
    pub fn channel(&self) -> Option<ChannelName> {
        match self {
            Self::Channel { at, .. } => Some(at.channel),
            Self::Accelerator(error) => error.channel,
            Self::Deadline { behind, .. } => *behind,
            _ => None,
        }
    }
}

/// The event that a deadline is set for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Awaited {
    /// The end of all chains of descriptors.
    Results,
    /// The accelerator's `ap_done`, after all results had come.
    Done,
}

impl fmt::Display for Awaited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Results => "the end of the results",
            Self::Done => "ap_done",
        })
    }
}

/// The accelerator's sticky error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct AcceleratorError {
    /// Its code; `None` for one that this driver does not know.
    pub code: Option<ErrorCode>,
    /// The register ERROR.
    pub raw: u32,
    /// The register `ERROR_DETAIL`.
    pub detail: u32,
    /// The channel on which it was seen, for the codes that concern one.
    pub channel: Option<ChannelName>,
    /// The meaning of the detail.
    pub subject: Subject,
    /// The phase of the step, by the data that had left memory.
    pub phase: Phase,
}

/// The subject of an accelerator's error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Subject {
    /// A collision.
    Collision {
        /// Its entry in the order in which they were sent.
        sent: u32,
        /// The caller's index; `None` for an empty entry.
        given: Option<usize>,
    },
    /// A body.
    Body {
        /// Its place in the order in which they were sent.
        sent: u32,
        /// The caller's index; `None` for a record that belongs to no body.
        given: Option<usize>,
    },
    /// A beat of a packet, from 0.
    Beat(u32),
    /// Bytes of on-chip memory that the step needs.
    Bytes(u32),
    /// The offset of an argument register.
    Argument(u32),
    /// Unknown to this driver.
    Unknown,
}

impl AcceleratorError {
    fn name(&self) -> &'static str {
        match self.code {
            Some(ErrorCode::BodyIndex) => "accelerator-body-index",
            Some(ErrorCode::ContactCount) => "accelerator-contact-count",
            Some(ErrorCode::TlastEarly) => "accelerator-tlast-early",
            Some(ErrorCode::TlastMissing) => "accelerator-tlast-missing",
            Some(ErrorCode::ShapeIndex) => "accelerator-shape-index",
            Some(ErrorCode::Capacity) => "accelerator-capacity",
            Some(ErrorCode::StaticPair) => "accelerator-static-pair",
            Some(ErrorCode::SelfCollision) => "accelerator-self-collision",
            Some(ErrorCode::Argument) => "accelerator-argument",
            Some(ErrorCode::PartialBeat) => "accelerator-partial-beat",
            _ => "accelerator-unknown",
        }
    }

    /// The advice at the end of the message.
    fn advice(&self) -> &'static str {
        match self.code {
            Some(ErrorCode::TlastEarly | ErrorCode::TlastMissing | ErrorCode::PartialBeat) => {
                "beats were lost or doubled on this stream; is it connected to the channel of that \
                 number, and TLAST with it?"
            }
            Some(ErrorCode::Capacity | ErrorCode::Argument) => {
                "the bitstream takes less than its capability registers say"
            }
            // The driver checks the input of every step before it sends it.
            Some(_) => {
                "it was not so when it was sent: memory or a stream is corrupt; see `pgs check`"
            }
            None => "the bitstream is newer than this driver: take a newer one",
        }
    }
}

impl fmt::Display for AcceleratorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { code, raw, detail, channel, subject, phase } = self;
        let what = code.map_or("a code that this driver does not know", ErrorCode::describe);
        write!(f, "the accelerator stopped in {phase}: {what}")?;
        if let Some(channel) = channel {
            write!(f, ", on the stream of {channel}")?;
        }
        match subject {
            Subject::Collision { sent, given: Some(given) } => {
                write!(f, ", collision {given} (sent as entry {sent})")?;
            }
            Subject::Collision { sent, given: None } => {
                write!(f, ", entry {sent}, which was left empty")?;
            }
            Subject::Body { sent, given: Some(given) } => {
                write!(f, ", body {given} (sent as record {sent})")?;
            }
            Subject::Body { sent, given: None } => {
                write!(f, ", record {sent}, which is no body's")?;
            }
            Subject::Beat(beat) => write!(f, ", beat {beat} of the packet")?,
            Subject::Bytes(bytes) => write!(f, ", {bytes} bytes needed")?,
            Subject::Argument(offset) => write!(f, ", argument at {offset:#x}")?,
            Subject::Unknown => {}
        }
        write!(f, " (ERROR {raw:#010x}, detail {detail}): {}", self.advice())
    }
}
