//! The four SIMD lanes of NEON.

use std::arch::aarch64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::block::Words;
use super::{Lanes, Mask, Numbers, Quad, Work, quad};

/// NEON, which the target is built with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neon;

#[cfg(not(target_feature = "neon"))]
compile_error!("numbers in f32 are computed by NEON or with it on aarch64");

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Four(float32x4_t);

/// All bits of a lane or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FourMask(uint32x4_t);

macro_rules! operators {
    ($($operator:ident $method:ident $instruction:ident),*) => {$(
        impl $operator for Four {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the target has NEON, asserted above.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}

operators!(Add add vaddq_f32, Sub sub vsubq_f32, Mul mul vmulq_f32, Div div vdivq_f32);

impl Neg for Four {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vnegq_f32(self.0) })
    }
}

impl Numbers for Four {
    type Mask = FourMask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vsqrtq_f32(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vabsq_f32(self.0) })
    }

    #[inline(always)]
    fn above(self, other: Self) -> FourMask {
        // SAFETY: the target has NEON, asserted above.
        FourMask(unsafe { vcgtq_f32(self.0, other.0) })
    }

    #[inline(always)]
    fn is_zero(self) -> FourMask {
        // SAFETY: the target has NEON, asserted above.
        FourMask(unsafe { vceqzq_f32(self.0) })
    }

    /// Not the instruction's maximum, which gives NaN beside a NaN.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.or(self.above(other), other)
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.or(other.above(self), other)
    }

    #[inline(always)]
    fn or(self, mask: FourMask, other: Self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vbslq_f32(mask.0, self.0, other.0) })
    }

    #[inline(always)]
    fn to_binary16(self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vcvt_f32_f16(vcvt_f16_f32(self.0)) })
    }

    #[inline(always)]
    fn with_words(self, other: Self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { words_added(self.0, other.0) })
    }
}

impl Mask for FourMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vandq_u32(self.0, other.0) })
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vorrq_u32(self.0, other.0) })
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        // SAFETY: the target has NEON, asserted above.
        Self(unsafe { vbicq_u32(self.0, other.0) })
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        #[inline]
        #[target_feature(enable = "neon")]
        fn bits(mask: uint32x4_t) -> u32 {
            let places = vsetq_lane_u32::<1>(2, vdupq_n_u32(1));
            let places = vsetq_lane_u32::<3>(8, vsetq_lane_u32::<2>(4, places));
            vaddvq_u32(vandq_u32(mask, places))
        }
        // SAFETY: the target has NEON, asserted above.
        unsafe { bits(self.0) }
    }
}

#[inline]
#[target_feature(enable = "neon")]
fn words_added(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    vreinterpretq_f32_u32(vaddq_u32(vreinterpretq_u32_f32(a), vreinterpretq_u32_f32(b)))
}

/// Rows for columns.
#[inline]
#[target_feature(enable = "neon")]
fn transposed([a, b, c, d]: [float32x4_t; 4]) -> [Four; 4] {
    let (even, odd) = (vzip1q_f32(a, c), vzip1q_f32(b, d));
    let (even_high, odd_high) = (vzip2q_f32(a, c), vzip2q_f32(b, d));
    [
        Four(vzip1q_f32(even, odd)),
        Four(vzip2q_f32(even, odd)),
        Four(vzip1q_f32(even_high, odd_high)),
        Four(vzip2q_f32(even_high, odd_high)),
    ]
}

impl Lanes for Neon {
    type Numbers = Four;
    type Mask = FourMask;

    const WIDTH: usize = 4;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        work.with(self);
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Four {
        // SAFETY: the target has NEON, asserted above.
        Four(unsafe { vdupq_n_f32(number) })
    }

    #[inline(always)]
    fn load(self, words: &Words, at: usize) -> Four {
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        Four(unsafe { vld1q_f32(words.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, numbers: Four, words: &mut Words, at: usize) {
        let words = &mut words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        unsafe { vst1q_f32(words.as_mut_ptr(), numbers.0) }
    }

    #[inline(always)]
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Four {
        #[inline]
        #[target_feature(enable = "neon")]
        fn counts(words: uint32x4_t, mask: u32) -> float32x4_t {
            vcvtq_f32_u32(vandq_u32(words, vdupq_n_u32(mask)))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { vld1q_u32(words.as_ptr()) };
        // SAFETY: the target has NEON, asserted above.
        Four(unsafe { counts(words, mask) })
    }

    #[inline(always)]
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> FourMask {
        #[inline]
        #[target_feature(enable = "neon")]
        fn tested(words: uint32x4_t, bit: u32) -> uint32x4_t {
            vtstq_u32(words, vdupq_n_u32(bit))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { vld1q_u32(words.as_ptr()) };
        // SAFETY: the target has NEON, asserted above.
        FourMask(unsafe { tested(words, bit) })
    }

    #[inline(always)]
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Four; 4] {
        let mut rows = [self.splat(0.0).0; 4];
        for (lane, row) in rows.iter_mut().enumerate() {
            // SAFETY: the caller promises it.
            let quad = unsafe { quad(quads, index, at + lane, half) };
            // SAFETY: the caller promises that it can be read.
            *row = unsafe { vld1q_f32(quad.cast()) };
        }
        // SAFETY: the target has NEON, asserted above.
        unsafe { transposed(rows) }
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        [a, b, c, d]: [Four; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) {
        // SAFETY: the target has NEON, asserted above.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (lane, row) in rows.into_iter().enumerate() {
            // SAFETY: the caller promises it.
            let quad = unsafe { quad(quads, index, at + lane, half) };
            // SAFETY: the caller promises that it can be written.
            unsafe { vst1q_f32(quad.cast_mut().cast(), row.0) };
        }
    }

    #[inline(always)]
    fn transposed(self, quads: &[Quad], stride: usize) -> [Four; 4] {
        let mut rows = [self.splat(0.0).0; 4];
        for (lane, row) in rows.iter_mut().enumerate() {
            // SAFETY: a quad is four numbers.
            *row = unsafe { vld1q_f32(quads[lane * stride].as_ptr()) };
        }
        // SAFETY: the target has NEON, asserted above.
        unsafe { transposed(rows) }
    }

    #[inline(always)]
    fn spread(self, [a, b, c, d]: [Four; 4], quads: &mut [Quad], stride: usize) {
        // SAFETY: the target has NEON, asserted above.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (lane, row) in rows.into_iter().enumerate() {
            // SAFETY: a quad is four numbers.
            unsafe { vst1q_f32(quads[lane * stride].as_mut_ptr(), row.0) };
        }
    }
}
