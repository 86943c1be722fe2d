//! This file says how a step can fail once it has begun.

use std::fmt;
use std::time::Duration;

use thiserror::Error;

use crate::accelerator::ControlError;
use crate::axi_dma::DmaError;
use crate::platform::PlatformError;

/// What went wrong in a step.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Fault {
    /// A DMA channel stopped with an error.
    #[error(
        "{channel} stopped with {status} at the descriptor at {descriptor:#x}; all channels: {registers}"
    )]
    Dma {
        /// Which channel.
        channel: String,
        /// Its status register, raw and decoded.
        status: String,
        /// Bus address of the descriptor in work.
        descriptor: u64,
        /// The status registers of all channels.
        registers: RegisterDump,
    },
    /// A descriptor says that it failed, while its channel does not.
    #[error("descriptor {index} of {channel} ended with {status}; all channels: {registers}")]
    Descriptor {
        /// Which channel.
        channel: String,
        /// Place in the step's chain, from 0.
        index: usize,
        /// Its status word, raw and decoded.
        status: String,
        /// The status registers of all channels.
        registers: RegisterDump,
    },
    /// The accelerator gave up.
    #[error("the accelerator stopped: {error}; all channels: {registers}")]
    Accelerator {
        /// Its sticky error, decoded.
        error: String,
        /// The status registers of all channels.
        registers: RegisterDump,
    },
    /// Nothing happened in time.
    #[error(
        "{awaited} did not come within {limit:?}: give the step a longer deadline, or look at what the channels wait for: {registers}"
    )]
    Deadline {
        /// What was awaited.
        awaited: &'static str,
        /// How long.
        limit: Duration,
        /// The status registers of all channels.
        registers: RegisterDump,
    },
    /// The caller ended the step.
    #[error("the step was cancelled")]
    Cancelled,
    /// Words were changed on the way.
    #[error(
        "the words {direction} add up to {found:#010x}, expected {expected:#010x}: memory or a stream is corrupt"
    )]
    Checksum {
        /// "to the accelerator" or "from the accelerator".
        direction: &'static str,
        /// The sum of what was sent.
        expected: u32,
        /// The sum of what arrived.
        found: u32,
    },
    /// A packet of results has another length than it must.
    #[error("{channel} received {found} bytes, expected {expected}")]
    PacketLength {
        /// Which channel.
        channel: String,
        /// Bytes that the step's results take there.
        expected: u64,
        /// Bytes received.
        found: u64,
    },
    /// A result is not a number.
    #[error(
        "the result of body {body} is not finite: the scene diverges (shorten the time step), or the accelerator computes wrongly"
    )]
    NotFinite {
        /// The first such body.
        body: usize,
    },
    /// Registers read all ones.
    #[error("{region} reads all ones: is the bitstream still loaded and its clock running?")]
    Gone {
        /// Which register region.
        region: String,
    },
    /// A DMA core did not follow.
    #[error(transparent)]
    Core(#[from] DmaError),
    /// The control block did not follow.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// There is no DMA memory for a step of this size.
    #[error("no DMA memory for this step: give a smaller one, or reserve more")]
    NoMemory(#[source] PlatformError),
    /// Memory or the interrupt failed.
    #[error(transparent)]
    Platform(#[from] PlatformError),
}

/// Status registers of all channels, decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RegisterDump(pub(crate) Vec<String>);

impl fmt::Display for RegisterDump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, line) in self.0.iter().enumerate() {
            let separator = if place == 0 { "" } else { ", " };
            write!(f, "{separator}{line}")?;
        }
        Ok(())
    }
}
