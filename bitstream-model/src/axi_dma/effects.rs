//! Effects of faults that outlast a beat.

use pgs_interface::axi_dma::Direction;

/// Effects of faults on a channel, until its packet ends or its core is reset.
#[derive(Debug, Clone, Default)]
pub(super) struct FaultEffects {
    /// The channel moves no beat.
    pub(super) stalled: bool,
    /// Additional clocks for each beat.
    pub(super) slow: u32,
    /// MM2S: the packet has ended on the stream; its other beats are dropped.
    pub(super) cut: bool,
    /// S2MM: the packet has ended in memory; its other beats are dropped.
    pub(super) discards: bool,
    /// A beat with TLAST is still to follow the packet.
    pub(super) extra: bool,
    /// Status words on their way to memory: cycle of arrival, address of the descriptor, word.
    pub(super) late: Vec<(u64, u64, u32)>,
}

impl FaultEffects {
    /// Whether no fault has an effect on the channel.
    pub(super) fn none(&self) -> bool {
        let Self { stalled, slow, cut, discards, extra, late } = self;
        !(*stalled || *cut || *discards || *extra) && *slow == 0 && late.is_empty()
    }

    /// Whether the effect of a fault holds the next packet back: a beat has to follow the previous
    /// packet first, or the rest of a dropped packet has to arrive.
    pub(super) fn holds(&self, direction: Direction) -> bool {
        self.discards || self.extra && direction == Direction::Mm2s
    }
}
