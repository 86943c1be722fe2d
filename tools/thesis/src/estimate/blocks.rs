//! Counts block RAMs of 18 Kib by the shapes that they can take.
//!
//! An array of rows is built of blocks side by side for its width and one after the other for its
//! depth; the unused rest of a block is lost. In true dual-port mode both ports read and write; a
//! block that is 36 bits wide has one port to read and one to write (simple dual port).
//!
//! Source: UG573, block RAM port widths; UG974, RAMB18E2.

/// Bits of a block, parity bits included: they hold data where the width is a multiple of 9.
pub const BLOCK_BITS: u64 = 18_432;
/// Blocks of the XCZU9EG.
pub const BLOCKS: u64 = 1_824;

/// A shape of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockShape {
    /// Rows.
    pub rows: u64,
    /// Bits of a row.
    pub bits: u64,
}

/// Shapes in which both ports read and write.
const TRUE_DUAL_PORT: [BlockShape; 5] = [
    BlockShape { rows: 1024, bits: 18 },
    BlockShape { rows: 2048, bits: 9 },
    BlockShape { rows: 4096, bits: 4 },
    BlockShape { rows: 8192, bits: 2 },
    BlockShape { rows: 16_384, bits: 1 },
];
/// The shape with one port to read and one to write.
const SIMPLE_DUAL_PORT: BlockShape = BlockShape { rows: 512, bits: 36 };

impl BlockShape {
    /// Blocks of this shape that an array takes.
    #[must_use]
    pub fn blocks(self, rows: u64, bits: u64) -> u64 {
        rows.div_ceil(self.rows).saturating_mul(bits.div_ceil(self.bits))
    }
}

/// Blocks that an array takes in one shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShapedBlocks {
    /// The shape.
    pub shape: BlockShape,
    /// Number of blocks.
    pub blocks: u64,
}

impl ShapedBlocks {
    /// The shape with the fewest blocks for an array.
    ///
    /// If `simple`, one port to read and one to write are enough.
    pub(crate) fn fewest(rows: u64, bits: u64, simple: bool) -> Self {
        let wide = simple.then_some(SIMPLE_DUAL_PORT);
        let [first, others @ ..] = TRUE_DUAL_PORT;
        let of = |shape: BlockShape| Self { shape, blocks: shape.blocks(rows, bits) };
        others
            .into_iter()
            .chain(wide)
            .map(of)
            .fold(of(first), |best, next| if next.blocks < best.blocks { next } else { best })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_device_has_the_thesis_4_mib() {
        let mib = (BLOCKS * BLOCK_BITS) as f64 / 8.0 / f64::from(1 << 20);
        assert!((mib - 4.0).abs() < 0.01, "{mib}");
        for shape in TRUE_DUAL_PORT.into_iter().chain([SIMPLE_DUAL_PORT]) {
            // Narrow rows cannot use the parity bits.
            let bits = shape.rows * shape.bits;
            assert!(bits == BLOCK_BITS || bits == BLOCK_BITS / 9 * 8, "{shape:?}");
        }
    }

    #[test]
    fn blocks_go_by_width_and_depth() {
        let blocks = |rows, bits, simple| {
            let shaped = ShapedBlocks::fewest(rows, bits, simple);
            (shaped.blocks, shaped.shape.rows, shaped.shape.bits)
        };
        assert_eq!(blocks(1024, 18, false), (1, 1024, 18));
        assert_eq!(blocks(1025, 18, false), (2, 1024, 18));
        assert_eq!(blocks(512, 36, true), (1, 512, 36));
        assert_eq!(blocks(512, 36, false), (2, 1024, 18));
        assert_eq!(blocks(16_384, 1, false), (1, 16_384, 1));
        assert_eq!(blocks(0, 192, false).0, 0);
        // Float's velocities: 38 x 11; half's: 19 x 11 in rows of 9 bits.
        assert_eq!(blocks(38_880, 192, false), (418, 1024, 18));
        assert_eq!(blocks(38_880, 96, false), (209, 2048, 9));
    }
}
