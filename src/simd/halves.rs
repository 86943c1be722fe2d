//! Converts rows of numbers between f32 and binary16 with the conversion instructions of the
//! processor.
//!
//! The crate `half` knows the instructions, too. On aarch64 it uses them only with an extension
//! that a Cortex-A53 lacks, although that processor has the conversions: there it computes with
//! integers. On processors without conversion instructions, this module uses the integer code of
//! `half`.
#![allow(
    unsafe_code,
    reason = "not every processor has the instructions, vectors are cast, and one is made opaque"
)]

#[cfg(any(test, not(target_arch = "aarch64")))]
use half::f16;
use pgs_interface::record::{LANES, WORD_LANE};

use super::lanes::{Integer, Lanes};

/// Rounds the numbers of two rows to binary16, to nearest even. A row with an integer ends in the
/// integer's lower half.
#[inline(always)]
pub(crate) fn to_binary16(rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2] {
    let [first, second] = rows.map(Lanes::words);
    let [of_first, of_second] = integers;
    [row(first, of_first), row(second, of_second)]
}

/// One row.
#[inline(always)]
fn row(from: Wide, integer: Option<Integer>) -> Narrow {
    #[cfg(target_arch = "aarch64")]
    let mut to = aarch64::to_binary16(&from);
    #[cfg(not(target_arch = "aarch64"))]
    let mut to = from.map(|bits| f16::from_f32_const(f32::from_bits(bits)).to_bits());
    if let Some(integer) = integer {
        to[WORD_LANE] = integer.low();
    }
    to
}

/// The numbers of two rows of binary16, in f32.
#[inline(always)]
pub(crate) fn to_f32(rows: [Narrow; 2]) -> [Lanes; 2] {
    #[cfg(target_arch = "aarch64")]
    let wide = rows.map(aarch64::to_f32);
    #[cfg(not(target_arch = "aarch64"))]
    let wide = rows.map(|row| row.map(|bits| f16::from_bits(bits).to_f32_const().to_bits()));
    wide.map(Lanes::new)
}

/// A row of words of 32 bits.
type Wide = [u32; LANES];
/// A row of words of sixteen bits: half a beat.
pub(crate) type Narrow = [u16; LANES];

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use core::arch::asm;
    use core::arch::x86_64::{
        __m128i, _MM_FROUND_TO_NEAREST_INT, _mm_blend_epi16, _mm_or_si128, _mm_shuffle_epi8,
        _mm256_castsi256_ps, _mm256_cvtph_ps, _mm256_cvtps_ph, _mm256_set_m128i,
    };

    use super::{Integer, LANES, Lanes, Narrow, WORD_LANE};

    /// As [`to_binary16`](super::to_binary16).
    ///
    /// The code of all four cases is too long for the compiler to inline by itself, so inlining is
    /// forced. One or two instructions per case remain in the loop.
    ///
    /// # Safety
    /// The processor has AVX2 and F16C.
    #[inline(always)]
    pub(crate) unsafe fn to_binary16(
        rows: [Lanes; 2],
        integers: [Option<Integer>; 2],
    ) -> [Narrow; 2] {
        const { assert!(WORD_LANE == 3 && LANES == 4, "so the blends are written") };
        const FIRST: usize = WORD_LANE;
        const SECOND: usize = LANES + WORD_LANE;
        let [first, second] = integers;
        let first = first.map(half::<FIRST>);
        let second = second.map(half::<SECOND>);
        // SAFETY: `numbers` needs AVX2 and F16C, which the caller promises. It computes in
        // registers.
        let numbers = unsafe { numbers(rows) };
        // In a row with an integer, the last number is discarded.
        bytemuck::cast(match (first, second) {
            (None, None) => numbers,
            // SAFETY: `beside` needs AVX2, which the caller promises. It computes in registers.
            (Some(first), None) => unsafe { beside::<{ 1 << FIRST }>(numbers, first) },
            // SAFETY: `beside` needs AVX2, which the caller promises. It computes in registers.
            (None, Some(second)) => unsafe { beside::<{ 1 << SECOND }>(numbers, second) },
            // SAFETY: `beside_both` needs AVX2, which the caller promises. It computes in
            // registers.
            (Some(first), Some(second)) => unsafe {
                beside_both::<{ 1 << FIRST | 1 << SECOND }>(numbers, first, second)
            },
        })
    }

    /// The rows as numbers of binary16.
    #[target_feature(enable = "avx2,f16c")]
    #[inline]
    fn numbers([first, second]: [Lanes; 2]) -> __m128i {
        let both = _mm256_castsi256_ps(_mm256_set_m128i(second.0, first.0));
        computed_once(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(both))
    }

    /// Bytes, and for each byte of the shuffled result its index in them. An index above 127 gives
    /// zero.
    type Shuffle = (__m128i, [u8; 16]);

    /// The lower half of an integer as half `TO` of eight, beside zeros.
    #[inline(always)]
    fn half<const TO: usize>(Integer { words, at }: Integer) -> Shuffle {
        let mut from = [u8::MAX; 16];
        [from[2 * TO], from[2 * TO + 1]] = [[0, 1], [4, 5], [8, 9], [12, 13]][at];
        (words.0, from)
    }

    /// The halves of an integer where `OTHERS` has a bit, and of `numbers` elsewhere.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn beside<const OTHERS: i32>(numbers: __m128i, (words, from): Shuffle) -> __m128i {
        _mm_blend_epi16::<OTHERS>(numbers, _mm_shuffle_epi8(words, bytemuck::cast(from)))
    }

    /// [`beside`] for two integers.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn beside_both<const OTHERS: i32>(
        numbers: __m128i,
        (first, from_first): Shuffle,
        (second, from_second): Shuffle,
    ) -> __m128i {
        let first = _mm_shuffle_epi8(first, bytemuck::cast(from_first));
        let second = _mm_shuffle_epi8(second, bytemuck::cast(from_second));
        _mm_blend_epi16::<OTHERS>(numbers, _mm_or_si128(first, second))
    }

    /// Returns the vector, opaque to the compiler. Otherwise, the compiler converts a result that
    /// is stored and used once for each, and a conversion to memory takes twice as long.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn computed_once(mut vector: __m128i) -> __m128i {
        // SAFETY: the template is a comment: no instruction is run. So the register keeps its
        // value, and there is no memory, stack or flag that the options could be wrong about.
        unsafe {
            asm!("/* {0} */", inout(xmm_reg) vector, options(pure, nomem, nostack, preserves_flags));
        }
        vector
    }

    /// As [`to_f32`](super::to_f32).
    #[target_feature(enable = "avx2,f16c")]
    #[inline]
    pub(crate) fn to_f32(rows: [Narrow; 2]) -> [Lanes; 2] {
        let wide: [__m128i; 2] = bytemuck::cast(_mm256_cvtph_ps(bytemuck::cast(rows)));
        wide.map(Lanes)
    }
}

#[cfg(target_arch = "aarch64")]
mod aarch64 {
    use core::arch::aarch64::{float16x4_t, float32x4_t, vcvt_f16_f32, vcvt_f32_f16};

    use super::{Narrow, Wide};

    #[inline(always)]
    pub(crate) fn to_binary16(from: &Wide) -> Narrow {
        // SAFETY: the vector is four f32, of any bits.
        let wide = unsafe { std::mem::transmute::<Wide, float32x4_t>(*from) };
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let narrow = unsafe { vcvt_f16_f32(wide) };
        // SAFETY: the vector is four words of sixteen bits.
        unsafe { std::mem::transmute::<float16x4_t, Narrow>(narrow) }
    }

    #[inline(always)]
    pub(crate) fn to_f32(from: Narrow) -> Wide {
        // SAFETY: both are four words of sixteen bits, eight bytes, and the vector may hold any
        // bits.
        let narrow = unsafe { std::mem::transmute::<Narrow, float16x4_t>(from) };
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let wide = unsafe { vcvt_f32_f16(narrow) };
        // SAFETY: both are four words of 32 bits, sixteen bytes, and the words of `Wide` may hold
        // any bits.
        unsafe { std::mem::transmute::<float32x4_t, Wide>(wide) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::vectors::{Vectors, Work, in_wide_vectors};
    use super::*;
    use pgs_support::chunks::Chunks;

    /// Numbers around every rounding border of binary16, and others.
    fn wide() -> Vec<f32> {
        let mut all = vec![f32::MIN_POSITIVE, f32::from_bits(1), 65_519.9, 65_520.0, f32::MAX];
        for word in 0..0x7C00 {
            let low = f16::from_bits(word).to_f32_const();
            let high = f16::from_bits(word + 1).to_f32_const();
            let middle = if high.is_finite() { f32::midpoint(low, high) } else { 65_520.0 };
            all.extend([low, middle.next_down(), middle, middle.next_up()]);
        }
        all.push(f32::INFINITY);
        all.extend([0x7F80_0001, 0x7FC0_0000, 0x7FFF_FFFF, 0x7FA0_2000].map(f32::from_bits));
        all.iter().flat_map(|number| [*number, -*number]).collect()
    }

    /// The integers at the ends of two rows: four words and the index of one, or `None`.
    type Ends = [Option<([u32; LANES], usize)>; 2];

    fn lanes(ends: Ends) -> [Option<Integer>; 2] {
        ends.map(|end| end.map(|(words, at)| Integer { words: Lanes::new(words), at }))
    }

    /// Rounds pairs of rows in the vectors of a loop.
    struct Rounding<'a>(&'a [[Wide; 2]], Ends);

    impl Work for Rounding<'_> {
        type Output = Vec<[Narrow; 2]>;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Vec<[Narrow; 2]> {
            let Self(pairs, ends) = self;
            let narrow = |rows: &[Wide; 2]| vectors.to_binary16(rows.map(Lanes::new), lanes(ends));
            pairs.iter().map(narrow).collect()
        }
    }

    /// Runs in the widest vectors and in the baseline, with and without integers.
    #[test]
    fn numbers_are_rounded_as_by_integers_and_integers_are_cut() {
        let mut wide: Vec<u32> = wide().into_iter().map(f32::to_bits).collect();
        wide.resize(wide.len().next_multiple_of(2 * LANES), 0);
        let pairs = wide.split_arrays::<LANES>().0.split_arrays::<2>().0;
        let words = [0x1234_5678, 0x9ABC_DEF0, 0x0FED_CBA9, 0x8765_4321];
        let any = |words| (0..LANES).map(move |at| Some((words, at))).chain([None]);
        let ends = any(words).flat_map(|first| {
            // The second integer is from the same words or from others.
            let others = words.map(u32::reverse_bits);
            any(words).chain(any(others)).map(move |second| [first, second])
        });
        for ends in ends {
            let anywhere = pairs.iter().map(|rows| to_binary16(rows.map(Lanes::new), lanes(ends)));
            let here = in_wide_vectors(Rounding(pairs, ends));
            assert_eq!(here.len(), pairs.len());
            for ((here, anywhere), rows) in here.into_iter().zip(anywhere).zip(pairs) {
                for (place, (wide, end)) in rows.iter().zip(ends).enumerate() {
                    let number = |bits| f16::from_f32_const(f32::from_bits(bits)).to_bits();
                    let mut expected = wide.map(number);
                    if let Some((words, at)) = end {
                        expected[WORD_LANE] =
                            u16::try_from(words[at] & 0xFFFF).expect("sixteen bits");
                    }
                    assert_eq!(here[place], expected, "{wide:x?}, {end:x?}");
                    assert_eq!(anywhere[place], expected, "{wide:x?}, {end:x?}");
                }
            }
        }
    }

    /// Widens rows of binary16 in the vectors of a loop.
    struct Widening<'a>(&'a [[Narrow; 2]]);

    impl Work for Widening<'_> {
        type Output = Vec<[Wide; 2]>;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Vec<[Wide; 2]> {
            let Self(pairs) = self;
            pairs.iter().map(|rows| vectors.to_f32(*rows).map(Lanes::words)).collect()
        }
    }

    #[test]
    fn every_word_is_widened_as_by_integers() {
        let words: Vec<u16> = (0..=u16::MAX).collect();
        let pairs = words.split_arrays::<LANES>().0.split_arrays::<2>().0;
        let anywhere = pairs.iter().map(|rows| to_f32(*rows).map(Lanes::words));
        let here = in_wide_vectors(Widening(pairs));
        assert_eq!(here.len(), pairs.len());
        for ((here, anywhere), narrow) in here.into_iter().zip(anywhere).zip(pairs) {
            let number = |bits| f16::from_bits(bits).to_f32_const().to_bits();
            let expected = narrow.map(|row| row.map(number));
            assert_eq!(here, expected, "{narrow:#06x?}");
            assert_eq!(anywhere, expected, "{narrow:#06x?}");
        }
    }
}
