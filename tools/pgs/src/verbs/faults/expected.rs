//! Defines the driver's expected reaction to each fault.

use bitstream_model::interface::control::ErrorCode;
use bitstream_model::{Consequence, Direction, FaultKind};
use zynq_pgs::error::Aftermath;

/// The expected outcome of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expected {
    /// The step succeeds, with the bits of a step without faults.
    SameBits,
    /// The step fails.
    Fails {
        /// The name of the cause in the error.
        cause: &'static str,
        /// The channel in the error, if a driver can know it.
        channel: Option<(usize, Direction)>,
        aftermath: Aftermath,
    },
}

/// The expected outcome of a fault, in a channel if it has one.
pub(super) fn expected(kind: FaultKind, channel: Option<(usize, Direction)>) -> Expected {
    use FaultKind as K;
    if kind.consequence() == Consequence::Survivable && !matches!(kind, K::ResetSlow { .. }) {
        return Expected::SameBits;
    }
    let fails = |cause, channel, aftermath| Expected::Fails { cause, channel, aftermath };
    let here = |cause| fails(cause, channel, Aftermath::Ready);
    let anywhere = |cause| fails(cause, None, Aftermath::Ready);
    let lost = |cause| fails(cause, None, Aftermath::MustReopen);
    let received = channel.is_some_and(|(_, direction)| direction == Direction::S2mm);
    match kind {
        K::DmaIntErr => here("dma-internal-error"),
        K::DmaSlvErr => here("dma-slave-error"),
        K::DmaDecErr => here("dma-decode-error"),
        K::SgIntErr => here("sg-internal-error"),
        K::SgSlvErr => here("sg-slave-error"),
        K::SgDecErr | K::SgDecErrWrite => here("sg-decode-error"),
        K::BdIntErr => here("descriptor-internal-error"),
        K::BdSlvErr => here("descriptor-slave-error"),
        K::BdDecErr => here("descriptor-decode-error"),
        K::ShortPacket if received => here("short-packet"),
        K::LongPacket if received => here("long-packet"),
        K::NoTlast if received => here("no-tlast"),
        // The accelerator detects it and reports the stream.
        K::ShortPacket => here("accelerator-tlast-early"),
        K::LongPacket | K::NoTlast => here("accelerator-tlast-missing"),
        // A checksum does not locate the word.
        K::Corrupt { .. } => anywhere("checksum"),
        K::AcceleratorError { code } => anywhere(name(code)),
        K::NoDone => anywhere("no-done"),
        K::OtherBitstream { .. } => lost("other-bitstream"),
        K::Reloaded => anywhere("logic-reset"),
        K::PowerLost => lost("gone"),
        K::ResetNever => lost("deadline"),
        // The stall before the reset, and the hang, show only as silence.
        K::Stall | K::AcceleratorHang | K::ResetSlow { .. } => anywhere("deadline"),
        // A kind without an expectation passes nowhere.
        _ => anywhere("unknown"),
    }
}

fn name(code: ErrorCode) -> &'static str {
    match code {
        ErrorCode::BodyIndex => "accelerator-body-index",
        ErrorCode::ContactCount => "accelerator-contact-count",
        ErrorCode::TlastEarly => "accelerator-tlast-early",
        ErrorCode::TlastMissing => "accelerator-tlast-missing",
        ErrorCode::ShapeIndex => "accelerator-shape-index",
        ErrorCode::Capacity => "accelerator-capacity",
        ErrorCode::StaticPair => "accelerator-static-pair",
        ErrorCode::SelfCollision => "accelerator-self-collision",
        ErrorCode::Argument => "accelerator-argument",
        ErrorCode::PartialBeat => "accelerator-partial-beat",
        _ => "accelerator-unknown",
    }
}
