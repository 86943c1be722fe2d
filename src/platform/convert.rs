//! This file converts rows of numbers between f32 and binary16 by the processor's instructions.
//!
//! `half` knows them, too, but one call converts eight numbers at most, and on aarch64 it wants more
//! than every processor has: on a Cortex-A53, whose instructions these are, it would compute with
//! integers. It does what is left over, and everything where there are no such instructions.
#![allow(unsafe_code, reason = "not every processor has the instructions, and vectors are cast")]

use bitstream_model::interface::record::{LANES, WORD_LANE};
use half::f16;
use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};

/// Rounds the numbers of records to binary16, to nearest even. Of the rows that `integers` says, the
/// last word is an unsigned integer, whose lower half is taken.
///
/// Shape: as many records of either.
#[inline(always)]
pub(crate) fn to_binary16<const ROWS: usize>(
    from: &[[Wide; ROWS]],
    integers: &[bool; ROWS],
    to: &mut [[Narrow; ROWS]],
) {
    #[cfg(target_arch = "x86_64")]
    if x86::there() {
        // SAFETY: the processor has the instructions that the function is compiled for, and the system
        // keeps their registers.
        return unsafe { x86::to_binary16(from, integers, to) };
    }
    for (from, to) in from.iter().zip(to) {
        for ((from, to), integer) in from.iter().zip(to).zip(integers) {
            *to = row(from, *integer);
        }
    }
}

/// One row.
#[inline(always)]
fn row(from: &Wide, integer: bool) -> Narrow {
    #[cfg(target_arch = "aarch64")]
    let mut to = aarch64::to_binary16(from);
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
mod x86 {
    use core::arch::x86_64::{
        __m128i, __m256, _MM_FROUND_TO_NEAREST_INT, _mm_or_si128, _mm_packus_epi32, _mm256_and_ps,
        _mm256_andnot_ps, _mm256_castps_si256, _mm256_castsi256_si128, _mm256_cvtph_ps,
        _mm256_cvtps_ph, _mm256_extractf128_si256,
    };

    use super::{LANES, Narrow, Rest, WORD_LANE, Wide};

    /// Whether the processor has the instructions. They take the registers of AVX, which a system may
    /// not keep, and whether it does is asked of AVX alone.
    #[inline]
    pub(super) fn there() -> bool {
        std::arch::is_x86_feature_detected!("avx") && std::arch::is_x86_feature_detected!("f16c")
    }

    #[target_feature(enable = "avx,f16c")]
    #[inline]
    pub(super) fn to_binary16<const ROWS: usize>(
        from: &[[Wide; ROWS]],
        integers: &[bool; ROWS],
        to: &mut [[Narrow; ROWS]],
    ) {
        // Two records are pairs of rows, however many rows one has.
        let ((twos, rest), (to_twos, to_rest)) = (from.as_chunks(), to.as_chunks_mut());
        for (from, to) in twos.iter().zip(to_twos) {
            let (from, to): (&[[_; ROWS]; 2], &mut [[_; ROWS]; 2]) = (from, to);
            let pairs = from.as_flattened().as_chunks::<2>().0;
            let to_pairs = to.as_flattened_mut().as_chunks_mut::<2>().0;
            for (at, (from, to)) in pairs.iter().zip(to_pairs).enumerate() {
                *to = pair(from, [integers[2 * at % ROWS], integers[(2 * at + 1) % ROWS]]);
            }
        }
        for (from, to) in rest.iter().zip(to_rest) {
            for ((from, to), integer) in from.iter().zip(to).zip(integers) {
                [*to, _] = pair(&[*from, [0; LANES]], [*integer, false]);
            }
        }
    }

    /// Two rows.
    #[target_feature(enable = "avx,f16c")]
    #[inline]
    fn pair(rows: &[Wide; 2], integers: [bool; 2]) -> [Narrow; 2] {
        let wide: __m256 = bytemuck::cast(*rows);
        if integers == [false; 2] {
            return bytemuck::cast(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(wide));
        }
        const { assert!(WORD_LANE == 3 && LANES == 4, "so it stands here") };
        // An integer is no number: as one it would be subnormal, or none.
        let [first, second] = integers.map(|integer| if integer { u32::MAX } else { 0 });
        let all: __m256 = bytemuck::cast([0, 0, 0, first, 0, 0, 0, second]);
        let low: __m256 = bytemuck::cast([0, 0, 0, first & 0xFFFF, 0, 0, 0, second & 0xFFFF]);
        let numbers = _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(_mm256_andnot_ps(all, wide));
        let words = _mm256_castps_si256(_mm256_and_ps(low, wide));
        let high = _mm256_extractf128_si256::<1>(words);
        let words = _mm_packus_epi32(_mm256_castsi256_si128(words), high);
        bytemuck::cast(_mm_or_si128(numbers, words))
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

    /// However many records there are at once, of however many rows, integers beside them or not.
    #[test]
    fn numbers_are_rounded_as_by_integers_and_integers_are_cut() {
        let wide: Vec<u32> = wide().into_iter().map(f32::to_bits).collect();
        rounded(&wide, [false; 1]);
        rounded(&wide, [true, false]);
        rounded(&wide, [true, true, false]);
        rounded(&wide, [false, true, false, false, false, true, true]);
    }

    fn rounded<const ROWS: usize>(wide: &[u32], integers: [bool; ROWS]) {
        let records = wide.as_chunks::<LANES>().0.as_chunks::<ROWS>().0;
        assert!(wide.len() - records.as_flattened().as_flattened().len() < LANES * ROWS);
        for together in 1..=5 {
            for records in records.chunks(together) {
                let mut found = vec![[[0; LANES]; ROWS]; records.len()];
                to_binary16(records, &integers, &mut found);
                let rows = records.as_flattened().iter().zip(integers.iter().cycle());
                for (found, (wide, integer)) in found.as_flattened().iter().zip(rows) {
                    let number = |bits| f16::from_f32_const(f32::from_bits(bits)).to_bits();
                    let mut expected = wide.map(number);
                    if *integer {
                        expected[WORD_LANE] =
                            u16::try_from(wide[WORD_LANE] & 0xFFFF).expect("sixteen bits");
                    }
                    assert_eq!(*found, expected, "{wide:x?}, {integer}");
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
