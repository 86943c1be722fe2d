//! The AXI DMA cores: registers, descriptors, rings, reset.

mod channel;
mod descriptor;
mod registers;
mod reset;
mod ring;
// On x86-64 only: the tests start QEMU, and a build for the Cortex-A53 runs under QEMU already.
#[cfg(all(test, target_arch = "x86_64"))]
mod tests;

use std::fmt;
use std::time::Duration;

use thiserror::Error;

pub(crate) use channel::{Channel, detect_length_width};
pub use descriptor::DescriptorStatus;
pub(crate) use descriptor::{Descriptor, largest_piece, pieces};
pub use pgs_interface::axi_dma::Direction;
pub use registers::{Dmacr, Dmasr};
pub(crate) use reset::reset_core;
pub use ring::DescriptorState;
pub(crate) use ring::{ChainState, Progress, Ring};

use crate::platform::PlatformError;

/// How long a DMA core may take to reset, to start or to stop.
pub(crate) const STATE_CHANGE: Duration = Duration::from_millis(10);

/// One direction of one DMA core: `dma2 MM2S`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelName {
    /// Which DMA core.
    pub core: usize,
    /// Which direction of it.
    pub direction: Direction,
}

impl fmt::Display for ChannelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "dma{} {}", self.core, self.direction)
    }
}

/// Why a DMA core could not be brought into a state.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DmaError {
    /// A register reads all ones.
    #[error("{channel} reads all ones: is the bitstream still loaded and its clock running?")]
    Gone {
        /// Which channel.
        channel: ChannelName,
    },
    /// A state was not reached in time.
    #[error("{channel} was expected to be {awaited} within {limit:?}, found {found}")]
    State {
        /// Which channel.
        channel: ChannelName,
        /// The state that was awaited.
        awaited: &'static str,
        /// The time limit.
        limit: Duration,
        /// The register that shows the state, decoded.
        found: String,
    },
    /// A channel that was started does not have the descriptor that it was given. Its doorbell was
    /// not rung: it would fetch what lies there.
    #[error(
        "{channel} has its first descriptor at {found:#x}, {expected:#x} was written: it was not \
         let run; does another program use this core, or was it reset meanwhile?"
    )]
    FirstDescriptor {
        /// Which channel.
        channel: ChannelName,
        /// Bus address that was written.
        expected: u64,
        /// Bus address that CURDESC shows.
        found: u64,
    },
    /// The core was built without scatter-gather.
    #[error(
        "{channel} was built without scatter-gather (status {found}): build the bitstream with it"
    )]
    NoScatterGather {
        /// Which channel.
        channel: ChannelName,
        /// Its status, decoded.
        found: String,
    },
    /// The length register has another width than expected.
    #[error(
        "{channel} has a length register of {found} bits, {expected} were expected: correct the \
         bitstream's DMA capability register or the length width given at opening"
    )]
    LengthWidth {
        /// Which channel.
        channel: ChannelName,
        /// Width by the capability register or by the caller, bits.
        expected: u32,
        /// Width as found, bits.
        found: u32,
    },
    /// The length register reads back something that is not a row of ones.
    #[error("{channel} LENGTH reads {found:#010x} after all ones were written: not an AXI DMA?")]
    NotALength {
        /// Which channel.
        channel: ChannelName,
        /// Its value.
        found: u32,
    },
    /// The memory for descriptors failed.
    #[error(transparent)]
    Platform(#[from] PlatformError),
}
