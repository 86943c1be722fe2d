//! Decodes physical register addresses into regions and offsets.

use pgs_interface::address_map::{CONTROL_BASE, CONTROL_BYTES, DMA_BYTES, DMA_COUNT_MAX, dma_base};

/// The part that answers at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// Register of an AXI DMA.
    Dma { core: usize, offset: u32 },
    /// Register of the control block.
    Control { offset: u32 },
    /// No part answers.
    Nothing,
    /// Not a multiple of 4.
    Unaligned,
}

/// Decodes an address on a board with `cores` AXI DMAs.
pub(crate) fn decode(address: u64, cores: usize) -> Target {
    if !address.is_multiple_of(4) {
        return Target::Unaligned;
    }
    let offset_in = |base: u64, bytes: u32| {
        let offset = u32::try_from(address.checked_sub(base)?).ok()?;
        (offset < bytes).then_some(offset)
    };
    if let Some(offset) = offset_in(CONTROL_BASE, CONTROL_BYTES) {
        return Target::Control { offset };
    }
    (0..cores.min(DMA_COUNT_MAX))
        .find_map(|core| {
            offset_in(dma_base(core), DMA_BYTES).map(|offset| Target::Dma { core, offset })
        })
        .unwrap_or(Target::Nothing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_region_ends_where_the_next_begins() {
        assert_eq!(decode(0xA000_0000, 4), Target::Dma { core: 0, offset: 0 });
        assert_eq!(decode(0xA000_FFFC, 4), Target::Dma { core: 0, offset: 0xFFFC });
        assert_eq!(decode(0xA003_0004, 4), Target::Dma { core: 3, offset: 4 });
        assert_eq!(decode(0xA003_0004, 3), Target::Nothing);
        assert_eq!(decode(0xA004_0180, 4), Target::Control { offset: 0x180 });
        assert_eq!(decode(0xA004_1000, 4), Target::Nothing);
        assert_eq!(decode(0x9FFF_FFFC, 4), Target::Nothing);
        assert_eq!(decode(0xA000_0002, 4), Target::Unaligned);
    }
}
