//! The eight SIMD lanes of AVX2.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::block::Words;
use super::{Lanes, Mask, Numbers, Quad, Work, quad};

/// AVX2 and F16C, which the processor has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eight(__m256);

/// All bits of a lane or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightMask(__m256);

impl Avx2 {
    /// Where the processor has both.
    pub(crate) fn found() -> Option<Self> {
        let [avx2, f16c] = [is_x86_feature_detected!("avx2"), is_x86_feature_detected!("f16c")];
        (avx2 && f16c).then_some(Self(()))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident $instruction:ident),*) => {$(
        impl $operator for Eight {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: numbers are made where the processor has AVX2.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}

operators!(
    Add add _mm256_add_ps,
    Sub sub _mm256_sub_ps,
    Mul mul _mm256_mul_ps,
    Div div _mm256_div_ps
);

#[inline]
#[target_feature(enable = "avx2")]
fn negative(numbers: __m256) -> __m256 {
    _mm256_xor_ps(numbers, _mm256_set1_ps(-0.0))
}

#[inline]
#[target_feature(enable = "avx2")]
fn positive(numbers: __m256) -> __m256 {
    _mm256_andnot_ps(_mm256_set1_ps(-0.0), numbers)
}

#[inline]
#[target_feature(enable = "avx2")]
fn zero(numbers: __m256) -> __m256 {
    _mm256_cmp_ps::<_CMP_EQ_OQ>(numbers, _mm256_setzero_ps())
}

#[inline]
#[target_feature(enable = "avx2,f16c")]
fn binary16(numbers: __m256) -> __m256 {
    _mm256_cvtph_ps(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(numbers))
}

#[inline]
#[target_feature(enable = "avx2")]
fn words_added(a: __m256, b: __m256) -> __m256 {
    _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b)))
}

impl Neg for Eight {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { negative(self.0) })
    }
}

impl Numbers for Eight {
    type Mask = EightMask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { positive(self.0) })
    }

    #[inline(always)]
    fn above(self, other: Self) -> EightMask {
        // SAFETY: numbers are made where the processor has AVX2.
        EightMask(unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn is_zero(self) -> EightMask {
        // SAFETY: numbers are made where the processor has AVX2.
        EightMask(unsafe { zero(self.0) })
    }

    /// The instruction gives the second of two zeros, and beside a NaN.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn or(self, mask: EightMask, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }

    #[inline(always)]
    fn to_binary16(self) -> Self {
        // SAFETY: numbers are made by an `Avx2` alone, which there is only where the processor has AVX2
        // and F16C.
        Self(unsafe { binary16(self.0) })
    }

    #[inline(always)]
    fn with_words(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2.
        Self(unsafe { words_added(self.0, other.0) })
    }
}

impl Mask for EightMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: masks are made where the processor has AVX2.
        Self(unsafe { _mm256_and_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        // SAFETY: masks are made where the processor has AVX2.
        Self(unsafe { _mm256_or_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        // SAFETY: masks are made where the processor has AVX2.
        Self(unsafe { _mm256_andnot_ps(other.0, self.0) })
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: masks are made where the processor has AVX2.
        unsafe { _mm256_movemask_ps(self.0).cast_unsigned() }
    }
}

/// Rows for columns in each four lanes.
#[inline]
#[target_feature(enable = "avx2")]
fn transposed([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    let (low_ab, high_ab) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
    let (low_cd, high_cd) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
    [
        _mm256_shuffle_ps::<0x44>(low_ab, low_cd),
        _mm256_shuffle_ps::<0xEE>(low_ab, low_cd),
        _mm256_shuffle_ps::<0x44>(high_ab, high_cd),
        _mm256_shuffle_ps::<0xEE>(high_ab, high_cd),
    ]
}

/// Two quads side by side.
#[inline]
#[target_feature(enable = "avx2")]
fn beside([a, b]: [__m128; 2]) -> __m256 {
    _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(a), b)
}

/// What [`beside`] puts together.
#[inline]
#[target_feature(enable = "avx2")]
fn apart(quads: __m256) -> [__m128; 2] {
    [_mm256_castps256_ps128(quads), _mm256_extractf128_ps::<1>(quads)]
}

#[target_feature(enable = "avx2,f16c")]
fn enabled<W: Work>(work: W) {
    work.with(Avx2(()));
}

impl Lanes for Avx2 {
    type Numbers = Eight;
    type Mask = EightMask;

    const WIDTH: usize = 8;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        // SAFETY: there is an `Avx2` only where the processor has it.
        unsafe { enabled(work) }
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Eight {
        // SAFETY: there is an `Avx2` only where the processor has it.
        Eight(unsafe { _mm256_set1_ps(number) })
    }

    #[inline(always)]
    fn load(self, words: &Words, at: usize) -> Eight {
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        Eight(unsafe { _mm256_loadu_ps(words.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, numbers: Eight, words: &mut Words, at: usize) {
        let words = &mut words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        unsafe { _mm256_storeu_ps(words.as_mut_ptr(), numbers.0) }
    }

    #[inline(always)]
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Eight {
        #[inline]
        #[target_feature(enable = "avx2")]
        fn counts(words: __m256i, mask: u32) -> __m256 {
            _mm256_cvtepi32_ps(_mm256_and_si256(words, _mm256_set1_epi32(mask.cast_signed())))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { _mm256_loadu_si256(words.as_ptr().cast()) };
        // SAFETY: there is an `Avx2` only where the processor has it.
        Eight(unsafe { counts(words, mask) })
    }

    #[inline(always)]
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> EightMask {
        #[inline]
        #[target_feature(enable = "avx2")]
        fn tested(words: __m256i, bit: u32) -> __m256 {
            let bits = _mm256_set1_epi32(bit.cast_signed());
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(words, bits), bits))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { _mm256_loadu_si256(words.as_ptr().cast()) };
        // SAFETY: there is an `Avx2` only where the processor has it.
        EightMask(unsafe { tested(words, bit) })
    }

    #[inline(always)]
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Eight; 4] {
        let mut rows = [self.splat(0.0).0; 4];
        for (group, rows) in rows.iter_mut().enumerate() {
            let mut pair = [self.zero_quad(); 2];
            for (part, pair) in pair.iter_mut().enumerate() {
                // SAFETY: the caller promises it.
                let quad = unsafe { quad(quads, index, at + 4 * part + group, half) };
                // SAFETY: the caller promises that it can be read.
                *pair = unsafe { _mm_loadu_ps(quad.cast()) };
            }
            // SAFETY: there is an `Avx2` only where the processor has it.
            *rows = unsafe { beside(pair) };
        }
        // SAFETY: there is an `Avx2` only where the processor has it.
        let [a, b, c, d] = unsafe { transposed(rows) };
        [Eight(a), Eight(b), Eight(c), Eight(d)]
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        [a, b, c, d]: [Eight; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) {
        // SAFETY: there is an `Avx2` only where the processor has it.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (group, row) in rows.into_iter().enumerate() {
            // SAFETY: there is an `Avx2` only where the processor has it.
            let pair = unsafe { apart(row) };
            for (part, pair) in pair.into_iter().enumerate() {
                // SAFETY: the caller promises it.
                let quad = unsafe { quad(quads, index, at + 4 * part + group, half) };
                // SAFETY: the caller promises that it can be written.
                unsafe { _mm_storeu_ps(quad.cast_mut().cast(), pair) };
            }
        }
    }

    #[inline(always)]
    fn transposed(self, quads: &[Quad], stride: usize) -> [Eight; 4] {
        assert!(quads.len() > (Self::WIDTH - 1) * stride, "a quad for each lane");
        let mut rows = [self.splat(0.0).0; 4];
        for (group, rows) in rows.iter_mut().enumerate() {
            let mut pair = [self.zero_quad(); 2];
            for (part, pair) in pair.iter_mut().enumerate() {
                let quad = &quads[(4 * part + group) * stride];
                // SAFETY: a quad is four numbers.
                *pair = unsafe { _mm_loadu_ps(quad.as_ptr()) };
            }
            // SAFETY: there is an `Avx2` only where the processor has it.
            *rows = unsafe { beside(pair) };
        }
        // SAFETY: there is an `Avx2` only where the processor has it.
        let [a, b, c, d] = unsafe { transposed(rows) };
        [Eight(a), Eight(b), Eight(c), Eight(d)]
    }

    #[inline(always)]
    fn spread(self, [a, b, c, d]: [Eight; 4], quads: &mut [Quad], stride: usize) {
        assert!(quads.len() > (Self::WIDTH - 1) * stride, "a quad for each lane");
        // SAFETY: there is an `Avx2` only where the processor has it.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (group, row) in rows.into_iter().enumerate() {
            // SAFETY: there is an `Avx2` only where the processor has it.
            let pair = unsafe { apart(row) };
            for (part, pair) in pair.into_iter().enumerate() {
                let quad = &mut quads[(4 * part + group) * stride];
                // SAFETY: a quad is four numbers.
                unsafe { _mm_storeu_ps(quad.as_mut_ptr(), pair) };
            }
        }
    }
}

impl Avx2 {
    #[inline(always)]
    fn zero_quad(self) -> __m128 {
        // SAFETY: it is of SSE, which every x86-64 processor has.
        unsafe { _mm_setzero_ps() }
    }
}
