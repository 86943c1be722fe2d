//! The ways in which a DMA channel fails.

use std::fmt;

use super::ChannelState;

/// The way in which a channel failed: the error bit of its status (PG021, DMASR) or of a
/// descriptor, or a packet of another length than the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChannelFault {
    /// The channel stopped with `DMAIntErr`.
    DmaInternal,
    /// The channel stopped with `DMASlvErr`.
    DmaSlave,
    /// The channel stopped with `DMADecErr`.
    DmaDecode,
    /// The channel stopped with `SGIntErr`.
    SgInternal,
    /// The channel stopped with `SGSlvErr`.
    SgSlave,
    /// The channel stopped with `SGDecErr`.
    SgDecode,
    /// A descriptor ended with `DMAIntErr`, while its channel shows no error.
    DescriptorInternal,
    /// A descriptor ended with `DMASlvErr`, while its channel shows no error.
    DescriptorSlave,
    /// A descriptor ended with `DMADecErr`, while its channel shows no error.
    DescriptorDecode,
    /// The channel is idle, and its descriptors are not complete.
    StatusMissing,
    /// A packet of results ended too early.
    ShortPacket,
    /// A packet of results went on after its last beat.
    LongPacket,
    /// A packet of results is complete and has no TLAST.
    NoPacketEnd,
}

impl ChannelFault {
    /// The name that stays the same from version to version.
    pub(super) const fn name(self) -> &'static str {
        self.described().0
    }

    /// The name; the symptom, up to the channel; the rest of it, and the next step.
    const fn described(self) -> (&'static str, &'static str, &'static str) {
        const WRITTEN: &str = ", and none in the channel's status: is the memory of the \
                               descriptors written by somebody else?";
        match self {
            Self::DmaInternal => (
                "dma-internal-error",
                "DMAIntErr on",
                ": a descriptor of no bytes, or an error inside the core; is the memory of the \
                 descriptors what the core sees? see `pgs check`",
            ),
            Self::DmaSlave => (
                "dma-slave-error",
                "DMASlvErr on",
                ": the memory refused a buffer; is it protected, or behind an SMMU that has no \
                 mapping for this port?",
            ),
            Self::DmaDecode => (
                "dma-decode-error",
                "DMADecErr on",
                ": nothing answers at the address of a buffer; is this memory assigned to the \
                 port in the block design, and are its addresses wide enough?",
            ),
            Self::SgInternal => (
                "sg-internal-error",
                "SGIntErr on",
                ": it fetched a descriptor that it had completed before; the memory of the \
                 descriptors must not be cached: see `pgs check`",
            ),
            Self::SgSlave => (
                "sg-slave-error",
                "SGSlvErr on",
                ": the memory refused a descriptor; is it protected, or behind an SMMU that has \
                 no mapping for the descriptor port?",
            ),
            Self::SgDecode => (
                "sg-decode-error",
                "SGDecErr on",
                ": nothing answers at the address of a descriptor; the descriptor port is a \
                 master of its own: is it in the address map of the block design?",
            ),
            Self::DescriptorInternal => {
                ("descriptor-internal-error", "DMAIntErr in a descriptor of", WRITTEN)
            }
            Self::DescriptorSlave => {
                ("descriptor-slave-error", "DMASlvErr in a descriptor of", WRITTEN)
            }
            Self::DescriptorDecode => {
                ("descriptor-decode-error", "DMADecErr in a descriptor of", WRITTEN)
            }
            Self::StatusMissing => (
                "descriptor-status-missing",
                "no status in the descriptors of",
                ", though the channel is idle: it did not reach memory in time; the memory of the \
                 descriptors must not be cached: see `pgs check`",
            ),
            Self::ShortPacket => (
                "short-packet",
                "a packet that ended early on",
                ": the accelerator's TLAST comes too soon, or beats were lost",
            ),
            Self::LongPacket => (
                "long-packet",
                "more than the results on",
                ": the accelerator's TLAST comes too late, or beats were doubled",
            ),
            Self::NoPacketEnd => (
                "no-tlast",
                "no TLAST on",
                ": is it connected between the accelerator and this channel?",
            ),
        }
    }

    /// The message of a failure of this kind.
    pub(super) fn text(self, at: &ChannelState) -> impl fmt::Display {
        let (_, symptom, next) = self.described();
        format!("{symptom} {at}{next}")
    }
}
