//! This file converts rows of numbers between f32 and binary16 by the processor's instructions.
//!
//! `half` knows them, too, but one call converts eight numbers at most, and on aarch64 it wants more
//! than every processor has: on a Cortex-A53, whose instructions these are, it would compute with
//! integers. It does what is left over, and everything where there are no such instructions.
#![allow(unsafe_code, reason = "not every processor has the instructions, and vectors are cast")]

use bitstream_model::interface::record::LANES;
use half::f16;
use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};

/// Rounds numbers to binary16, to nearest even.
///
/// Shape: as many rows of either.
#[inline]
pub(crate) fn to_binary16(from: &[[f32; LANES]], to: &mut [[u16; LANES]]) {
    #[cfg(target_arch = "x86_64")]
    let (from, to) = match x86::there() {
        // SAFETY: the processor has the instructions that the function is compiled for, and the system
        // keeps their registers.
        true => unsafe { x86::to_binary16(from, to) },
        false => (from, to),
    };
    #[cfg(target_arch = "aarch64")]
    let (from, to) = aarch64::to_binary16(from, to);
    if !from.is_empty() {
        let to: &mut [f16] = to.as_flattened_mut().reinterpret_cast_mut();
        to.convert_from_f32_slice(from.as_flattened());
    }
}

/// Numbers from binary16.
///
/// Shape: as many rows of either.
#[inline]
pub(crate) fn from_binary16(from: &[[u16; LANES]], to: &mut [[f32; LANES]]) {
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

/// What is left to do.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
type Rest<'a, From, To> = (&'a [[From; LANES]], &'a mut [[To; LANES]]);

#[cfg(target_arch = "x86_64")]
mod x86 {
    use core::arch::x86_64::{
        __m128i, __m256, _MM_FROUND_TO_NEAREST_INT, _mm256_cvtph_ps, _mm256_cvtps_ph,
    };

    use super::{LANES, Rest};

    /// Whether the processor has the instructions. They take the registers of AVX, which a system may
    /// not keep, and whether it does is asked of AVX alone.
    #[inline]
    pub(super) fn there() -> bool {
        std::arch::is_x86_feature_detected!("avx") && std::arch::is_x86_feature_detected!("f16c")
    }

    #[target_feature(enable = "f16c")]
    pub(super) fn to_binary16<'a>(
        from: &'a [[f32; LANES]],
        to: &'a mut [[u16; LANES]],
    ) -> Rest<'a, f32, u16> {
        let (pairs, rest) = from.as_chunks::<2>();
        let (to_pairs, to_rest) = to.as_chunks_mut::<2>();
        for (from, to) in pairs.iter().zip(to_pairs) {
            let wide: __m256 = bytemuck::cast(*from);
            *to = bytemuck::cast(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(wide));
        }
        (rest, to_rest)
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

    use super::{LANES, Rest};

    pub(super) fn to_binary16<'a>(
        from: &'a [[f32; LANES]],
        to: &'a mut [[u16; LANES]],
    ) -> Rest<'a, f32, u16> {
        for (from, to) in from.iter().zip(&mut *to) {
            // SAFETY: the vector is four f32, of any bits.
            let wide = unsafe { std::mem::transmute::<[f32; LANES], float32x4_t>(*from) };
            // SAFETY: every aarch64 that Linux runs on has the instruction.
            let narrow = unsafe { vcvt_f16_f32(wide) };
            // SAFETY: the vector is four words of sixteen bits.
            *to = unsafe { std::mem::transmute::<float16x4_t, [u16; LANES]>(narrow) };
        }
        (&[], &mut [])
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

    /// However many rows there are at once.
    #[test]
    fn numbers_are_rounded_as_by_integers() {
        let wide = wide();
        let rows = wide.as_chunks::<LANES>().0;
        assert!(wide.len() - rows.as_flattened().len() < LANES);
        for together in 1..=5 {
            for rows in rows.chunks(together) {
                let mut found = vec![[0; LANES]; rows.len()];
                to_binary16(rows, &mut found);
                let expected = rows.as_flattened().iter().map(|it| f16::from_f32_const(*it));
                for (found, expected) in found.as_flattened().iter().zip(expected) {
                    assert_eq!(*found, expected.to_bits(), "{expected} of {rows:?}");
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
