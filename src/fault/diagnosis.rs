//! This file takes down how everything stands when a step has failed, before anything is reset.

use std::fmt;
use std::time::Duration;

use pgs_interface::axi_dma::{
    CURDESC, CURDESC_MSB, DMACR, DMASR, S2MM_OFFSET, TAILDESC, TAILDESC_MSB,
};
use pgs_interface::control::{AP_CTRL, ERROR, ERROR_DETAIL, IDENTIFICATION};

use super::Fault;
use super::phase::{Outline, Phase};
use crate::axi_dma::{ChainState, ChannelName, DescriptorState, Direction, Dmacr, Dmasr};
use crate::board::device::Device;
use crate::board::port::Lane;
use crate::control_block::Changed;
use crate::platform::{Decoded, RegisterAccess, RegisterMap};

/// How everything stood when a step had failed, before anything was reset.
#[derive(Debug)]
#[non_exhaustive]
pub struct Diagnosis {
    /// How far the step was, by what had left memory.
    pub phase: Phase,
    /// Time since the step was started, on the board's clock.
    pub elapsed: Duration,
    /// All channels, receivers first; up to the first that reads all ones.
    pub channels: Vec<ChannelState>,
    /// The control block; `None` if nothing answers any more.
    pub control: Option<ControlState>,
    /// The last register accesses before, oldest first.
    pub accesses: Vec<RegisterAccess>,
    /// Why the reset that followed failed, if it did.
    pub reset: Option<Box<Fault>>,
}

/// How a channel stood. As text: which, where in the step, at which descriptor, after how many bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelState {
    /// Which channel.
    pub channel: ChannelName,
    /// Its control register.
    pub control: Dmacr,
    /// Its status register.
    pub status: Dmasr,
    /// CURDESC: bus address of the descriptor in work, or of the one that failed.
    pub current: u64,
    /// TAILDESC: bus address of the last descriptor of the step.
    pub tail: u64,
    /// Which part of the step it was at.
    pub phase: Phase,
    /// Descriptors of the step.
    pub descriptors: usize,
    /// Of them, complete.
    pub complete: usize,
    /// Where the received packet ended, if it did: a descriptor of the step, from 0.
    pub packet_end: Option<usize>,
    /// Bytes moved, as the descriptors say.
    pub bytes_moved: u64,
    /// Bytes that the step moves on this channel.
    pub bytes_expected: u64,
    /// The descriptor that failed, or else the one in work.
    pub descriptor: Option<DescriptorState>,
    /// Bits of the bus addresses in its registers.
    pub(crate) address_width: u32,
}

/// How the control block stood.
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
    /// A capability register that another bitstream answers.
    pub(crate) changed: Option<Changed>,
}

impl fmt::Display for ChannelState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { channel, phase, descriptors, bytes_moved, bytes_expected, .. } = self;
        write!(f, "{channel} in {phase}")?;
        match &self.descriptor {
            Some(DescriptorState { index, address, bytes, status }) => write!(
                f,
                ", descriptor {} of {descriptors} ({bytes} bytes, at {address:#x}, status {status})",
                index + 1
            )?,
            None => write!(f, ", all {descriptors} descriptors complete")?,
        }
        write!(f, ", {bytes_moved} of {bytes_expected} bytes moved")
    }
}

impl ChannelState {
    /// A channel whose chain stands like that.
    pub(crate) fn new(
        (channel, address_width): (ChannelName, u32),
        (control, status): (Dmacr, Dmasr),
        (current, tail): (u64, u64),
        chain: &ChainState,
        outline: Option<&Outline>,
    ) -> Self {
        let failed = chain.failed.or(chain.at_address.filter(|_| status.errors() != 0));
        let descriptor = failed.or(chain.in_work);
        let at = descriptor.map_or(chain.descriptors, |state| state.index);
        let phase = match channel.direction {
            Direction::S2mm => Phase::Results,
            Direction::Mm2s => {
                outline.map_or(Phase::Load, |outline| outline.phase_of(channel.core, at))
            }
        };
        Self {
            channel,
            control,
            status,
            current,
            tail,
            phase,
            descriptors: chain.descriptors,
            complete: chain.complete,
            packet_end: chain.packet_end,
            bytes_moved: chain.bytes_moved,
            bytes_expected: chain.bytes_expected,
            descriptor,
            address_width,
        }
    }

    /// Whether the step is through with it.
    pub(crate) fn done(&self) -> bool {
        self.complete == self.descriptors
    }

    /// Those that were read.
    fn registers(&self) -> impl Iterator<Item = (u32, u32)> {
        let base = match self.channel.direction {
            Direction::Mm2s => 0,
            Direction::S2mm => S2MM_OFFSET,
        };
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

impl Device {
    /// Reads everything that tells why a step failed. The lane at `seen` had that status before,
    /// should it read another now.
    pub(crate) fn snapshot(&mut self, seen: Option<(usize, Dmasr)>) -> Diagnosis {
        // Before the reads that follow push them out.
        let accesses = self.counts.recent();
        let mut channels = Vec::new();
        let outline = self.started.as_ref().map(|started| &started.outline);
        let mut gone = false;
        for (place, lane) in self.lanes().enumerate() {
            let before = seen.filter(|(seen, _)| *seen == place).map(|(_, status)| status);
            let state = channel_state(lane, before, outline);
            gone = state.status.gone();
            channels.push(state);
            if gone {
                // Whatever else is read may hold the bus up.
                break;
            }
        }
        // What answers may be another design, which has nothing where the channels were.
        let answers = !gone || self.control.read(&IDENTIFICATION) != u32::MAX;
        let control = answers.then(|| self.control_state());
        let senders = channels.iter().filter(|state| state.channel.direction == Direction::Mm2s);
        let unfinished = senders.filter(|state| !state.done()).map(|state| state.phase);
        let elapsed = self
            .started
            .as_ref()
            .map_or(Duration::ZERO, |started| self.platform.now().saturating_sub(started.at));
        let phase = match self.started {
            Some(_) => unfinished.min().unwrap_or(Phase::Results),
            None => Phase::Load,
        };
        Diagnosis { phase, elapsed, channels, control, accesses, reset: None }
    }

    fn control_state(&mut self) -> ControlState {
        let control = &self.control;
        let found = control.fingerprint();
        ControlState {
            control: control.read(&AP_CTRL),
            error: control.read(&ERROR),
            error_detail: control.read(&ERROR_DETAIL),
            identification: found.identification(),
            changed: self.fingerprint.difference(&found),
        }
    }
}

fn channel_state(lane: &Lane, before: Option<Dmasr>, outline: Option<&Outline>) -> ChannelState {
    let channel = &lane.channel;
    let name = (channel.name(), channel.address_width());
    let now = channel.status();
    // A status that was seen and is no longer shown is what the step failed of.
    let status = before.filter(|_| now.errors() == 0).unwrap_or(now);
    if status.gone() {
        let chain = lane.survey(u64::MAX);
        return ChannelState::new(
            name,
            (Dmacr(u32::MAX), status),
            (u64::MAX, u64::MAX),
            &chain,
            outline,
        );
    }
    let current = channel.current_descriptor();
    // Behind the status: a chain that became complete in between is not one that hangs.
    let chain = lane.survey(current);
    let registers = (channel.control(), status);
    ChannelState::new(name, registers, (current, channel.tail_descriptor()), &chain, outline)
}
