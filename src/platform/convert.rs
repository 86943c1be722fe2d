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
    let (from, to) = match std::arch::is_x86_feature_detected!("f16c") {
        // SAFETY: the processor has the instructions that the function is compiled for.
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
    let (from, to) = match std::arch::is_x86_feature_detected!("f16c") {
        // SAFETY: the processor has the instructions that the function is compiled for.
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
