//! This file narrows rows to words of sixteen bits and widens them again.

use bitstream_model::interface::number::StreamFormat;
use bitstream_model::interface::record::{Beat, LANES, WORD_LANE};

use super::thesis16;
use crate::platform::{Lanes, Vectors, from_binary16};

/// A row in sixteen bits: half a beat.
pub(crate) type Row = [u16; LANES];

/// A format of sixteen bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sixteen {
    /// Binary16, rounded to nearest even.
    Binary16,
    /// The thesis', cut off.
    Thesis16,
}

impl Sixteen {
    /// The format of a stream, if its words have sixteen bits.
    pub(crate) const fn of(format: StreamFormat) -> Option<Self> {
        match format {
            StreamFormat::F32 => None,
            StreamFormat::Binary16 => Some(Self::Binary16),
            StreamFormat::Thesis16 => Some(Self::Thesis16),
        }
    }

    /// A record of f32 as one of this format. Where `integers` says so the word beside the vec3 is an
    /// unsigned integer, whose lower half is taken: what is more than that validation refuses.
    #[inline(always)]
    pub(crate) fn narrow<V: Vectors, const ROWS: usize>(
        self,
        vectors: V,
        record: [Lanes; ROWS],
        integers: &[bool; ROWS],
    ) -> [Row; ROWS] {
        let mut narrow = [Row::default(); ROWS];
        match self {
            Self::Binary16 => {
                // Contact points, the last rows, come in pairs.
                let (first, pairs) = record.as_rchunks::<2>();
                let (alone, integers) = integers.as_rchunks::<2>();
                let (to_first, to_pairs) = narrow.as_rchunks_mut::<2>();
                for ((to, row), integer) in to_first.iter_mut().zip(first).zip(alone) {
                    [*to, _] = vectors.to_binary16([*row, Lanes::all(0)], [*integer, false]);
                }
                for ((to, rows), integers) in to_pairs.iter_mut().zip(pairs).zip(integers) {
                    *to = vectors.to_binary16(*rows, *integers);
                }
            }
            Self::Thesis16 => {
                for ((to, row), integer) in narrow.iter_mut().zip(record).zip(integers) {
                    let words = row.words();
                    *to = words.map(thesis16::narrow);
                    if *integer {
                        #[expect(clippy::cast_possible_truncation, reason = "its lower half")]
                        let word = words[WORD_LANE] as u16;
                        to[WORD_LANE] = word;
                    }
                }
            }
        }
        narrow
    }

    /// Rows of f32 numbers from rows of this format. Many at once: how the machine converts is found
    /// out once a call.
    #[inline(always)]
    pub(crate) fn widen(self, rows: &[Row], wide: &mut [Beat]) {
        match self {
            Self::Binary16 => from_binary16(rows, bytemuck::cast_slice_mut(wide)),
            Self::Thesis16 => {
                for (to, from) in wide.iter_mut().zip(rows) {
                    *to = Beat(from.map(thesis16::widen));
                }
            }
        }
    }
}

/// The bits of the exponents of a row.
const EXPONENT: u16 = 0x7C00;

/// The bits of a record's exponents. `numbers` says which of its lanes are numbers.
///
/// Shape: `BEATS` beats hold `ROWS` rows.
pub(crate) const fn exponents<const ROWS: usize, const BEATS: usize>(
    numbers: &[[bool; LANES]; ROWS],
) -> [Beat; BEATS] {
    assert!(BEATS * 2 == ROWS, "two rows a beat");
    let mut beats = [Beat([0; LANES]); BEATS];
    let mut at = 0;
    while at < ROWS * LANES {
        if numbers[at / LANES][at % LANES] {
            beats[at / 8].0[at % 8 / 2] |= (EXPONENT as u32) << (at % 2 * 16);
        }
        at += 1;
    }
    beats
}

/// Whether all numbers of these records are finite: in neither format are those whose exponent is
/// all ones. Without a branch per number. `exponents` are the bits to look at ([`exponents`]).
///
/// Shape: whole records.
#[inline(always)]
pub(crate) fn finite<const BEATS: usize>(exponents: &[Beat; BEATS], beats: &[Beat]) -> bool {
    // One more than the largest exponent is a carry into the sign, which is not looked at.
    let one = Lanes::all(0x0400_0400);
    let mut carries = Lanes::all(0);
    for record in beats.as_chunks::<BEATS>().0 {
        for (beat, exponents) in record.iter().zip(exponents) {
            let exponents = Lanes::from(*beat).and(Lanes::from(*exponents));
            carries = carries.or(exponents.plus(one));
        }
    }
    carries.and(Lanes::all(0x8000_8000)).words() == [0; LANES]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::{Work, in_wide_vectors};

    fn narrowed_rows<const ROWS: usize>(
        format: Sixteen,
        rows: [Beat; ROWS],
        integers: [bool; ROWS],
    ) -> [Row; ROWS] {
        in_wide_vectors(Narrowing { format, record: rows.map(Lanes::from), integers })
    }

    struct Narrowing<const ROWS: usize> {
        format: Sixteen,
        record: [Lanes; ROWS],
        integers: [bool; ROWS],
    }

    impl<const ROWS: usize> Work for Narrowing<ROWS> {
        type Output = [Row; ROWS];

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> [Row; ROWS] {
            self.format.narrow(vectors, self.record, &self.integers)
        }
    }

    fn widened(format: Sixteen, row: Row) -> Beat {
        let mut wide = [Beat::default()];
        format.widen(&[row], &mut wide);
        wide[0]
    }

    fn narrowed(format: Sixteen, value: f32) -> u16 {
        narrowed_rows(format, [Beat([value.to_bits(); 4])], [false])[0][1]
    }

    #[test]
    fn formats_of_sixteen_bits_are_known_as_such() {
        assert_eq!(Sixteen::of(StreamFormat::F32), None);
        for format in StreamFormat::ALL {
            assert_eq!(Sixteen::of(format).is_some(), format.bits() == 16);
        }
    }

    #[test]
    fn integers_are_integers_in_either_format() {
        for format in [Sixteen::Binary16, Sixteen::Thesis16] {
            let row = Beat([0x3F80_0000, 0xC000_0000, 0x4248_0000, 0xABCD]);
            // 1, -2, 50 are exact in both.
            let expected = |integer| [0x3C00, 0xC000, 0x5240, if integer { 0xABCD } else { 0 }];
            let two = [true, false];
            assert_eq!(narrowed_rows(format, [row; 2], two), two.map(expected));
            let seven = [true, true, false, false, true, false, true];
            assert_eq!(narrowed_rows(format, [row; 7], seven), seven.map(expected));
        }
    }

    /// Every word comes back, and between two neighbours the nearer one is taken, the even one in
    /// the middle.
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
        for format in [Sixteen::Binary16, Sixteen::Thesis16] {
            for word in 0..=u16::MAX {
                assert_eq!(finite(format, word), word & 0x7C00 != 0x7C00, "{format:?} {word:#06x}");
            }
        }
    }
}
