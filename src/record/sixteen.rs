//! This file narrows rows to words of sixteen bits and widens them again.

use bitstream_model::interface::number::StreamFormat;
use bitstream_model::interface::record::{LANES, WORD_LANE};

use super::{Record, Words, thesis16};
use crate::platform::{Lanes, Vectors};

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

    /// A record of f32 as one of this format. Of a word that is an unsigned integer the lower half is
    /// taken: what is more than that validation refuses.
    #[inline(always)]
    pub(crate) fn narrow<V: Vectors, const ROWS: usize>(
        self,
        vectors: V,
        record: Record<ROWS>,
        words: &Words<ROWS>,
    ) -> [Row; ROWS] {
        let integers = &words.integers;
        let mut narrow = [Row::default(); ROWS];
        match self {
            Self::Binary16 => {
                // Contact points, the last rows, come in pairs. So do bodies, whose indices go
                // beside what their rows became.
                let apart = words.bodies.filter(|at| (ROWS - at).is_multiple_of(2));
                let rows = if apart.is_some() { record.rows } else { record.whole(words) };
                let (first, pairs) = rows.as_rchunks::<2>();
                let (alone, integers) = integers.as_rchunks::<2>();
                let (to_first, to_pairs) = narrow.as_rchunks_mut::<2>();
                for ((to, row), integer) in to_first.iter_mut().zip(first).zip(alone) {
                    let rows = [*row, Lanes::all(0)];
                    [*to, _] = vectors.to_binary16(rows, last(rows), [*integer, false]);
                }
                for (at, ((to, rows), integers)) in
                    to_pairs.iter_mut().zip(pairs).zip(integers).enumerate()
                {
                    let of_bodies = apart == Some(ROWS % 2 + 2 * at);
                    let words = if of_bodies { record.bodies } else { last(*rows) };
                    *to = vectors.to_binary16(*rows, words, *integers);
                }
            }
            Self::Thesis16 => {
                for ((to, row), integer) in narrow.iter_mut().zip(record.whole(words)).zip(integers)
                {
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

    /// Two rows of this format in f32.
    #[inline(always)]
    pub(crate) fn widen<V: Vectors>(self, vectors: V, rows: [Row; 2]) -> [Lanes; 2] {
        match self {
            Self::Binary16 => vectors.to_f32(rows),
            Self::Thesis16 => rows.map(|row| Lanes::new(row.map(thesis16::widen))),
        }
    }
}

/// The last words of two rows, and two zeros.
#[inline(always)]
fn last([first, second]: [Lanes; 2]) -> Lanes {
    Lanes::new([first.words()[WORD_LANE], second.words()[WORD_LANE], 0, 0])
}

#[cfg(test)]
mod tests {
    use bitstream_model::interface::record::Beat;

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
            let words = Words { integers: self.integers, bodies: None };
            self.format.narrow(vectors, self.record.into(), &words)
        }
    }

    fn widened(format: Sixteen, row: Row) -> Beat {
        in_wide_vectors(Widening { format, row })
    }

    struct Widening {
        format: Sixteen,
        row: Row,
    }

    impl Work for Widening {
        type Output = Beat;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Beat {
            let [wide, _] = self.format.widen(vectors, [self.row, Row::default()]);
            wide.into()
        }
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

    /// Whether a pair of rows becomes beats together or not.
    #[test]
    fn indices_beside_a_record_come_where_they_would_stand_in_it() {
        struct Apart(Sixteen, Record<5>, usize);
        impl Work for Apart {
            type Output = [[Row; 5]; 2];

            #[inline(always)]
            fn run<V: Vectors>(self, vectors: V) -> [[Row; 5]; 2] {
                let Self(format, record, at) = self;
                let words = Words::of_collision([false; 5], at);
                let whole = record.whole(&words).into();
                let in_it = Words { bodies: None, ..words };
                [format.narrow(vectors, record, &words), format.narrow(vectors, whole, &in_it)]
            }
        }
        let row =
            |from: u32| Lanes::new([0, 1, 2, 3].map(|at| 0x3F80_1234 + 0x4_0000 * (from + at)));
        let record = Record {
            rows: [0, 10, 20, 30, 40].map(row),
            bodies: Lanes::new([0x0001_ABCD, 0x1234_5678, 7, 8]),
        };
        for format in [Sixteen::Binary16, Sixteen::Thesis16] {
            for at in 0..4 {
                let [apart, whole] = in_wide_vectors(Apart(format, record, at));
                assert_eq!(apart, whole, "{format:?} {at}");
                assert_eq!([apart[at][3], apart[at + 1][3]], [0xABCD, 0x5678], "{format:?} {at}");
            }
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
