//! Names the registers of a region, and decodes their values.

use std::fmt;

use pgs_interface::register::Register;
use pgs_interface::{address_map, axi_dma, control};

/// The kind of a register region, which names its registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RegisterMap {
    /// The AXI DMA of this number.
    Dma(usize),
    /// The accelerator's control block.
    Control,
}

impl fmt::Display for RegisterMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dma(core) => write!(f, "dma{core}"),
            Self::Control => f.write_str("control"),
        }
    }
}

impl RegisterMap {
    /// Physical address of the region by the address map, and its length in bytes.
    #[cfg(feature = "emulation")]
    pub(crate) fn place(self) -> (u64, u32) {
        match self {
            Self::Dma(core) => (address_map::dma_base(core), address_map::DMA_BYTES),
            Self::Control => (address_map::CONTROL_BASE, address_map::CONTROL_BYTES),
        }
    }

    /// Bytes that the driver may touch.
    pub(super) const fn bytes(self) -> u32 {
        match self {
            Self::Dma(_) => 2 * axi_dma::S2MM_OFFSET,
            Self::Control => address_map::CONTROL_BYTES,
        }
    }

    fn register(self, at: u32) -> Option<(&'static str, Register)> {
        let find =
            |rows: &[Register], offset| rows.iter().find(|row| row.offset == offset).copied();
        match self {
            Self::Control => find(control::REGISTERS, at).map(|row| ("", row)),
            Self::Dma(_) => match at.checked_sub(axi_dma::S2MM_OFFSET) {
                Some(offset) => find(&axi_dma::CHANNEL_REGISTERS, offset).map(|row| (" S2MM", row)),
                None => find(&axi_dma::CHANNEL_REGISTERS, at).map(|row| (" MM2S", row)),
            },
        }
    }
}

/// An access as the trace log shows it: `dma2 S2MM DMASR -> 0x00011002 Idle IOC_Irq ...`.
pub(crate) struct Decoded {
    pub(crate) map: RegisterMap,
    pub(crate) at: u32,
    pub(crate) arrow: &'static str,
    pub(crate) value: u32,
}

impl fmt::Display for Decoded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, at, arrow, value } = *self;
        let Some((half, row)) = map.register(at) else {
            return write!(f, "{map} {at:#05x} {arrow} {value:#010x}");
        };
        write!(f, "{map}{half} {} {arrow} {value:#010x}", row.name)?;
        fields(f, &row, value)
    }
}

/// Writes the set fields of a register: names of single bits, `name=value` of wider fields.
pub(crate) fn fields(f: &mut fmt::Formatter<'_>, row: &Register, value: u32) -> fmt::Result {
    for field in row.fields.iter().filter(|field| field.is_set(value)) {
        if field.width == 1 {
            write!(f, " {}", field.name)?;
        } else {
            write!(f, " {}={}", field.name, field.of(value))?;
        }
    }
    Ok(())
}
