//! Records the state of the board after a failed step, before anything is reset.

use std::time::Duration;

use pgs_interface::control::{AP_CTRL, ERROR, ERROR_DETAIL, IDENTIFICATION};

use super::device::Device;
use super::outline::Outline;
use super::port::Port;
use crate::axi_dma::{ChainState, ChannelName, Direction, Dmacr, Dmasr};
use crate::fault::{ChannelState, ControlState, Diagnosis, Phase};

impl Device {
    /// Reads everything that may explain why a step failed. `seen` is a port and the status that it
    /// showed before.
    pub(crate) fn snapshot(&mut self, seen: Option<(usize, Dmasr)>) -> Diagnosis {
        // Taken first: the reads below would push them out of the log.
        let accesses = self.counts.recent();
        let mut channels = Vec::new();
        let outline = self.started.as_ref().map(|started| &started.outline);
        let mut gone = false;
        for (place, port) in self.ports().enumerate() {
            let before = seen.filter(|(seen, _)| *seen == place).map(|(_, status)| status);
            let state = channel_state(port, before, outline);
            gone = state.status.gone();
            channels.push(state);
            if gone {
                // Further reads might block the bus.
                break;
            }
        }
        // Another design may answer, without DMA cores at these addresses.
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
            set_up: control.is_set_up(),
            changed: self.fingerprint.difference(&found),
        }
    }
}

fn channel_state(port: &Port, before: Option<Dmasr>, outline: Option<&Outline>) -> ChannelState {
    let channel = &port.channel;
    let name = (channel.name(), channel.address_width(), port.running());
    let now = channel.status();
    // An error that was seen and has gone since is the error that the step failed with.
    let status = before.filter(|_| now.errors() == 0).unwrap_or(now);
    if status.gone() {
        let chain = port.survey(u64::MAX);
        return state_of(name, (Dmacr(u32::MAX), status), (u64::MAX, u64::MAX), &chain, outline);
    }
    let current = channel.current_descriptor();
    // Read after the status: a chain that completes in between does not look stuck.
    let chain = port.survey(current);
    let registers = (channel.control(), status);
    state_of(name, registers, (current, channel.tail_descriptor()), &chain, outline)
}

/// The state of a channel, from its registers and its chain.
fn state_of(
    (channel, address_width, started): (ChannelName, u32, bool),
    (control, status): (Dmacr, Dmasr),
    (current, tail): (u64, u64),
    chain: &ChainState,
    outline: Option<&Outline>,
) -> ChannelState {
    let failed = chain.failed.or(chain.at_address.filter(|_| status.errors() != 0));
    let descriptor = failed.or(chain.in_work);
    let at = descriptor.map_or(chain.descriptors, |state| state.index);
    let phase = match channel.direction {
        Direction::S2mm => Phase::Results,
        Direction::Mm2s => {
            outline.map_or(Phase::Load, |outline| outline.phase_of(channel.core, at))
        }
    };
    ChannelState {
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
        started,
        address_width,
    }
}
