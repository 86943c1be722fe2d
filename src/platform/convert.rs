//! This file converts rows of numbers between f32 and binary16 by the processor's instructions.
//!
//! `half` knows them, too, but one call converts eight numbers at most, and on aarch64 it wants more
//! than every processor has: on a Cortex-A53, whose instructions these are, it would compute with
//! integers. It does what is left over, and everything where there are no such instructions.
#![allow(unsafe_code, reason = "not every processor has the instructions, and vectors are cast")]

use bitstream_model::interface::record::{LANES, WORD_LANE};
use half::f16;
use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};

use super::lanes::Lanes;

/// Rounds the numbers of two rows to binary16, to nearest even. Where `integers` says so the last word
/// of a row is an unsigned integer, whose lower half is taken.
#[inline(always)]
pub(super) fn to_binary16(rows: [Lanes; 2], integers: [bool; 2]) -> [Narrow; 2] {
    let [first, second] = rows.map(Lanes::words);
    [row(first, integers[0]), row(second, integers[1])]
}

/// One row.
#[inline(always)]
fn row(from: Wide, integer: bool) -> Narrow {
    #[cfg(target_arch = "aarch64")]
    let mut to = aarch64::to_binary16(&from);
    #[cfg(not(target_arch = "aarch64"))]
    let mut to = from.map(|bits| f16::from_f32_const(f32::from_bits(bits)).to_bits());
    if integer {
        let [low, high, ..] = from[WORD_LANE].to_le_bytes();
        to[WORD_LANE] = u16::from_le_bytes([low, high]);
    }
    to
}

/// Numbers from binary16.
///
/// Shape: as many rows of either.
#[inline]
pub(crate) fn from_binary16(from: &[Narrow], to: &mut [[f32; LANES]]) {
    #[cfg(target_arch = "x86_64")]
    let (from, to) = match x86::there() {
        // SAFETY: the processor has the instructions that the function is compiled for, and the system
        // keeps their registers.
        true => unsafe { x86::from_binary16(from, to) },
        false => (from, to),
    };
    #[cfg(target_arch = "aarch64")]
    let (from, to) = aarch64::from_binary16(from, to);
    if !from.is_empty() {
        let from: &[f16] = from.as_flattened().reinterpret_cast();
        from.convert_to_f32_slice(to.as_flattened_mut());
    }
}

/// A row of words of 32 bits.
type Wide = [u32; LANES];
/// A row of words of sixteen bits.
type Narrow = [u16; LANES];

/// What is left to do.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
type Rest<'a, From, To> = (&'a [[From; LANES]], &'a mut [[To; LANES]]);

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use core::arch::x86_64::{
        __m128i, _MM_FROUND_TO_NEAREST_INT, _mm_blend_epi16, _mm_setr_epi8, _mm_shuffle_epi8,
        _mm_unpackhi_epi32, _mm256_castsi256_ps, _mm256_cvtph_ps, _mm256_cvtps_ph,
        _mm256_set_m128i,
    };

    use super::{LANES, Lanes, Narrow, Rest, WORD_LANE};

    /// Whether the processor has the instructions. They take the registers of AVX, which a system may
    /// not keep, and whether it does is asked of AVX alone.
    #[inline]
    pub(super) fn there() -> bool {
        std::arch::is_x86_feature_detected!("avx") && std::arch::is_x86_feature_detected!("f16c")
    }

    /// As [`to_binary16`](super::to_binary16).
    #[target_feature(enable = "avx2,f16c")]
    #[inline]
    pub(in super::super) fn to_binary16(
        [first, second]: [Lanes; 2],
        integers: [bool; 2],
    ) -> [Narrow; 2] {
        const { assert!(WORD_LANE == 3 && LANES == 4, "so the bytes are counted") };
        let both = _mm256_castsi256_ps(_mm256_set_m128i(second.0, first.0));
        let numbers = _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(both);
        // The lower halves of the last words, where the integers belong: what became of these as
        // numbers is nothing.
        let last = _mm_unpackhi_epi32(first.0, second.0);
        let places = _mm_setr_epi8(-1, -1, -1, -1, -1, -1, 8, 9, -1, -1, -1, -1, -1, -1, 12, 13);
        let last = _mm_shuffle_epi8(last, places);
        bytemuck::cast(match integers {
            [false, false] => numbers,
            [true, false] => _mm_blend_epi16::<0b0000_1000>(numbers, last),
            [false, true] => _mm_blend_epi16::<0b1000_0000>(numbers, last),
            [true, true] => _mm_blend_epi16::<0b1000_1000>(numbers, last),
        })
    }

    #[target_feature(enable = "f16c")]
    pub(super) fn from_binary16<'a>(
        from: &'a [[u16; LANES]],
        to: &'a mut [[f32; LANES]],
    ) -> Rest<'a, u16, f32> {
        let (pairs, rest) = from.as_chunks::<2>();
        let (to_pairs, to_rest) = to.as_chunks_mut::<2>();
        for (from, to) in pairs.iter().zip(to_pairs) {
            let narrow: __m128i = bytemuck::cast(*from);
            *to = bytemuck::cast(_mm256_cvtph_ps(narrow));
        }
        (rest, to_rest)
    }
}

#[cfg(target_arch = "aarch64")]
mod aarch64 {
    use core::arch::aarch64::{float16x4_t, float32x4_t, vcvt_f16_f32, vcvt_f32_f16};

    use super::{LANES, Narrow, Rest, Wide};

    #[inline(always)]
    pub(super) fn to_binary16(from: &Wide) -> Narrow {
        // SAFETY: the vector is four f32, of any bits.
        let wide = unsafe { std::mem::transmute::<Wide, float32x4_t>(*from) };
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let narrow = unsafe { vcvt_f16_f32(wide) };
        // SAFETY: the vector is four words of sixteen bits.
        unsafe { std::mem::transmute::<float16x4_t, Narrow>(narrow) }
    }

    pub(super) fn from_binary16<'a>(
        from: &'a [[u16; LANES]],
        to: &'a mut [[f32; LANES]],
    ) -> Rest<'a, u16, f32> {
        for (from, to) in from.iter().zip(&mut *to) {
            // SAFETY: the vector is four words of sixteen bits, of any bits.
            let narrow = unsafe { std::mem::transmute::<[u16; LANES], float16x4_t>(*from) };
            // SAFETY: every aarch64 that Linux runs on has the instruction.
            let wide = unsafe { vcvt_f32_f16(narrow) };
            // SAFETY: the vector is four f32.
            *to = unsafe { std::mem::transmute::<float32x4_t, [f32; LANES]>(wide) };
        }
        (&[], &mut [])
    }
}

#[cfg(test)]
mod tests {
    use super::super::vectors::{Vectors, Work, in_wide_vectors};
    use super::*;

    /// Numbers around every border of binary16, and others.
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

    /// Pairs of rows through the vectors of a loop.
    struct Rounding<'a>(&'a [[Wide; 2]], [bool; 2]);

    impl Work for Rounding<'_> {
        type Output = Vec<[Narrow; 2]>;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> Vec<[Narrow; 2]> {
            let Self(pairs, integers) = self;
            pairs.iter().map(|rows| vectors.to_binary16(rows.map(Lanes::new), integers)).collect()
        }
    }

    /// In the widest vectors and in those that every processor has, integers beside them or not.
    #[test]
    fn numbers_are_rounded_as_by_integers_and_integers_are_cut() {
        let mut wide: Vec<u32> = wide().into_iter().map(f32::to_bits).collect();
        wide.resize(wide.len().next_multiple_of(2 * LANES), 0);
        let pairs = wide.as_chunks::<LANES>().0.as_chunks::<2>().0;
        for integers in [[false, false], [true, false], [false, true], [true, true]] {
            let anywhere = pairs.iter().map(|rows| to_binary16(rows.map(Lanes::new), integers));
            let here = in_wide_vectors(Rounding(pairs, integers));
            assert_eq!(here.len(), pairs.len());
            for ((here, anywhere), rows) in here.into_iter().zip(anywhere).zip(pairs) {
                for (place, (wide, integer)) in rows.iter().zip(integers).enumerate() {
                    let number = |bits| f16::from_f32_const(f32::from_bits(bits)).to_bits();
                    let mut expected = wide.map(number);
                    if integer {
                        expected[WORD_LANE] =
                            u16::try_from(wide[WORD_LANE] & 0xFFFF).expect("sixteen bits");
                    }
                    assert_eq!(here[place], expected, "{wide:x?}, {integer}");
                    assert_eq!(anywhere[place], expected, "{wide:x?}, {integer}");
                }
            }
        }
    }

    #[test]
    fn every_word_is_widened_as_by_integers() {
        let words: Vec<u16> = (0..=u16::MAX).collect();
        let rows = words.as_chunks::<LANES>().0;
        for together in 1..=5 {
            for rows in rows.chunks(together) {
                let mut found = vec![[0.0; LANES]; rows.len()];
                from_binary16(rows, &mut found);
                for (found, word) in found.as_flattened().iter().zip(rows.as_flattened()) {
                    let expected = f16::from_bits(*word).to_f32_const();
                    assert_eq!(found.to_bits(), expected.to_bits(), "{word:#06x}");
                }
            }
        }
    }
}
