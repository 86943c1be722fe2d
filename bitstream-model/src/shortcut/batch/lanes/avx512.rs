//! The sixteen lanes of AVX-512, where the compiler knows its instructions (`build.rs`).

#![allow(clippy::incompatible_msrv, reason = "an older compiler leaves the module out")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::block::Words;
use super::{Lanes, Mask, Numbers, Quad, Work, quad};

/// AVX-512F, which the processor has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512(());

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sixteen(__m512);

/// A bit for each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SixteenMask(__mmask16);

impl Avx512 {
    /// Where the processor has it.
    pub(crate) fn found() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx512f").then_some(Self(()))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident $instruction:ident),*) => {$(
        impl $operator for Sixteen {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: numbers are made where the processor has AVX-512F.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}

operators!(
    Add add _mm512_add_ps,
    Sub sub _mm512_sub_ps,
    Mul mul _mm512_mul_ps,
    Div div _mm512_div_ps
);

#[inline]
#[target_feature(enable = "avx512f")]
fn negative(numbers: __m512) -> __m512 {
    let sign = _mm512_set1_epi32(i32::MIN);
    _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(numbers), sign))
}

#[inline]
#[target_feature(enable = "avx512f")]
fn zero(numbers: __m512) -> __mmask16 {
    _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(numbers, _mm512_setzero_ps())
}

#[inline]
#[target_feature(enable = "avx512f")]
fn binary16(numbers: __m512) -> __m512 {
    _mm512_cvtph_ps(_mm512_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(numbers))
}

#[inline]
#[target_feature(enable = "avx512f")]
fn words_added(a: __m512, b: __m512) -> __m512 {
    _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b)))
}

impl Neg for Sixteen {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { negative(self.0) })
    }
}

impl Numbers for Sixteen {
    type Mask = SixteenMask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { _mm512_abs_ps(self.0) })
    }

    #[inline(always)]
    fn above(self, other: Self) -> SixteenMask {
        // SAFETY: numbers are made where the processor has AVX-512F.
        SixteenMask(unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn is_zero(self) -> SixteenMask {
        // SAFETY: numbers are made where the processor has AVX-512F.
        SixteenMask(unsafe { zero(self.0) })
    }

    /// The instruction gives the second of two zeros, and beside a NaN.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn or(self, mask: SixteenMask, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { _mm512_mask_blend_ps(mask.0, other.0, self.0) })
    }

    #[inline(always)]
    fn to_binary16(self) -> Self {
        // SAFETY: numbers are made by an `Avx512` alone, which there is only where the processor has
        // AVX-512F.
        Self(unsafe { binary16(self.0) })
    }

    #[inline(always)]
    fn with_words(self, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX-512F.
        Self(unsafe { words_added(self.0, other.0) })
    }
}

impl Mask for SixteenMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.into()
    }
}

/// Rows for columns in each four lanes.
#[inline]
#[target_feature(enable = "avx512f")]
fn transposed([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    let (low_ab, high_ab) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
    let (low_cd, high_cd) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
    [
        _mm512_shuffle_ps::<0x44>(low_ab, low_cd),
        _mm512_shuffle_ps::<0xEE>(low_ab, low_cd),
        _mm512_shuffle_ps::<0x44>(high_ab, high_cd),
        _mm512_shuffle_ps::<0xEE>(high_ab, high_cd),
    ]
}

/// Four quads side by side.
#[inline]
#[target_feature(enable = "avx512f")]
fn beside(quads: [__m128; 4]) -> __m512 {
    let [a, b, c, d] = quads;
    let pair = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(a), b);
    _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(pair, c), d)
}

/// What [`beside`] puts together.
#[inline]
#[target_feature(enable = "avx512f")]
fn apart(quads: __m512) -> [__m128; 4] {
    [
        _mm512_castps512_ps128(quads),
        _mm512_extractf32x4_ps::<1>(quads),
        _mm512_extractf32x4_ps::<2>(quads),
        _mm512_extractf32x4_ps::<3>(quads),
    ]
}

#[target_feature(enable = "avx512f")]
fn enabled<W: Work>(work: W) {
    work.with(Avx512(()));
}

impl Lanes for Avx512 {
    type Numbers = Sixteen;
    type Mask = SixteenMask;

    const WIDTH: usize = 16;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        // SAFETY: there is an `Avx512` only where the processor has it.
        unsafe { enabled(work) }
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Sixteen {
        // SAFETY: there is an `Avx512` only where the processor has it.
        Sixteen(unsafe { _mm512_set1_ps(number) })
    }

    #[inline(always)]
    fn load(self, words: &Words, at: usize) -> Sixteen {
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        Sixteen(unsafe { _mm512_loadu_ps(words.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, numbers: Sixteen, words: &mut Words, at: usize) {
        let words = &mut words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        unsafe { _mm512_storeu_ps(words.as_mut_ptr(), numbers.0) }
    }

    #[inline(always)]
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Sixteen {
        #[inline]
        #[target_feature(enable = "avx512f")]
        fn counts(words: __m512i, mask: u32) -> __m512 {
            _mm512_cvtepi32_ps(_mm512_and_si512(words, _mm512_set1_epi32(mask.cast_signed())))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { _mm512_loadu_si512(words.as_ptr().cast()) };
        // SAFETY: there is an `Avx512` only where the processor has it.
        Sixteen(unsafe { counts(words, mask) })
    }

    #[inline(always)]
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> SixteenMask {
        #[inline]
        #[target_feature(enable = "avx512f")]
        fn tested(words: __m512i, bit: u32) -> __mmask16 {
            _mm512_test_epi32_mask(words, _mm512_set1_epi32(bit.cast_signed()))
        }
        let words = &words[at..at + Self::WIDTH];
        // SAFETY: that many words.
        let words = unsafe { _mm512_loadu_si512(words.as_ptr().cast()) };
        // SAFETY: there is an `Avx512` only where the processor has it.
        SixteenMask(unsafe { tested(words, bit) })
    }

    #[inline(always)]
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Sixteen; 4] {
        let mut rows = [self.splat(0.0).0; 4];
        for (group, rows) in rows.iter_mut().enumerate() {
            let mut four = [self.zero_quad(); 4];
            for (quarter, four) in four.iter_mut().enumerate() {
                // SAFETY: the caller promises it.
                let quad = unsafe { quad(quads, index, at + 4 * quarter + group, half) };
                // SAFETY: the caller promises that it can be read.
                *four = unsafe { _mm_loadu_ps(quad.cast()) };
            }
            // SAFETY: there is an `Avx512` only where the processor has it.
            *rows = unsafe { beside(four) };
        }
        // SAFETY: there is an `Avx512` only where the processor has it.
        let [a, b, c, d] = unsafe { transposed(rows) };
        [Sixteen(a), Sixteen(b), Sixteen(c), Sixteen(d)]
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        [a, b, c, d]: [Sixteen; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) {
        // SAFETY: there is an `Avx512` only where the processor has it.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (group, row) in rows.into_iter().enumerate() {
            // SAFETY: there is an `Avx512` only where the processor has it.
            let four = unsafe { apart(row) };
            for (quarter, four) in four.into_iter().enumerate() {
                // SAFETY: the caller promises it.
                let quad = unsafe { quad(quads, index, at + 4 * quarter + group, half) };
                // SAFETY: the caller promises that it can be written.
                unsafe { _mm_storeu_ps(quad.cast_mut().cast(), four) };
            }
        }
    }

    #[inline(always)]
    fn transposed(self, quads: &[Quad], stride: usize) -> [Sixteen; 4] {
        assert!(quads.len() > (Self::WIDTH - 1) * stride, "a quad for each lane");
        let mut rows = [self.splat(0.0).0; 4];
        for (group, rows) in rows.iter_mut().enumerate() {
            let mut four = [self.zero_quad(); 4];
            for (quarter, four) in four.iter_mut().enumerate() {
                let quad = &quads[(4 * quarter + group) * stride];
                // SAFETY: a quad is four numbers.
                *four = unsafe { _mm_loadu_ps(quad.as_ptr()) };
            }
            // SAFETY: there is an `Avx512` only where the processor has it.
            *rows = unsafe { beside(four) };
        }
        // SAFETY: there is an `Avx512` only where the processor has it.
        let [a, b, c, d] = unsafe { transposed(rows) };
        [Sixteen(a), Sixteen(b), Sixteen(c), Sixteen(d)]
    }

    #[inline(always)]
    fn spread(self, [a, b, c, d]: [Sixteen; 4], quads: &mut [Quad], stride: usize) {
        assert!(quads.len() > (Self::WIDTH - 1) * stride, "a quad for each lane");
        // SAFETY: there is an `Avx512` only where the processor has it.
        let rows = unsafe { transposed([a.0, b.0, c.0, d.0]) };
        for (group, row) in rows.into_iter().enumerate() {
            // SAFETY: there is an `Avx512` only where the processor has it.
            let four = unsafe { apart(row) };
            for (quarter, four) in four.into_iter().enumerate() {
                let quad = &mut quads[(4 * quarter + group) * stride];
                // SAFETY: a quad is four numbers.
                unsafe { _mm_storeu_ps(quad.as_mut_ptr(), four) };
            }
        }
    }
}

impl Avx512 {
    #[inline(always)]
    fn zero_quad(self) -> __m128 {
        // SAFETY: it is of SSE, which every x86-64 processor has.
        unsafe { _mm_setzero_ps() }
    }
}
