//! Addresses of the register regions and of memory in the processing system's address map.
//!
//! ```text
//! 0xA000_0000  AXI DMA 0   64 KiB  -+
//! 0xA001_0000  AXI DMA 1   64 KiB   |
//! 0xA002_0000  AXI DMA 2   64 KiB   |  M_AXI_HPM0_FPD
//! 0xA003_0000  AXI DMA 3   64 KiB   |
//! 0xA004_0000  control      4 KiB  -+
//! ```
//!
//! Source: UG1085 (M_AXI_HPM0_FPD window); the placement inside it is this project's.

/// Physical address of AXI DMA 0.
pub const DMA_BASE: u64 = 0xA000_0000;
/// Distance from one AXI DMA to the next, bytes.
pub const DMA_STRIDE: u64 = 0x1_0000;
/// Length of one AXI DMA's register region, bytes.
pub const DMA_BYTES: u32 = 0x1_0000;
/// The largest number of AXI DMAs beside one accelerator (a UIO node carries five regions).
pub const DMA_COUNT_MAX: usize = 4;
/// Physical address of the accelerator's control block.
pub const CONTROL_BASE: u64 = 0xA004_0000;
/// Length of the control block's region, bytes.
pub const CONTROL_BYTES: u32 = 0x1000;
/// Device-tree number of the one level interrupt (SPI, `pl_ps_irq0[0]`; the GIC's ID is 32 more).
pub const INTERRUPT_SPI: u32 = 89;

/// Name of the UIO node that carries all regions.
pub const UIO_NODE: &str = "pgs";
/// Names of the UIO nodes of the AXI DMAs, where each region has a node of its own.
pub const UIO_DMA_NODES: [&str; DMA_COUNT_MAX] = ["pgs-dma0", "pgs-dma1", "pgs-dma2", "pgs-dma3"];
/// Name of the UIO node of the control block, where each region has a node of its own. It carries
/// the interrupt.
pub const UIO_CONTROL_NODE: &str = "pgs-control";
/// Name of the UIO node of the memory that is reserved for DMA.
pub const UIO_MEMORY_NODE: &str = "pgs-memory";
/// Names of the UIO maps of the AXI DMAs.
pub const UIO_DMA_MAPS: [&str; DMA_COUNT_MAX] = ["dma0", "dma1", "dma2", "dma3"];
/// Name of the UIO map of the control block.
pub const UIO_CONTROL_MAP: &str = "control";
/// Name of the UIO node of the guard: memory behind the fence, for a test of the fence alone.
pub const UIO_GUARD_NODE: &str = "pgs-guard";
/// Name of the UIO map of the reserved memory.
pub const UIO_MEMORY_MAP: &str = "memory";
/// Name of the u-dma-buf, where DMA memory comes from that kernel module.
pub const U_DMA_BUF: &str = "pgs";

/// Default address of the reserved memory: in low DDR, so that cores with 32-bit addresses reach
/// it.
pub const MEMORY_BASE: u64 = 0x5000_0000;
/// Default length of the reserved memory, bytes: 38,880 bodies with 127,000 collisions take 19 MB
/// and some slack.
pub const MEMORY_BYTES: u64 = 64 << 20;
/// Length of the guard, which begins where the fence ends: a page of every kernel.
pub const GUARD_BYTES: u64 = 0x1_0000;

/// Addresses of low DDR: 2 GiB on the ZCU102.
pub const DDR_LOW: core::ops::Range<u64> = 0..0x8000_0000;
/// Addresses of high DDR on the ZCU102: the other 2 GiB of its 4.
pub const DDR_HIGH: core::ops::Range<u64> = 0x8_0000_0000..0x8_8000_0000;

/// Addresses through which the processors reach the programmable logic: `M_AXI_HPM0_LPD`, then
/// `M_AXI_HPM0_FPD` and `M_AXI_HPM1_FPD` below 4 GiB, the 8 GiB that both share, and the upper
/// window of each (UG1085).
pub const LOGIC_WINDOWS: [core::ops::Range<u64>; 6] = [
    0x8000_0000..0xA000_0000,
    0xA000_0000..0xB000_0000,
    0xB000_0000..0xC000_0000,
    0x4_0000_0000..0x6_0000_0000,
    0x10_0000_0000..0x48_0000_0000,
    0x48_0000_0000..0x80_0000_0000,
];

/// Whether any of these bytes lie in the programmable logic. An empty range counts as one byte.
#[must_use]
pub fn is_in_logic(address: u64, bytes: u64) -> bool {
    let end = address.saturating_add(bytes.max(1));
    LOGIC_WINDOWS.iter().any(|window| address < window.end && window.start < end)
}

/// Physical address of AXI DMA `k`.
#[must_use]
pub const fn dma_base(k: usize) -> u64 {
    DMA_BASE + k as u64 * DMA_STRIDE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regions_lie_in_the_logic_and_memory_does_not() {
        for core in 0..DMA_COUNT_MAX {
            assert!(is_in_logic(dma_base(core), DMA_BYTES.into()));
        }
        assert!(is_in_logic(CONTROL_BASE, CONTROL_BYTES.into()));
        for memory in [MEMORY_BASE..MEMORY_BASE + MEMORY_BYTES, DDR_LOW, DDR_HIGH] {
            assert!(!is_in_logic(memory.start, memory.end - memory.start), "{memory:x?}");
        }
        // QSPI, the peripherals, on-chip memory.
        for other in [0xC000_0000, 0xFD00_0000, 0xFFFC_0000] {
            assert!(!is_in_logic(other, 0x1000), "{other:#x}");
        }
    }

    #[test]
    fn a_range_counts_if_one_byte_of_it_does() {
        assert!(is_in_logic(0x7FFF_F000, 0x1001));
        assert!(!is_in_logic(0x7FFF_F000, 0x1000));
        assert!(is_in_logic(0xBFFF_FFFF, 0));
        assert!(!is_in_logic(u64::MAX, u64::MAX));
    }
}
