//! Narrows rows to words of binary16 and widens them again.

use super::Row;
use crate::simd::{Lanes, Narrow, Vectors};

/// Two rows of f32 as a beat, each number rounded to nearest even. An unsigned integer keeps its
/// lower half: validation refuses larger integers.
#[inline(always)]
pub(crate) fn narrow<V: Vectors>(vectors: V, rows: [Row; 2]) -> [Narrow; 2] {
    vectors.to_binary16(rows.map(|row| row.numbers), rows.map(|row| row.integer))
}

/// Two rows of a beat in f32.
#[inline(always)]
pub(crate) fn widen<V: Vectors>(vectors: V, rows: [Narrow; 2]) -> [Lanes; 2] {
    vectors.to_f32(rows)
}

#[cfg(test)]
mod tests {
    use pgs_interface::record::{Beat, LANES, WORD_LANE};

    use super::*;
    use crate::simd::{Integer, Work, in_wide_vectors};

    fn narrowed_pair(rows: [[u32; LANES]; 2], ends: [Option<usize>; 2]) -> [Narrow; 2] {
        in_wide_vectors(Narrowing { rows, ends })
    }

    /// Two rows, which may end in integers.
    struct Narrowing {
        rows: [[u32; LANES]; 2],
        /// Indices into [`INTEGERS`].
        ends: [Option<usize>; 2],
    }

    const INTEGERS: [u32; LANES] = [0x0001_ABCD, 0x1234_5678, 7, 0xFFFF_8000];

    impl Work for Narrowing {
        type Output = [Narrow; 2];

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> [Narrow; 2] {
            let words = Lanes::new(INTEGERS);
            let integer = |at: usize| {
                let each =
                    [Integer::new::<0>, Integer::new::<1>, Integer::new::<2>, Integer::new::<3>];
                each[at](words)
            };
            let row = |at: usize| Row {
                numbers: Lanes::new(self.rows[at]),
                integer: self.ends[at].map(integer),
            };
            narrow(vectors, [row(0), row(1)])
        }
    }

    fn widened(row: Narrow) -> Beat {
        in_wide_vectors(Widening(row))
    }

    struct Widening(Narrow);

    impl Work for Widening {
        type Output = Beat;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Beat {
            let [wide, _] = widen(vectors, [self.0, Narrow::default()]);
            wide.into()
        }
    }

    fn narrowed(value: f32) -> u16 {
        narrowed_pair([[value.to_bits(); LANES]; 2], [None; 2])[0][1]
    }

    #[test]
    fn integers_are_integers() {
        // 1, -2, 50 and 3, -4, 100 are exact.
        let rows = [[1.0, -2.0, 50.0, 1.0_f32], [3.0, -4.0, 100.0, -1.0]];
        let words = [[0x3C00, 0xC000, 0x5240, 0x3C00], [0x4200, 0xC400, 0x5640, 0xBC00]];
        let ends = || [None, Some(0), Some(1), Some(2), Some(3)];
        for (first, second) in ends().into_iter().flat_map(|one| ends().map(|other| (one, other))) {
            let mut expected = words;
            for (row, end) in expected.iter_mut().zip([first, second]) {
                if let Some(end) = end {
                    row[WORD_LANE] = [0xABCD, 0x5678, 7, 0x8000][end];
                }
            }
            let rows = rows.map(|row| row.map(f32::to_bits));
            assert_eq!(narrowed_pair(rows, [first, second]), expected);
        }
    }

    /// Every word comes back unchanged. A number between two words goes to the nearer one, and from
    /// the middle to the even one.
    #[test]
    fn binary16_is_rounded_to_nearest_even_over_its_whole_range() {
        for bits in 0..0x7BFF_u16 {
            let [low, high] = widened([bits, bits + 1, 0, 0])
                .0
                .first_chunk()
                .map(|[low, high]| [f32::from_bits(*low), f32::from_bits(*high)])
                .expect("four lanes");
            // Both have eleven significant bits, so that the middle is exact in f32.
            let middle = f32::midpoint(low, high);
            let even = if bits % 2 == 0 { bits } else { bits + 1 };
            for (value, expected) in [
                (low, bits),
                (middle.next_down(), bits),
                (middle, even),
                (middle.next_up(), bits + 1),
            ] {
                assert_eq!(narrowed(value), expected, "{value:e}");
                assert_eq!(narrowed(-value), expected | 0x8000, "-{value:e}");
            }
        }
        assert_eq!(narrowed(65_504.0), 0x7BFF);
        assert_eq!(narrowed(f32::INFINITY), 0x7C00);
    }

    #[test]
    fn what_is_not_finite_comes_back_as_such() {
        for word in 0..=u16::MAX {
            let finite = f32::from_bits(widened([word, 0, 0, 0]).0[0]).is_finite();
            assert_eq!(finite, word & 0x7C00 != 0x7C00, "{word:#06x}");
        }
    }
}
