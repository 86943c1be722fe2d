//! Narrows rows to words of sixteen bits and widens them again.

use pgs_interface::number::StreamFormat;
use pgs_interface::record::WORD_LANE;

use super::{Row, thesis16};
use crate::simd::{Integer, Lanes, Narrow, Vectors};

/// A format of sixteen bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sixteen {
    /// Binary16, rounded to nearest even.
    Binary16,
    /// The thesis' format, truncated.
    Thesis16,
    /// The thesis' format with its encoder taken literally.
    Thesis16Literal,
}

/// [`Sixteen::narrow`] for the thesis' formats. Its code goes word by word and is too long to inline
/// into every loop.
#[inline(never)]
fn cut<const LITERAL: bool>(numbers: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2] {
    let word = if LITERAL { thesis16::narrow_literal } else { thesis16::narrow };
    let mut narrow = numbers.map(|row| row.words().map(word));
    for (to, integer) in narrow.iter_mut().zip(integers) {
        if let Some(integer) = integer {
            to[WORD_LANE] = integer.low();
        }
    }
    narrow
}

impl Sixteen {
    /// The format of a stream, if its words have sixteen bits.
    pub(crate) const fn of(format: StreamFormat) -> Option<Self> {
        match format {
            StreamFormat::F32 => None,
            StreamFormat::Binary16 => Some(Self::Binary16),
            StreamFormat::Thesis16 => Some(Self::Thesis16),
            StreamFormat::Thesis16Literal => Some(Self::Thesis16Literal),
        }
    }

    /// Two rows of f32 as a beat of this format. An unsigned integer keeps its lower half:
    /// validation refuses larger integers.
    #[inline(always)]
    pub(crate) fn narrow<V: Vectors>(self, vectors: V, rows: [Row; 2]) -> [Narrow; 2] {
        let numbers = rows.map(|row| row.numbers);
        let integers = rows.map(|row| row.integer);
        match self {
            Self::Binary16 => vectors.to_binary16(numbers, integers),
            Self::Thesis16 => cut::<false>(numbers, integers),
            Self::Thesis16Literal => cut::<true>(numbers, integers),
        }
    }

    /// Two rows of this format in f32.
    #[inline(always)]
    pub(crate) fn widen<V: Vectors>(self, vectors: V, rows: [Narrow; 2]) -> [Lanes; 2] {
        match self {
            Self::Binary16 => vectors.to_f32(rows),
            Self::Thesis16 | Self::Thesis16Literal => {
                rows.map(|row| Lanes::new(row.map(thesis16::widen)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::record::{Beat, LANES};

    use super::*;
    use crate::simd::{Work, in_wide_vectors};

    const ALL: [Sixteen; 3] = [Sixteen::Binary16, Sixteen::Thesis16, Sixteen::Thesis16Literal];

    fn narrowed_pair(
        format: Sixteen,
        rows: [[u32; LANES]; 2],
        ends: [Option<usize>; 2],
    ) -> [Narrow; 2] {
        in_wide_vectors(Narrowing { format, rows, ends })
    }

    /// Two rows, which may end in integers.
    struct Narrowing {
        format: Sixteen,
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
            self.format.narrow(vectors, [row(0), row(1)])
        }
    }

    fn widened(format: Sixteen, row: Narrow) -> Beat {
        in_wide_vectors(Widening { format, row })
    }

    struct Widening {
        format: Sixteen,
        row: Narrow,
    }

    impl Work for Widening {
        type Output = Beat;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Beat {
            let [wide, _] = self.format.widen(vectors, [self.row, Narrow::default()]);
            wide.into()
        }
    }

    fn narrowed(format: Sixteen, value: f32) -> u16 {
        narrowed_pair(format, [[value.to_bits(); LANES]; 2], [None; 2])[0][1]
    }

    #[test]
    fn formats_of_sixteen_bits_are_known_as_such() {
        assert_eq!(Sixteen::of(StreamFormat::F32), None);
        for format in StreamFormat::ALL {
            assert_eq!(Sixteen::of(format).is_some(), format.bits() == 16);
        }
    }

    #[test]
    fn integers_are_integers_in_every_format() {
        for format in ALL {
            // 1, -2, 50 and 3, -4, 100 are exact in all.
            let rows = [[1.0, -2.0, 50.0, 1.0_f32], [3.0, -4.0, 100.0, -1.0]];
            let words = [[0x3C00, 0xC000, 0x5240, 0x3C00], [0x4200, 0xC400, 0x5640, 0xBC00]];
            let ends = || [None, Some(0), Some(1), Some(2), Some(3)];
            for (first, second) in
                ends().into_iter().flat_map(|one| ends().map(|other| (one, other)))
            {
                let mut expected = words;
                for (row, end) in expected.iter_mut().zip([first, second]) {
                    if let Some(end) = end {
                        row[WORD_LANE] = [0xABCD, 0x5678, 7, 0x8000][end];
                    }
                }
                let rows = rows.map(|row| row.map(f32::to_bits));
                assert_eq!(narrowed_pair(format, rows, [first, second]), expected, "{format:?}");
            }
        }
    }

    /// Every word comes back unchanged. A number between two words goes to the nearer one, and from
    /// the middle to the even one.
    #[test]
    fn binary16_is_rounded_to_nearest_even_over_its_whole_range() {
        for bits in 0..0x7BFF_u16 {
            let [low, high] = widened(Sixteen::Binary16, [bits, bits + 1, 0, 0])
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
                assert_eq!(narrowed(Sixteen::Binary16, value), expected, "{value:e}");
                assert_eq!(narrowed(Sixteen::Binary16, -value), expected | 0x8000, "-{value:e}");
            }
        }
        assert_eq!(narrowed(Sixteen::Binary16, 65_504.0), 0x7BFF);
        assert_eq!(narrowed(Sixteen::Binary16, f32::INFINITY), 0x7C00);
    }

    #[test]
    fn what_is_not_finite_comes_back_as_such() {
        let finite = |format: Sixteen, word: u16| {
            f32::from_bits(widened(format, [word, 0, 0, 0]).0[0]).is_finite()
        };
        for format in ALL {
            for word in 0..=u16::MAX {
                assert_eq!(finite(format, word), word & 0x7C00 != 0x7C00, "{format:?} {word:#06x}");
            }
        }
    }
}
