//! Encodes and decodes one scatter-gather descriptor, and splits lengths into several.

use std::fmt;

use pgs_interface::descriptor::{self, control, status};

use crate::platform::BusAddress;

/// Alignment of the pieces of a split length, bytes: one DMA burst never straddles two.
const PIECE_ALIGNMENT: u32 = 64;

/// The longest piece that a length register of `width` bits (8 to 26) carries, bytes.
pub(crate) const fn largest_piece(width: u32) -> u32 {
    ((1 << width) - 1) & !(PIECE_ALIGNMENT - 1)
}

/// Splits `bytes` into pieces of at most `largest`: (offset, length), in order.
pub(crate) fn pieces(bytes: u64, largest: u32) -> impl Iterator<Item = (u64, u32)> {
    let step = usize::try_from(largest).unwrap_or(usize::MAX).max(1);
    (0..bytes).step_by(step).map(move |offset| {
        let length = u32::try_from(bytes - offset).unwrap_or(u32::MAX).min(largest);
        (offset, length)
    })
}

/// One transfer for the engine: a buffer, and its place in a packet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Descriptor {
    /// First byte.
    pub(crate) address: BusAddress,
    /// Number of bytes.
    pub(crate) bytes: u32,
    /// A packet starts here (MM2S).
    pub(crate) starts_packet: bool,
    /// A packet ends here (MM2S).
    pub(crate) ends_packet: bool,
}

impl Descriptor {
    /// The words that change from use to use: (index, value). STATUS is among them, as 0.
    pub(crate) fn words(&self) -> [(usize, u32); 4] {
        let word = control::LENGTH.put(0, self.bytes);
        let word = control::SOF.put(word, u32::from(self.starts_packet));
        let word = control::EOF.put(word, u32::from(self.ends_packet));
        [
            (descriptor::BUFFER, self.address.low()),
            (descriptor::BUFFER_MSB, self.address.high()),
            (descriptor::CONTROL, word),
            (descriptor::STATUS, 0),
        ]
    }
}

/// A descriptor's STATUS word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DescriptorStatus(pub(crate) u32);

impl DescriptorStatus {
    /// The word as it was read.
    #[must_use]
    pub fn raw(self) -> u32 {
        self.0
    }

    /// Whether the engine is done with the descriptor.
    #[must_use]
    pub fn complete(self) -> bool {
        status::CMPLTED.is_set(self.0)
    }

    /// Whether it failed.
    #[must_use]
    pub fn failed(self) -> bool {
        self.errors() != 0
    }

    /// The error bits that are set, in place.
    #[must_use]
    pub fn errors(self) -> u32 {
        self.0 & status::ERRORS
    }

    /// Whether a received packet ended here.
    #[must_use]
    pub fn packet_ended(self) -> bool {
        status::RXEOF.is_set(self.0)
    }

    /// Bytes moved.
    #[must_use]
    pub fn transferred(self) -> u32 {
        status::TRANSFERRED.of(self.0)
    }
}

impl fmt::Display for DescriptorStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.0)?;
        for field in [
            status::RXSOF,
            status::RXEOF,
            status::DMA_INT_ERR,
            status::DMA_SLV_ERR,
            status::DMA_DEC_ERR,
            status::CMPLTED,
        ] {
            if field.is_set(self.0) {
                write!(f, " {}", field.name)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_largest_pieces_are_those_of_the_reference() {
        let expected = [(8, 192), (14, 16_320), (16, 65_472), (23, 8_388_544), (26, 67_108_800)];
        for (width, bytes) in expected {
            assert_eq!(largest_piece(width), bytes);
        }
    }

    #[test]
    fn nothing_is_split_into_nothing() {
        assert_eq!(pieces(0, 192).count(), 0);
        assert_eq!(pieces(192, 192).collect::<Vec<_>>(), [(0, 192)]);
        assert_eq!(pieces(208, 192).collect::<Vec<_>>(), [(0, 192), (192, 16)]);
    }

    #[test]
    fn a_status_is_decoded_by_name() {
        let status = DescriptorStatus(0xC400_0040);
        assert!(status.complete() && status.failed() && status.packet_ended());
        assert_eq!(status.transferred(), 0x40);
        assert_eq!(status.to_string(), "0xc4000040 RXEOF DMADecErr Cmplted");
    }

    proptest! {
        #[test]
        fn pieces_cover_a_length_exactly(width in 8u32..=26, beats in 0u64..20_000) {
            let largest = largest_piece(width);
            prop_assert!(u64::from(largest) < 1 << width);
            let mut end = 0;
            let mut previous = None;
            for (offset, length) in pieces(beats * 16, largest) {
                prop_assert_eq!(offset, end);
                prop_assert!(length > 0 && length <= largest);
                // All but the last are whole bursts.
                prop_assert!(previous.is_none_or(|length| length % 64 == 0));
                previous = Some(length);
                end = offset + u64::from(length);
            }
            prop_assert_eq!(end, beats * 16);
        }
    }
}
