//! Arithmetic of the pipeline: one rounding an operation, in f32, with subnormals or without, or in
//! binary16.
//!
//! A binary16 number is held as the f32 of the same value, and an operation is the f32 operation
//! rounded once more. That is the correctly rounded binary16 operation: f32 has two bits more than
//! twice binary16's eleven, so that for + - * / and the square root the first rounding never moves
//! a result across a value half way between two binary16 numbers.

use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::sixteen;

/// A format of the pipeline's numbers, with its treatment of subnormals.
pub(crate) trait Format: Copy {
    /// The number of the format nearest to `value`; of two, the even one.
    fn round(value: f32) -> f32;
}

/// IEEE 754 binary32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Single;

/// Binary32 whose subnormals count as zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SingleFlushed;

/// IEEE 754 binary16.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Half;

impl Format for Single {
    #[inline]
    fn round(value: f32) -> f32 {
        value
    }
}

impl Format for SingleFlushed {
    #[inline]
    fn round(value: f32) -> f32 {
        // On the bits, because processors differ in whether they flush before or after rounding.
        const SIGN: u32 = 0x8000_0000;
        const SMALLEST_NORMAL: u32 = 0x0080_0000;
        let bits = value.to_bits();
        if bits & !SIGN < SMALLEST_NORMAL { f32::from_bits(bits & SIGN) } else { value }
    }
}

impl Format for Half {
    #[inline]
    fn round(value: f32) -> f32 {
        sixteen::round(value)
    }
}

/// A number of the pipeline. Every operation rounds on its own, to nearest even.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Number<F>(f32, PhantomData<F>);

impl<F: Format> Number<F> {
    /// The number nearest to a value.
    #[inline]
    pub(crate) fn new(value: f32) -> Self {
        Self::exact(F::round(value))
    }

    /// A value that the format holds as it is.
    #[inline]
    fn exact(value: f32) -> Self {
        Self(value, PhantomData)
    }

    #[inline]
    pub(crate) fn value(self) -> f32 {
        self.0
    }

    /// The same number in a format that holds every number of this format.
    #[inline]
    pub(crate) fn widened<W: Format>(self) -> Number<W> {
        Number::exact(self.0)
    }

    #[inline]
    pub(crate) fn sqrt(self) -> Self {
        Self::new(self.0.sqrt())
    }

    #[inline]
    pub(crate) fn is_zero(self) -> bool {
        self.0 == 0.0
    }

    #[inline]
    pub(crate) fn above(self, other: Self) -> bool {
        self.0 > other.0
    }

    /// `if a > b then a else b`: the form decides the sign of zero.
    #[inline]
    pub(crate) fn larger(self, other: Self) -> Self {
        if self.0 > other.0 { self } else { other }
    }

    /// `if a < b then a else b`.
    #[inline]
    pub(crate) fn smaller(self, other: Self) -> Self {
        if self.0 < other.0 { self } else { other }
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<F: Format> $operator for Number<F> {
            type Output = Self;

            #[inline]
            fn $method(self, other: Self) -> Self {
                Self::new($operator::$method(self.0, other.0))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl<F: Format> Neg for Number<F> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self::exact(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALLEST: u32 = 0x0080_0000;

    fn bits<F: Format>(number: Number<F>) -> u32 {
        number.value().to_bits()
    }

    fn keep(value: f32) -> Number<Single> {
        Number::new(value)
    }

    fn flush(value: f32) -> Number<SingleFlushed> {
        Number::new(value)
    }

    #[test]
    fn flush_takes_subnormal_operands_as_zero_of_their_sign() {
        let subnormal = f32::from_bits(SMALLEST - 1);
        assert_eq!(bits(flush(subnormal)), 0);
        assert_eq!(bits(flush(-subnormal)), 0x8000_0000);
        assert_eq!(bits(keep(subnormal)), SMALLEST - 1);
        assert_eq!(bits(flush(f32::from_bits(SMALLEST))), SMALLEST);
    }

    #[test]
    fn flush_makes_subnormal_results_zero_and_keep_does_not() {
        let small = f32::from_bits(SMALLEST);
        assert_eq!(bits(flush(small) * flush(-0.5)), 0x8000_0000);
        assert_eq!(bits(keep(small) * keep(0.5)), SMALLEST / 2);
        let next = f32::from_bits(SMALLEST + 1);
        assert_eq!(bits(flush(next) - flush(small)), 0);
        assert_eq!(bits(keep(next) - keep(small)), 1);
    }

    #[test]
    fn flush_decides_after_rounding() {
        // 0x00ff_ffff x 0.5 lies half way below the smallest normal number and rounds up to it.
        let product = flush(f32::from_bits(0x00FF_FFFF)) * flush(0.5);
        assert_eq!(bits(product), SMALLEST);
    }

    #[test]
    fn clamps_keep_the_second_operand_on_a_tie() {
        assert_eq!(bits(keep(-0.0).larger(keep(0.0))), 0);
        assert_eq!(bits(keep(0.0).larger(keep(-0.0))), 0x8000_0000);
        assert_eq!(bits(keep(-0.0).smaller(keep(0.0))), 0);
    }

    /// Binary16 numbers as bits: all signs and exponents, mantissas at the edges and between.
    fn operands() -> Vec<u16> {
        const MANTISSAS: [u16; 9] = [0, 1, 2, 0x155, 0x1FF, 0x200, 0x2AB, 0x3FE, 0x3FF];
        let exponents = 0..32_u16;
        exponents
            .flat_map(|exponent| MANTISSAS.map(|mantissa| (exponent << 10) | mantissa))
            .flat_map(|word| [word, word | 0x8000])
            .collect()
    }

    /// The binary16 number nearest to an f64 that is exact, or far closer to the truth than the
    /// truth is to a tie. The crate's own conversion cuts 32 bits off first.
    fn nearest(value: f64) -> ::half::f16 {
        let near = ::half::f16::from_f64(value);
        if !value.is_finite() || near.is_nan() {
            return near;
        }
        let magnitude = near.to_bits() & 0x7FFF;
        let distance = |word: &u16| {
            // Infinity stands where the next number would be.
            let number =
                if *word == 0x7C00 { 65_536.0 } else { ::half::f16::from_bits(*word).to_f64() };
            (number - value.abs()).abs()
        };
        let candidates = magnitude.saturating_sub(1)..=(magnitude + 1).min(0x7C00);
        let nearest = candidates
            .min_by(|a, b| distance(a).total_cmp(&distance(b)).then((a & 1).cmp(&(b & 1))))
            .unwrap_or(magnitude);
        ::half::f16::from_bits(nearest | (near.to_bits() & 0x8000))
    }

    fn assert_same(found: Number<Half>, expected: ::half::f16, what: &str) {
        let found = found.value();
        let expected = expected.to_f32();
        assert!(
            found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(),
            "{what}: {found:e}, expected {expected:e}"
        );
    }

    #[test]
    fn binary16_operations_are_correctly_rounded() {
        let operands = operands();
        for &a in &operands {
            let x = ::half::f16::from_bits(a);
            let p = Number::<Half>::new(x.to_f32());
            assert_same(p, x, "conversion");
            let x = x.to_f64();
            assert_same(p.sqrt(), nearest(x.sqrt()), "square root");
            for &b in &operands {
                let y = ::half::f16::from_bits(b);
                let q = Number::<Half>::new(y.to_f32());
                let y = y.to_f64();
                // In f64 sums and products are exact.
                assert_same(p + q, nearest(x + y), "sum");
                assert_same(p - q, nearest(x - y), "difference");
                assert_same(p * q, nearest(x * y), "product");
                assert_same(p / q, nearest(x / y), "quotient");
            }
        }
    }
}
