//! This file is the arithmetic of the pipeline: f32, one rounding an operation, subnormals kept or
//! flushed.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of the pipeline. Every operation rounds on its own, to nearest even.
pub(super) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    fn new(value: f32) -> Self;
    fn value(self) -> f32;

    fn sqrt(self) -> Self {
        Self::new(self.value().sqrt())
    }

    fn is_zero(self) -> bool {
        self.value() == 0.0
    }

    /// `if a > b then a else b`: the form decides the sign of zero.
    fn larger(self, other: Self) -> Self {
        if self.value() > other.value() { self } else { other }
    }

    /// `if a < b then a else b`.
    fn smaller(self, other: Self) -> Self {
        if self.value() < other.value() { self } else { other }
    }
}

/// IEEE 754 arithmetic.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keep(f32);

/// Subnormal operands count as zero, and results that are subnormal after rounding become zero.
/// The sign stays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flush(f32);

/// A subnormal as a zero of its sign. Defined on the bits, because processors differ in when they
/// look at a result.
#[inline]
fn flushed(value: f32) -> f32 {
    const EXPONENT: u32 = 0x7F80_0000;
    const SIGN: u32 = 0x8000_0000;
    let bits = value.to_bits();
    if bits & EXPONENT == 0 { f32::from_bits(bits & SIGN) } else { value }
}

impl Number for Keep {
    #[inline]
    fn new(value: f32) -> Self {
        Self(value)
    }

    #[inline]
    fn value(self) -> f32 {
        self.0
    }
}

impl Number for Flush {
    #[inline]
    fn new(value: f32) -> Self {
        Self(flushed(value))
    }

    #[inline]
    fn value(self) -> f32 {
        self.0
    }
}

macro_rules! operators {
    ($number:ty, $($operator:ident $method:ident),*) => {$(
        impl $operator for $number {
            type Output = Self;

            #[inline]
            fn $method(self, other: Self) -> Self {
                Self::new($operator::$method(self.0, other.0))
            }
        }
    )*};
}

operators!(Keep, Add add, Sub sub, Mul mul, Div div);
operators!(Flush, Add add, Sub sub, Mul mul, Div div);

impl Neg for Keep {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Neg for Flush {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALLEST_NORMAL: u32 = 0x0080_0000;

    fn bits<N: Number>(number: N) -> u32 {
        number.value().to_bits()
    }

    #[test]
    fn flush_takes_subnormal_operands_as_zero_of_their_sign() {
        let subnormal = f32::from_bits(SMALLEST_NORMAL - 1);
        assert_eq!(bits(Flush::new(subnormal)), 0);
        assert_eq!(bits(Flush::new(-subnormal)), 0x8000_0000);
        assert_eq!(bits(Keep::new(subnormal)), SMALLEST_NORMAL - 1);
        assert_eq!(bits(Flush::new(f32::from_bits(SMALLEST_NORMAL))), SMALLEST_NORMAL);
    }

    #[test]
    fn flush_makes_subnormal_results_zero_and_keep_does_not() {
        let small = f32::from_bits(SMALLEST_NORMAL);
        assert_eq!(bits(Flush::new(small) * Flush::new(-0.5)), 0x8000_0000);
        assert_eq!(bits(Keep::new(small) * Keep::new(0.5)), SMALLEST_NORMAL / 2);
        let next = f32::from_bits(SMALLEST_NORMAL + 1);
        assert_eq!(bits(Flush::new(next) - Flush::new(small)), 0);
        assert_eq!(bits(Keep::new(next) - Keep::new(small)), 1);
    }

    #[test]
    fn flush_looks_at_a_result_after_rounding() {
        // 0x00ff_ffff x 0.5 lies half way below the smallest normal number and rounds up to it.
        let product = Flush::new(f32::from_bits(0x00FF_FFFF)) * Flush::new(0.5);
        assert_eq!(bits(product), SMALLEST_NORMAL);
    }

    #[test]
    fn clamps_keep_the_second_operand_on_a_tie() {
        assert_eq!(bits(Keep::new(-0.0).larger(Keep::new(0.0))), 0);
        assert_eq!(bits(Keep::new(0.0).larger(Keep::new(-0.0))), 0x8000_0000);
        assert_eq!(bits(Keep::new(-0.0).smaller(Keep::new(0.0))), 0);
    }
}
