//! Register rows of the AMD AXI DMA v7.1, as PG021 gives them.
//!
//! A core has two channels. The rows give MM2S offsets; S2MM repeats them [`S2MM_OFFSET`] higher.
//! Registers are 32 bits wide, little-endian, and take aligned 32-bit accesses only.
//!
//! Source: PG021 (v7.1).

use std::fmt;

use super::register::{Access, Field, Register};

/// One of the two channels of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Memory-mapped to stream: the device reads memory.
    Mm2s,
    /// Stream to memory-mapped: the device writes memory.
    S2mm,
}

impl Direction {
    /// Distance of this channel's registers above the core's base.
    #[must_use]
    pub const fn offset(self) -> u32 {
        match self {
            Self::Mm2s => 0,
            Self::S2mm => S2MM_OFFSET,
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Mm2s => "MM2S",
            Self::S2mm => "S2MM",
        })
    }
}

/// Distance of the S2MM registers above the MM2S registers.
pub const S2MM_OFFSET: u32 = 0x30;

/// Fields of DMACR, the control register.
pub mod dmacr {
    use super::{Access, Field};

    /// Run (1) or stop (0). Cleared by hardware on an error.
    pub const RS: Field = Field::bit("RS", 0, Access::ReadWrite);
    /// Reads 1.
    pub const ALWAYS_ONE: Field = Field::bit("1", 1, Access::ReadOnly);
    /// Soft reset of the whole core, through either channel's bit; reads 1 until done.
    pub const RESET: Field = Field::bit("Reset", 2, Access::SelfClearing);
    /// All data accesses go to one address.
    pub const KEYHOLE: Field = Field::bit("Keyhole", 3, Access::ReadWrite);
    /// The engine goes round the ring without an end; it ignores Cmplted and the tail.
    pub const CYCLIC_BD: Field = Field::bit("CyclicBD", 4, Access::ReadWrite);
    /// Interrupt on complete, enable.
    pub const IOC_IRQ_EN: Field = Field::bit("IOC_IrqEn", 12, Access::ReadWrite);
    /// Delay-timer interrupt, enable.
    pub const DLY_IRQ_EN: Field = Field::bit("Dly_IrqEn", 13, Access::ReadWrite);
    /// Error interrupt, enable.
    pub const ERR_IRQ_EN: Field = Field::bit("Err_IrqEn", 14, Access::ReadWrite);
    /// Packets per interrupt on complete; writing 0 has no effect.
    pub const IRQ_THRESHOLD: Field = Field::bits("IRQThreshold", 16, 8, Access::ReadWrite);
    /// Delay-timer value; 0 is off.
    pub const IRQ_DELAY: Field = Field::bits("IRQDelay", 24, 8, Access::ReadWrite);
}

/// Fields of DMASR, the status register.
pub mod dmasr {
    use super::{Access, Field};

    /// The channel is stopped.
    pub const HALTED: Field = Field::bit("Halted", 0, Access::ReadOnly);
    /// Tail reached (scatter-gather), or transfer finished (direct).
    pub const IDLE: Field = Field::bit("Idle", 1, Access::ReadOnly);
    /// The core was built with scatter-gather.
    pub const SG_INCLD: Field = Field::bit("SGIncld", 3, Access::ReadOnly);
    /// Zero-length descriptor, or a packet larger than its buffers.
    pub const DMA_INT_ERR: Field = Field::bit("DMAIntErr", 4, Access::ReadOnly);
    /// Slave error on the data port.
    pub const DMA_SLV_ERR: Field = Field::bit("DMASlvErr", 5, Access::ReadOnly);
    /// Decode error on the data port.
    pub const DMA_DEC_ERR: Field = Field::bit("DMADecErr", 6, Access::ReadOnly);
    /// A fetched descriptor already had Cmplted set.
    pub const SG_INT_ERR: Field = Field::bit("SGIntErr", 8, Access::ReadOnly);
    /// Slave error on the descriptor port.
    pub const SG_SLV_ERR: Field = Field::bit("SGSlvErr", 9, Access::ReadOnly);
    /// Decode error on the descriptor port.
    pub const SG_DEC_ERR: Field = Field::bit("SGDecErr", 10, Access::ReadOnly);
    /// Transfer or threshold of packets complete.
    pub const IOC_IRQ: Field = Field::bit("IOC_Irq", 12, Access::WriteOneToClear);
    /// Delay timer expired.
    pub const DLY_IRQ: Field = Field::bit("Dly_Irq", 13, Access::WriteOneToClear);
    /// An error bit was set.
    pub const ERR_IRQ: Field = Field::bit("Err_Irq", 14, Access::WriteOneToClear);
    /// Packets still to go before IOC.
    pub const IRQ_THRESHOLD_STS: Field = Field::bits("IRQThresholdSts", 16, 8, Access::ReadOnly);
    /// Running delay counter.
    pub const IRQ_DELAY_STS: Field = Field::bits("IRQDelaySts", 24, 8, Access::ReadOnly);

    /// All error bits; only a reset clears them.
    pub const ERRORS: u32 = DMA_INT_ERR.mask()
        | DMA_SLV_ERR.mask()
        | DMA_DEC_ERR.mask()
        | SG_INT_ERR.mask()
        | SG_SLV_ERR.mask()
        | SG_DEC_ERR.mask();
    /// All interrupt bits; writing 1 clears exactly the written ones.
    pub const IRQS: u32 = IOC_IRQ.mask() | DLY_IRQ.mask() | ERR_IRQ.mask();
}

/// Control register.
pub const DMACR: Register = Register {
    name: "DMACR",
    offset: 0x00,
    access: Access::ReadWrite,
    reset: 0x0001_0002,
    fields: &[
        dmacr::RS,
        dmacr::ALWAYS_ONE,
        dmacr::RESET,
        dmacr::KEYHOLE,
        dmacr::CYCLIC_BD,
        dmacr::IOC_IRQ_EN,
        dmacr::DLY_IRQ_EN,
        dmacr::ERR_IRQ_EN,
        dmacr::IRQ_THRESHOLD,
        dmacr::IRQ_DELAY,
    ],
    source: "PG021, MM2S_DMACR",
};

/// Status register. The reset value belongs to a core without scatter-gather; a core with
/// scatter-gather sets bit 3 too.
pub const DMASR: Register = Register {
    name: "DMASR",
    offset: 0x04,
    access: Access::ReadOnly,
    reset: 0x0001_0001,
    fields: &[
        dmasr::HALTED,
        dmasr::IDLE,
        dmasr::SG_INCLD,
        dmasr::DMA_INT_ERR,
        dmasr::DMA_SLV_ERR,
        dmasr::DMA_DEC_ERR,
        dmasr::SG_INT_ERR,
        dmasr::SG_SLV_ERR,
        dmasr::SG_DEC_ERR,
        dmasr::IOC_IRQ,
        dmasr::DLY_IRQ,
        dmasr::ERR_IRQ,
        dmasr::IRQ_THRESHOLD_STS,
        dmasr::IRQ_DELAY_STS,
    ],
    source: "PG021, MM2S_DMASR",
};

const fn plain(name: &'static str, offset: u32, source: &'static str) -> Register {
    Register { name, offset, access: Access::ReadWrite, reset: 0, fields: &[], source }
}

/// Current descriptor, bits 31:6; writable only while halted with RS = 0.
pub const CURDESC: Register = plain("CURDESC", 0x08, "PG021, MM2S_CURDESC");
/// Current descriptor, address bits 63:32.
pub const CURDESC_MSB: Register = plain("CURDESC_MSB", 0x0C, "PG021, MM2S_CURDESC_MSB");
/// Tail descriptor, bits 31:6. With addresses of 32 bits or less the write is the doorbell.
pub const TAILDESC: Register = plain("TAILDESC", 0x10, "PG021, MM2S_TAILDESC");
/// Tail descriptor, address bits 63:32. With addresses above 32 bits the write is the doorbell.
pub const TAILDESC_MSB: Register = plain("TAILDESC_MSB", 0x14, "PG021, MM2S_TAILDESC_MSB");
/// Direct mode: source (SA) or destination (DA) address, bits 31:0.
pub const ADDRESS: Register = plain("SA/DA", 0x18, "PG021, MM2S_SA and S2MM_DA");
/// Direct mode: source or destination address, bits 63:32.
pub const ADDRESS_MSB: Register = plain("SA/DA_MSB", 0x1C, "PG021, MM2S_SA_MSB and S2MM_DA_MSB");
/// Direct mode: bytes to move, bits W-1:0; the write starts the transfer.
pub const LENGTH: Register = plain("LENGTH", 0x28, "PG021, MM2S_LENGTH");

/// Every register of one channel, by offset.
pub const CHANNEL_REGISTERS: [Register; 9] =
    [DMACR, DMASR, CURDESC, CURDESC_MSB, TAILDESC, TAILDESC_MSB, ADDRESS, ADDRESS_MSB, LENGTH];

/// Narrowest length register that can be built, bits.
pub const LENGTH_WIDTH_MIN: u32 = 8;
/// Widest length register that can be built, bits.
pub const LENGTH_WIDTH_MAX: u32 = 26;
