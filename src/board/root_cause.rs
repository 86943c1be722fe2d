//! Picks the root cause out of a diagnosis.

use pgs_interface::axi_dma::dmasr;
use pgs_interface::control::{ErrorCode, error};
use pgs_interface::descriptor::status;

use super::device::Device;
use super::symptom::{Symptom, control_block_reset};
use crate::axi_dma::{ChannelName, Direction};
use crate::control_block::{Changed, StickyError};
use crate::fault::diagnosis::{ChannelState, ControlState, Diagnosis};
use crate::fault::phase::Phase;
use crate::fault::{AcceleratorError, Awaited, ChannelFault, Fault, Subject};

impl Device {
    /// Finds the cause of a failure: the fault, and the state of the board, unless the board had no
    /// part in it.
    pub(crate) fn diagnose(&mut self, symptom: Symptom) -> (Fault, Option<Box<Diagnosis>>) {
        use Fault::{Cancelled, ImpulseNotFinite, NoMemory, NotFinite};
        if let Symptom::Known(fault @ (NotFinite { .. } | ImpulseNotFinite { .. } | NoMemory(_))) =
            symptom
        {
            return (fault, None);
        }
        if matches!(symptom, Symptom::Known(Cancelled)) && !self.in_flight() {
            return (Cancelled, None);
        }
        if let Err(error) = self.platform.check_present() {
            return (error.into(), None);
        }
        let seen = match symptom {
            Symptom::Status { place, status } => Some((place, status)),
            _ => None,
        };
        let diagnosis = self.snapshot(seen);
        // A lost platform leaves nothing to read.
        if let Some(error) = self.platform.lost() {
            return (error.into(), None);
        }
        let fault = root_cause(&diagnosis, symptom);
        (fault, Some(Box::new(diagnosis)))
    }
}

/// The one fault that the others follow from.
fn root_cause(diagnosis: &Diagnosis, symptom: Symptom) -> Fault {
    match (replaced(diagnosis), symptom) {
        // Comes before every other cause: the registers belong to another design.
        (Some(fault @ Fault::OtherBitstream { .. }), _) => fault,
        (_, Symptom::Known(fault @ (Fault::Platform(_) | Fault::Cancelled))) => fault,
        (Some(fault), _) => fault,
        (None, symptom) => match diagnosis.control {
            Some(ControlState { set_up: false, .. }) => control_block_reset(),
            _ => standing(diagnosis, symptom),
        },
    }
}

/// The cause that the channels and the accelerator show, or else the symptom's.
fn standing(diagnosis: &Diagnosis, symptom: Symptom) -> Fault {
    let sticky = match &symptom {
        Symptom::Sticky(error) => Some(*error),
        _ => None,
    };
    let found = stopped(diagnosis)
        .or_else(|| halted(diagnosis))
        .or_else(|| failed_descriptor(diagnosis))
        .or_else(|| accelerator(diagnosis, sticky))
        .or_else(|| wrong_packet(diagnosis));
    match (found, symptom) {
        (Some(fault), _) => fault,
        (None, Symptom::Known(fault)) => fault,
        (None, Symptom::Late { awaited, limit }) => status_missing(diagnosis, awaited)
            .unwrap_or_else(|| Fault::Deadline {
                awaited,
                limit,
                phase: diagnosis.phase,
                behind: behind(&diagnosis.channels),
            }),
        // A wrong chain that is right by now. A wrong status is kept in the diagnosis.
        (None, Symptom::Status { place, .. } | Symptom::Chain { place }) => {
            match diagnosis.channels.get(place) {
                Some(state) => of(ChannelFault::ShortPacket, state),
                None => Fault::Gone { region: "the board".to_owned() },
            }
        }
        (None, Symptom::Sticky(error)) => {
            Fault::Accelerator(Box::new(decoded(error, diagnosis.phase)))
        }
    }
}

/// The fault if no board answers any more, or another bitstream.
fn replaced(diagnosis: &Diagnosis) -> Option<Fault> {
    let gone = diagnosis.channels.iter().find(|state| state.status.gone());
    let gone = gone.map(|state| Fault::Gone { region: state.channel.to_string() });
    match diagnosis.control {
        Some(ControlState { identification: u32::MAX, .. }) => {
            gone.or_else(|| Some(Fault::Gone { region: "the control block".to_owned() }))
        }
        Some(ControlState { changed: Some(changed), .. }) => Some(other_bitstream(changed)),
        _ => gone,
    }
}

/// The fault of another bitstream that answers.
pub(crate) fn other_bitstream(Changed { register, expected, found }: Changed) -> Fault {
    Fault::OtherBitstream { register, expected, found }
}

/// The fault of a channel.
fn of(cause: ChannelFault, state: &ChannelState) -> Fault {
    Fault::Channel { cause, at: Box::new(*state) }
}

/// The channel that stopped with an error; among several, the channel at the earliest phase.
fn stopped(diagnosis: &Diagnosis) -> Option<Fault> {
    let with_errors = diagnosis.channels.iter().filter(|state| state.status.errors() != 0);
    let state = with_errors.min_by_key(|state| state.phase)?;
    let shows = |bit: u32| state.status.errors() & bit != 0;
    let kinds = [
        (dmasr::DMA_DEC_ERR.mask(), ChannelFault::DmaDecode),
        (dmasr::DMA_SLV_ERR.mask(), ChannelFault::DmaSlave),
        (dmasr::SG_DEC_ERR.mask(), ChannelFault::SgDecode),
        (dmasr::SG_SLV_ERR.mask(), ChannelFault::SgSlave),
        (dmasr::SG_INT_ERR.mask(), ChannelFault::SgInternal),
    ];
    if let Some((_, cause)) = kinds.into_iter().find(|(bit, _)| shows(*bit)) {
        return Some(of(cause, state));
    }
    // The receiver's buffers are full, no descriptor has failed, and the packet goes on.
    let overrun = state.channel.direction == Direction::S2mm
        && state.done()
        && state.descriptors > 0
        && state.packet_end.is_none();
    let failed = state.descriptor.is_some_and(|descriptor| descriptor.status.failed());
    let long = overrun && !failed;
    Some(of(if long { ChannelFault::LongPacket } else { ChannelFault::DmaInternal }, state))
}

/// The channel that a reset has halted: it was started, and no channel shows an error.
fn halted(diagnosis: &Diagnosis) -> Option<Fault> {
    let state = diagnosis.channels.iter().find(|state| state.started && state.status.halted())?;
    Some(Fault::LogicReset { region: state.channel.to_string() })
}

/// The descriptor that failed while no channel shows an error.
fn failed_descriptor(diagnosis: &Diagnosis) -> Option<Fault> {
    let failed = diagnosis.channels.iter().filter_map(|state| {
        let errors = state.descriptor.map_or(0, |descriptor| descriptor.status.errors());
        (errors != 0).then_some((state, errors))
    });
    let (state, errors) = failed.min_by_key(|(state, _)| state.phase)?;
    let cause = if errors & status::DMA_DEC_ERR.mask() != 0 {
        ChannelFault::DescriptorDecode
    } else if errors & status::DMA_SLV_ERR.mask() != 0 {
        ChannelFault::DescriptorSlave
    } else {
        ChannelFault::DescriptorInternal
    };
    Some(of(cause, state))
}

/// The accelerator's own error: the current one, or the one that was seen.
fn accelerator(diagnosis: &Diagnosis, seen: Option<StickyError>) -> Option<Fault> {
    let standing = diagnosis
        .control
        .filter(|control| control.error != 0)
        .map(|control| StickyError { raw: control.error, detail: control.error_detail });
    let error = standing.or(seen)?;
    Some(Fault::Accelerator(Box::new(decoded(error, diagnosis.phase))))
}

/// Decodes the registers of the sticky error. Indices assume that collisions and bodies were sent
/// in the caller's order.
pub(crate) fn decoded(StickyError { raw, detail }: StickyError, phase: Phase) -> AcceleratorError {
    let code = ErrorCode::from_register(raw);
    let stream = error::CHANNEL.of(raw) as usize;
    let (on_stream, subject) = match code {
        Some(ErrorCode::TlastEarly | ErrorCode::TlastMissing | ErrorCode::PartialBeat) => {
            (true, Subject::Beat(detail))
        }
        Some(
            ErrorCode::BodyIndex
            | ErrorCode::ContactCount
            | ErrorCode::StaticPair
            | ErrorCode::SelfCollision,
        ) => (false, Subject::Collision { sent: detail, given: usize::try_from(detail).ok() }),
        Some(ErrorCode::ShapeIndex) => {
            (false, Subject::Body { sent: detail, given: usize::try_from(detail).ok() })
        }
        Some(ErrorCode::Capacity) => (false, Subject::Bytes(detail)),
        Some(ErrorCode::Argument) => (false, Subject::Argument(detail)),
        _ => (false, Subject::Unknown),
    };
    let channel = on_stream.then_some(ChannelName { core: stream, direction: Direction::Mm2s });
    AcceleratorError { code, raw, detail, channel, subject, phase }
}

/// The receiver whose packet does not have the length of the results.
fn wrong_packet(diagnosis: &Diagnosis) -> Option<Fault> {
    let receivers =
        diagnosis.channels.iter().filter(|state| state.channel.direction == Direction::S2mm);
    receivers.filter(|state| state.descriptors > 0).find_map(|state| match state.packet_end {
        Some(end) if end + 1 < state.descriptors || state.bytes_moved < state.bytes_expected => {
            Some(of(ChannelFault::ShortPacket, state))
        }
        None if state.done() => Some(of(ChannelFault::NoPacketEnd, state)),
        _ => None,
    })
}

/// The channel that is idle while its descriptors are not complete.
fn status_missing(diagnosis: &Diagnosis, awaited: Awaited) -> Option<Fault> {
    let silent = |state: &&ChannelState| state.status.idle() && !state.done();
    let state = diagnosis.channels.iter().find(silent).filter(|_| awaited == Awaited::Results)?;
    Some(of(ChannelFault::StatusMissing, state))
}

/// The one channel that is behind all others of its direction: the only sender at the earliest
/// phase, else the only receiver that is not done.
fn behind(channels: &[ChannelState]) -> Option<ChannelName> {
    let of = |direction| {
        channels
            .iter()
            .filter(move |state| state.channel.direction == direction && state.descriptors > 0)
    };
    let senders = || of(Direction::Mm2s);
    let alone = |mut found: Vec<&ChannelState>, among: usize| match (found.pop(), found.pop()) {
        (Some(state), None) if among > 1 => Some(state.channel),
        _ => None,
    };
    if let Some(earliest) = senders().filter(|state| !state.done()).map(|state| state.phase).min() {
        let last = senders().filter(|state| !state.done() && state.phase == earliest).collect();
        return alone(last, senders().count());
    }
    let waiting = of(Direction::S2mm).filter(|state| !state.done()).collect();
    alone(waiting, of(Direction::S2mm).count())
}
