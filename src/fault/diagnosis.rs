//! The state of every channel and of the control block when a step failed, before the reset.

use std::fmt;
use std::time::Duration;

use pgs_interface::axi_dma::{CURDESC, CURDESC_MSB, DMACR, DMASR, TAILDESC, TAILDESC_MSB};
use pgs_interface::control::{AP_CTRL, ERROR, ERROR_DETAIL, IDENTIFICATION};

use super::Fault;
use super::phase::Phase;
use crate::axi_dma::{ChannelName, DescriptorState, Dmacr, Dmasr};
use crate::control_block::Changed;
use crate::platform::{Decoded, RegisterAccess, RegisterMap};

/// The state of the board when a step had failed, before anything was reset.
#[derive(Debug)]
#[non_exhaustive]
pub struct Diagnosis {
    /// The phase of the step, by the data that had left memory.
    pub phase: Phase,
    /// Time since the step was started, on the board's clock.
    pub elapsed: Duration,
    /// All channels, receivers first, up to the first that reads all ones.
    pub channels: Vec<ChannelState>,
    /// The control block; `None` if no device answers any more.
    pub control: Option<ControlState>,
    /// The last register accesses before the diagnosis, oldest first.
    pub accesses: Vec<RegisterAccess>,
    /// The reason why the following reset failed, if it did.
    pub reset: Option<Box<Fault>>,
}

/// The state of a channel. The text names the channel, its phase, its descriptor and the bytes
/// moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelState {
    /// The channel.
    pub channel: ChannelName,
    /// Its control register.
    pub control: Dmacr,
    /// Its status register.
    pub status: Dmasr,
    /// CURDESC: bus address of the descriptor in work, or of the one that failed.
    pub current: u64,
    /// TAILDESC: bus address of the last descriptor of the step.
    pub tail: u64,
    /// The phase of the step that it had reached.
    pub phase: Phase,
    /// Descriptors of the step.
    pub descriptors: usize,
    /// Descriptors that are complete.
    pub complete: usize,
    /// The descriptor in which the received packet ended, from 0, if it ended.
    pub packet_end: Option<usize>,
    /// Bytes moved, by the descriptors' counts.
    pub bytes_moved: u64,
    /// Bytes that the step moves on this channel.
    pub bytes_expected: u64,
    /// The descriptor that failed, or else the descriptor in work.
    pub descriptor: Option<DescriptorState>,
    /// Whether the driver has started it, and neither stopped nor reset it since.
    pub(crate) started: bool,
    /// Bits of the bus addresses in its registers.
    pub(crate) address_width: u32,
}

/// The state of the control block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ControlState {
    /// The register `AP_CTRL`.
    pub control: u32,
    /// The register ERROR.
    pub error: u32,
    /// The register `ERROR_DETAIL`.
    pub error_detail: u32,
    /// The register IDENTIFICATION.
    pub identification: u32,
    /// Whether it has not been reset since the driver's last reset.
    pub(crate) set_up: bool,
    /// The first identity register that differs from its value at opening.
    pub(crate) changed: Option<Changed>,
}

impl fmt::Display for ChannelState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { channel, phase, descriptors, bytes_moved, bytes_expected, .. } = self;
        write!(f, "{channel} in {phase}")?;
        match &self.descriptor {
            Some(DescriptorState { index, address, bytes, status }) => write!(
                f,
                ", descriptor {} of {descriptors} ({bytes} bytes, at {address:#x}, status \
                 {status})",
                index + 1
            )?,
            None => write!(f, ", all {descriptors} descriptors complete")?,
        }
        write!(f, ", {bytes_moved} of {bytes_expected} bytes moved")
    }
}

impl ChannelState {
    /// Whether all descriptors of the step are complete.
    pub(crate) fn done(&self) -> bool {
        self.complete == self.descriptors
    }

    /// Offset and value of each register that was read.
    fn registers(&self) -> impl Iterator<Item = (u32, u32)> {
        let base = self.channel.direction.offset();
        #[allow(clippy::cast_possible_truncation, reason = "the other half is high()")]
        let low = |address: u64| address as u32;
        let high = |address: u64| low(address >> 32);
        let (gone, wide) = (self.status.gone(), self.address_width > 32);
        [
            (DMACR, self.control.raw(), !gone),
            (DMASR, self.status.raw(), true),
            (CURDESC, low(self.current), !gone),
            (CURDESC_MSB, high(self.current), !gone && wide),
            (TAILDESC, low(self.tail), !gone),
            (TAILDESC_MSB, high(self.tail), !gone && wide),
        ]
        .into_iter()
        .filter(|(_, _, read)| *read)
        .map(move |(register, value, _)| (base + register.offset, value))
    }
}

impl Diagnosis {
    /// The registers, decoded, one a line: `dma2 MM2S DMASR = 0x00010049 ...`.
    #[must_use]
    pub fn registers(&self) -> Vec<String> {
        let line = |map, (at, value)| Decoded { map, at, arrow: "=", value }.to_string();
        let channels = self.channels.iter().flat_map(|state| {
            state.registers().map(move |found| line(RegisterMap::Dma(state.channel.core), found))
        });
        let control = self.control.iter().flat_map(|state| {
            let words = [
                (AP_CTRL.offset, state.control),
                (ERROR.offset, state.error),
                (ERROR_DETAIL.offset, state.error_detail),
                (IDENTIFICATION.offset, state.identification),
            ];
            words.map(|found| line(RegisterMap::Control, found))
        });
        channels.chain(control).collect()
    }
}
