//! The eight lanes of AVX2.

#![allow(unsafe_code, reason = "instructions beyond those of the target are asked for")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lanes, Mask, Numbers, Row, Work};

/// Proof that the processor has AVX2.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Avx2(());

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Eight(__m256);

/// All bits of a lane or none.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct EightMask(__m256);

impl Avx2 {
    /// A value if the processor has AVX2.
    pub(in super::super) fn found() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
    }
}

/// Defines operations on numbers and masks, each a function with AVX2 enabled.
macro_rules! operations {
    ($($(#[$meta:meta])* $name:ident $(($other:ident))? -> $result:ident = $function:path;)*) => {$(
        $(#[$meta])*
        #[inline(always)]
        fn $name(self $(, $other: Self)?) -> $result {
            // SAFETY: numbers and masks are made where the processor has AVX2: see `Avx2::found`.
            $result(unsafe { $function(self.0 $(, $other.0)?) })
        }
    )*};
}

macro_rules! operators {
    ($($operator:ident $method:ident $function:path;)*) => {$(
        impl $operator for Eight {
            type Output = Self;

            operations! { $method(other) -> Self = $function; }
        }
    )*};
}

operators! {
    Add add _mm256_add_ps;
    Sub sub _mm256_sub_ps;
    Mul mul _mm256_mul_ps;
    Div div _mm256_div_ps;
}

impl Neg for Eight {
    type Output = Self;

    operations! { neg -> Self = negative; }
}

impl Numbers for Eight {
    type Mask = EightMask;

    #[inline(always)]
    fn all(self, number: f32) -> Self {
        // SAFETY: numbers are made where the processor has AVX2: see `Avx2::found`.
        Self(unsafe { _mm256_set1_ps(number) })
    }

    #[inline(always)]
    fn row(self) -> Row {
        let mut row = Row::default();
        // SAFETY: a number exists, so the processor has AVX2; eight numbers fit into a row.
        unsafe { _mm256_storeu_ps(row.0.as_mut_ptr(), self.0) };
        row
    }

    #[inline(always)]
    fn of_row(self, row: &Row) -> Self {
        // A number exists, so AVX2 does.
        Avx2(()).load(row)
    }

    operations! {
        sqrt -> Self = _mm256_sqrt_ps;
        abs -> Self = positive;
        with_sign(other) -> Self = signed;
        above(other) -> EightMask = _mm256_cmp_ps::<_CMP_GT_OQ>;
        at_least(other) -> EightMask = _mm256_cmp_ps::<_CMP_GE_OQ>;
        is(other) -> EightMask = _mm256_cmp_ps::<_CMP_EQ_OQ>;
    }

    #[inline(always)]
    fn or(self, mask: EightMask, other: Self) -> Self {
        // SAFETY: numbers are made where the processor has AVX2: see `Avx2::found`.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
}

impl Mask for EightMask {
    operations! {
        and(other) -> Self = _mm256_and_ps;
        either(other) -> Self = _mm256_or_ps;
        without(other) -> Self = without;
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: masks are made where the processor has AVX2: see `Avx2::found`.
        unsafe { _mm256_movemask_ps(self.0) }.cast_unsigned()
    }
}

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
fn signed(magnitudes: __m256, signs: __m256) -> __m256 {
    let bit = _mm256_set1_ps(-0.0);
    _mm256_or_ps(_mm256_and_ps(bit, signs), _mm256_andnot_ps(bit, magnitudes))
}

#[inline]
#[target_feature(enable = "avx2")]
fn without(mask: __m256, other: __m256) -> __m256 {
    _mm256_andnot_ps(other, mask)
}

#[target_feature(enable = "avx2")]
fn enabled<W: Work>(work: W) {
    work.with(Avx2(()));
}

impl Lanes for Avx2 {
    type Numbers = Eight;
    const WIDTH: usize = 8;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        // SAFETY: there is an `Avx2` only where the processor has it.
        unsafe { enabled(work) };
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Eight {
        // SAFETY: the processor has AVX2, and a row is eight numbers.
        Eight(unsafe { _mm256_loadu_ps(row.0.as_ptr()) })
    }
}
