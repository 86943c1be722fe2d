//! NEON, which every processor of the target has: a register holds all lanes.

use std::arch::aarch64::*;

use super::LANES;
use super::instructions::Instructions;

/// NEON.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neon<const BINARY16: bool>;

impl<const BINARY16: bool> Neon<BINARY16> {
    #[inline(always)]
    fn selected(mask: uint32x4_t, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        // SAFETY: every processor of the target has NEON.
        unsafe { vbslq_f32(mask, a, b) }
    }

    #[inline(always)]
    fn bits(mask: uint32x4_t) -> u32 {
        let words: [u32; LANES] = bytemuck::cast(mask);
        (words[0] & 1) | (words[1] & 2) | (words[2] & 4) | (words[3] & 8)
    }
}

/// Operations by an instruction each.
macro_rules! by_instructions {
    ($($method:ident($($argument:ident),*) $instruction:ident;)*) => {$(
        #[inline(always)]
        fn $method(self, $($argument: Self::Register),*) -> Self::Register {
            // SAFETY: every processor of the target has NEON.
            unsafe { $instruction($($argument),*) }
        }
    )*};
}

impl<const BINARY16: bool> Instructions for Neon<BINARY16> {
    const BINARY16: bool = BINARY16;

    type Register = float32x4_t;

    by_instructions! {
        add(a, b) vaddq_f32;
        sub(a, b) vsubq_f32;
        mul(a, b) vmulq_f32;
        div(a, b) vdivq_f32;
        sqrt(a) vsqrtq_f32;
        neg(a) vnegq_f32;
        abs(a) vabsq_f32;
    }

    #[inline(always)]
    fn larger(self, a: Self::Register, b: Self::Register) -> Self::Register {
        // SAFETY: every processor of the target has NEON.
        Self::selected(unsafe { vcgtq_f32(a, b) }, a, b)
    }

    #[inline(always)]
    fn smaller(self, a: Self::Register, b: Self::Register) -> Self::Register {
        // SAFETY: every processor of the target has NEON.
        Self::selected(unsafe { vcltq_f32(a, b) }, a, b)
    }

    #[inline(always)]
    fn above(self, a: Self::Register, b: Self::Register) -> u32 {
        // SAFETY: every processor of the target has NEON.
        Self::bits(unsafe { vcgtq_f32(a, b) })
    }

    #[inline(always)]
    fn is(self, a: Self::Register, b: Self::Register) -> u32 {
        // SAFETY: every processor of the target has NEON.
        Self::bits(unsafe { vceqq_f32(a, b) })
    }

    #[inline(always)]
    fn select(self, bits: u32, a: Self::Register, b: Self::Register) -> Self::Register {
        let lanes: uint32x4_t = bytemuck::cast([1_u32, 2, 4, 8]);
        let bits: uint32x4_t = bytemuck::cast([bits; LANES]);
        // SAFETY: every processor of the target has NEON.
        Self::selected(unsafe { vtstq_u32(bits, lanes) }, a, b)
    }

    #[inline(always)]
    fn transposed(self, [a, b, c, d]: [Self::Register; 4]) -> [Self::Register; 4] {
        // SAFETY: every processor of the target has NEON.
        let low = |a, b| unsafe { vzip1q_f32(a, b) };
        // SAFETY: as above.
        let high = |a, b| unsafe { vzip2q_f32(a, b) };
        let (first, second) = (low(a, c), low(b, d));
        let (third, fourth) = (high(a, c), high(b, d));
        [low(first, second), high(first, second), low(third, fourth), high(third, fourth)]
    }
}
