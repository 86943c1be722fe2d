//! The fence: the one address segment that every DMA master of a bitstream reaches. At any other
//! address its interconnect answers with a decode error.

use core::fmt;
use core::ops::Range;
use core::str::FromStr;

use super::address_map::{DDR_HIGH, DDR_LOW, GUARD_BYTES, MEMORY_BASE, MEMORY_BYTES};

/// Unit of the registers, bytes: the largest page of any kernel on this chip. 32 bits of it reach
/// beyond every address of a DMA core.
pub const FENCE_UNIT: u64 = 0x1_0000;

/// An address segment: a power of two of bytes, at a multiple of its length, inside the DDR.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fence {
    base: u64,
    bytes: u64,
}

impl Default for Fence {
    /// The memory that the device tree reserves.
    fn default() -> Self {
        Self { base: MEMORY_BASE, bytes: MEMORY_BYTES }
    }
}

impl Fence {
    /// The segment of `bytes` from `base` on; `None` if no interconnect can have it.
    #[must_use]
    pub fn new(base: u64, bytes: u64) -> Option<Self> {
        let end = base.checked_add(bytes)?;
        let whole = bytes.is_power_of_two() && bytes >= FENCE_UNIT && base.is_multiple_of(bytes);
        let in_ddr = [DDR_LOW, DDR_HIGH].iter().any(|ddr| ddr.start <= base && end <= ddr.end);
        (whole && in_ddr).then_some(Self { base, bytes })
    }

    /// Its first byte.
    #[must_use]
    pub const fn base(&self) -> u64 {
        self.base
    }

    /// Its length, bytes.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The byte behind its last one.
    #[must_use]
    pub const fn end(&self) -> u64 {
        self.base + self.bytes
    }

    /// Whether all of these bytes lie in it.
    #[must_use]
    pub fn contains(&self, address: u64, bytes: u64) -> bool {
        let end = address.checked_add(bytes);
        self.base <= address && end.is_some_and(|end| end <= self.end())
    }

    /// The guard behind it; `None` at the end of the DDR.
    #[must_use]
    pub fn guard(&self) -> Option<Range<u64>> {
        let guard = self.end()..self.end() + GUARD_BYTES;
        [DDR_LOW, DDR_HIGH].iter().any(|ddr| ddr.contains(&guard.start)).then_some(guard)
    }

    /// The values of `FENCE_BASE` and `FENCE_SIZE`.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "the DDR ends below 2^48")]
    pub fn to_registers(fence: Option<Self>) -> [u32; 2] {
        fence.map_or([0; 2], |fence| {
            [fence.base, fence.bytes].map(|bytes| (bytes / FENCE_UNIT) as u32)
        })
    }

    /// The fence that `FENCE_BASE` and `FENCE_SIZE` report.
    ///
    /// # Errors
    /// [`NoFence`] if they report a segment that no interconnect can have.
    pub fn from_registers([base, size]: [u32; 2]) -> Result<Option<Self>, NoFence> {
        if size == 0 {
            return Ok(None);
        }
        let [base, bytes] = [base, size].map(|units| u64::from(units) * FENCE_UNIT);
        Self::new(base, bytes).map(Some).ok_or(NoFence)
    }
}

/// A segment that no interconnect can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoFence;

impl fmt::Display for NoFence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "BASE+BYTES in the DDR, as 0x50000000+64M: a power of two of at least 64K, at a \
             multiple of it",
        )
    }
}

impl core::error::Error for NoFence {}

/// Suffixes of a length, the largest first.
const SUFFIXES: [(char, u32); 3] = [('G', 30), ('M', 20), ('K', 10)];

impl fmt::Display for Fence {
    /// As it is read: `0x50000000+64M`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let zeros = self.bytes.trailing_zeros();
        let unit = SUFFIXES.into_iter().find(|(_, bits)| zeros >= *bits);
        let (suffix, bits) = unit.unwrap_or(('K', 10));
        write!(f, "{:#x}+{}{suffix}", self.base, self.bytes >> bits)
    }
}

impl FromStr for Fence {
    type Err = NoFence;

    fn from_str(text: &str) -> Result<Self, NoFence> {
        let number = |text: &str| match text.strip_prefix("0x") {
            Some(digits) => u64::from_str_radix(digits, 16).ok(),
            None => text.parse().ok(),
        };
        let read = || {
            let (base, length) = text.split_once('+')?;
            let unit = SUFFIXES.into_iter().find(|(suffix, _)| length.ends_with(*suffix));
            let (digits, bits) = match unit {
                Some((suffix, bits)) => (length.strip_suffix(suffix)?, bits),
                None => (length, 0),
            };
            Self::new(number(base)?, number(digits)?.checked_mul(1 << bits)?)
        };
        read().ok_or(NoFence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fence_is_written_as_it_is_read() {
        for (text, base, bytes) in [
            ("0x50000000+64M", 0x5000_0000, 64 << 20),
            ("0x40000000+512M", 0x4000_0000, 512 << 20),
            ("0x800000000+2G", 0x8_0000_0000, 2 << 30),
            ("0x10000+64K", 0x1_0000, 64 << 10),
        ] {
            let fence: Fence = text.parse().expect(text);
            assert_eq!(
                (fence.base(), fence.bytes(), fence.to_string()),
                (base, bytes, text.into())
            );
            assert_eq!(Fence::from_registers(Fence::to_registers(Some(fence))), Ok(Some(fence)));
        }
        assert_eq!("1342177280+0x4000000".parse(), Ok(Fence::default()));
        assert_eq!(Fence::from_registers([0x5000, 0]), Ok(None));
    }

    #[test]
    fn what_no_interconnect_can_have_is_no_fence() {
        for text in [
            "",
            "0x50000000",
            "0x50000000+",
            "0x50000000+63M",
            "0x50000000+32K",
            // Not at a multiple of its length.
            "0x52000000+64M",
            // Across the end of the low DDR, in the logic, beyond all addresses.
            "0x0+4G",
            "0xa0000000+64K",
            "0x50000000+18446744073709551615G",
        ] {
            assert_eq!(text.parse::<Fence>(), Err(NoFence), "{text}");
        }
        assert_eq!(Fence::from_registers([0x5000, 3]), Err(NoFence));
        assert_eq!(Fence::from_registers([u32::MAX, u32::MAX]), Err(NoFence));
    }

    #[test]
    fn it_holds_whole_ranges_and_the_guard_begins_where_it_ends() {
        let fence = Fence::default();
        assert!(fence.contains(0x5000_0000, 64 << 20) && fence.contains(0x53FF_FFFF, 1));
        for (address, bytes) in
            [(0x4FFF_FFFF, 2), (0x53FF_FFFF, 2), (0x5400_0000, 1), (0x5000_0000, u64::MAX)]
        {
            assert!(!fence.contains(address, bytes), "{address:#x}");
        }
        assert_eq!(fence.guard(), Some(0x5400_0000..0x5401_0000));
        assert_eq!(Fence::new(0x7C00_0000, 64 << 20).expect("at the end").guard(), None);
    }
}
