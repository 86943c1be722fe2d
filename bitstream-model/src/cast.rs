//! Conversions between integer widths, each with the reason why it loses nothing.

const _: () = assert!(usize::BITS == 64, "buffers and counts are 64 bits wide here");

/// Bits 31:0 of a register pair.
#[expect(clippy::cast_possible_truncation, reason = "cuts on purpose")]
pub(crate) const fn low(value: u64) -> u32 {
    value as u32
}

/// Bits 63:32 of a register pair.
pub(crate) const fn high(value: u64) -> u32 {
    low(value >> 32)
}

/// A count or offset as an index: lossless, `usize` has 64 bits.
#[expect(clippy::cast_possible_truncation, reason = "usize has 64 bits, asserted above")]
pub(crate) const fn index(value: u64) -> usize {
    value as usize
}

/// A number for a 32-bit register; one that does not fit reads as the largest.
pub(crate) fn register(value: impl TryInto<u32>) -> u32 {
    value.try_into().unwrap_or(u32::MAX)
}
