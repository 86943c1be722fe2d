//! The word that a bitstream carries for its loader, USR_ACCESS: the rate of the PL clock 0 that
//! its logic is built for.
//!
//! ```text
//! 31            16 15             0
//! | 0x5047, "PG" | MHz             |
//! ```
//!
//! A packet that writes register 13, AXSS, has it in the file. A bitstream without the packet, or
//! with another upper half, says nothing.
//!
//! Source: UG570, "Configuration Registers"; the content is this project's.

/// The upper half of the word.
pub const MARK: u32 = 0x5047;
/// The rate of the PL clock 0 of `tools/vivado/build.tcl`, MHz: the input of the MMCM that makes
/// the accelerator's clock.
pub const PL_CLOCK_MHZ: u32 = 100;

/// The word for a rate, MHz.
#[must_use]
pub const fn word(pl_clock_mhz: u32) -> u32 {
    MARK << 16 | pl_clock_mhz & 0xFFFF
}

/// The rate that a word asks for, MHz.
#[must_use]
pub const fn pl_clock_mhz(word: u32) -> Option<u32> {
    match (word >> 16, word & 0xFFFF) {
        (MARK, mhz @ 1..) => Some(mhz),
        _ => None,
    }
}
