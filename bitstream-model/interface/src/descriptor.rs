//! Layout of a scatter-gather descriptor (BD) in memory.
//!
//! ```text
//! 0x00 NXTDESC   0x04 NXTDESC_MSB   next descriptor, bits 31:6 and 63:32
//! 0x08 BUFFER    0x0C BUFFER_MSB    data address
//! 0x10, 0x14                        reserved, 0
//! 0x18 CONTROL                      length; EOF, SOF (MM2S)
//! 0x1C STATUS                       bytes moved; errors; Cmplted; RXEOF, RXSOF (S2MM)
//! 0x20 .. 0x30   APP0 .. APP4       control and status stream words (not used here)
//! 0x34 .. 0x3C                      free for software
//! ```
//!
//! Source: PG021, scatter-gather descriptor.

use super::register::{Access, Field};

/// A descriptor's length and alignment, bytes.
pub const BYTES: usize = 64;
/// A descriptor's length, 32-bit words.
pub const WORDS: usize = BYTES / 4;
/// Words that the engine fetches.
pub const FETCHED_WORDS: usize = 13;

/// Word index of NXTDESC.
pub const NXTDESC: usize = 0;
/// Word index of NXTDESC_MSB.
pub const NXTDESC_MSB: usize = 1;
/// Word index of the data address.
pub const BUFFER: usize = 2;
/// Word index of the data address' upper half.
pub const BUFFER_MSB: usize = 3;
/// Word index of CONTROL.
pub const CONTROL: usize = 6;
/// Word index of STATUS.
pub const STATUS: usize = 7;

/// Fields of CONTROL.
pub mod control {
    use super::{Access, Field};

    /// Bytes to move, or size of the buffer; limited to the length register's width.
    pub const LENGTH: Field = Field::bits("length", 0, 26, Access::ReadWrite);
    /// The packet ends with this descriptor (MM2S).
    pub const EOF: Field = Field::bit("EOF", 26, Access::ReadWrite);
    /// The packet starts with this descriptor (MM2S).
    pub const SOF: Field = Field::bit("SOF", 27, Access::ReadWrite);
}

/// Fields of STATUS.
pub mod status {
    use super::{Access, Field};

    /// Bytes moved.
    pub const TRANSFERRED: Field = Field::bits("transferred", 0, 26, Access::ReadWrite);
    /// The packet ended in this descriptor (S2MM).
    pub const RXEOF: Field = Field::bit("RXEOF", 26, Access::ReadWrite);
    /// The packet started in this descriptor (S2MM).
    pub const RXSOF: Field = Field::bit("RXSOF", 27, Access::ReadWrite);
    /// Internal error.
    pub const DMA_INT_ERR: Field = Field::bit("DMAIntErr", 28, Access::ReadWrite);
    /// Slave error.
    pub const DMA_SLV_ERR: Field = Field::bit("DMASlvErr", 29, Access::ReadWrite);
    /// Decode error.
    pub const DMA_DEC_ERR: Field = Field::bit("DMADecErr", 30, Access::ReadWrite);
    /// The descriptor is done; software clears it before the descriptor is used again.
    pub const CMPLTED: Field = Field::bit("Cmplted", 31, Access::ReadWrite);

    /// All error bits.
    pub const ERRORS: u32 = DMA_INT_ERR.mask() | DMA_SLV_ERR.mask() | DMA_DEC_ERR.mask();
}
