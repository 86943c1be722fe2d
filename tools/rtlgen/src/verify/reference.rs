//! The operators by software: binary32 arithmetic in integers, from `rustc_apfloat` and of its own,
//! with the flush rules of the specification. The processor's floating-point unit has no part in
//! it.

use rustc_apfloat::ieee::{Double, Single};
use rustc_apfloat::{Float as _, FloatConvert as _, StatusAnd};

const SIGN: u32 = 0x8000_0000;
const EXPONENT: u32 = 0x7F80_0000;
const FRACTION: u32 = 0x007F_FFFF;
const INFINITY: u32 = 0x7F80_0000;

/// The NaN that every operation gives.
pub const NAN: u32 = 0x7FC0_0000;

/// A number, or a zero of its sign if it is subnormal.
#[must_use]
pub fn flushed(bits: u32) -> u32 {
    if bits & EXPONENT == 0 { bits & SIGN } else { bits }
}

/// Whether the bits are a NaN's.
#[must_use]
pub fn is_nan(bits: u32) -> bool {
    bits & !SIGN > INFINITY
}

fn operand(bits: u32) -> Single {
    Single::from_bits(flushed(bits).into())
}

fn bits_of(number: Single) -> u32 {
    if number.is_nan() { NAN } else { (number.to_bits() & 0xFFFF_FFFF) as u32 }
}

/// The result of an operation: rounded already, on the grid of the subnormal numbers if it is one.
fn result(rounded: StatusAnd<Single>) -> u32 {
    flushed(bits_of(rounded.value))
}

/// Sum.
#[must_use]
pub fn add(a: u32, b: u32) -> u32 {
    result(operand(a) + operand(b))
}

/// Product.
#[must_use]
pub fn mul(a: u32, b: u32) -> u32 {
    result(operand(a) * operand(b))
}

/// Quotient.
#[must_use]
pub fn div(a: u32, b: u32) -> u32 {
    result(operand(a) / operand(b))
}

/// Square root, of an integer: `rustc_apfloat` has none.
#[must_use]
pub fn sqrt(a: u32) -> u32 {
    let a = flushed(a);
    if a & !SIGN == 0 {
        return a;
    }
    if is_nan(a) || a & SIGN != 0 {
        return NAN;
    }
    if a == INFINITY {
        return INFINITY;
    }
    // a = significand * 2^(2 half - 23), with an even power of two.
    let exponent = (a >> 23).cast_signed() - 127;
    let half = exponent.div_euclid(2);
    let significand = u64::from(a & FRACTION | 0x0080_0000) << exponent.rem_euclid(2);
    // 25 bits of root: one below the significand.
    let square = significand << 25;
    let root = square.isqrt();
    let above_half = root * root != square;
    let truncated = ((root >> 1) & 0x00FF_FFFF) as u32;
    let round_up = root & 1 == 1 && (above_half || truncated & 1 == 1);
    let biased = (half + 127).cast_unsigned();
    (biased << 23) + (truncated & FRACTION) + u32::from(round_up)
}

/// `a > b ? a : b`.
#[must_use]
pub fn max(a: u32, b: u32) -> u32 {
    flushed(if operand(a) > operand(b) { a } else { b })
}

/// `a < b ? a : b`.
#[must_use]
pub fn min(a: u32, b: u32) -> u32 {
    flushed(if operand(a) < operand(b) { a } else { b })
}

/// `a < b`.
#[must_use]
pub fn less(a: u32, b: u32) -> bool {
    operand(a) < operand(b)
}

/// Whether a number is not zero.
#[must_use]
pub fn nonzero(a: u32) -> bool {
    !operand(a).is_zero()
}

/// Sine and cosine: libm's, as the specification says.
#[must_use]
pub fn sincos(a: u32) -> (u32, u32) {
    let argument = f32::from_bits(flushed(a));
    let bits = |value: f32| if value.is_nan() { NAN } else { flushed(value.to_bits()) };
    (bits(libm::sinf(argument)), bits(libm::cosf(argument)))
}

/// Product with `SMALLEST_NORMAL` = 0.
#[must_use]
pub fn mul_unbounded(a: u32, b: u32) -> u32 {
    // Exact: 48 bits of significand.
    unbounded(double(a) * double(b))
}

/// Quotient with `SMALLEST_NORMAL` = 0.
#[must_use]
pub fn div_unbounded(a: u32, b: u32) -> u32 {
    // With more than twice 24 bits the first rounding does not disturb the second.
    unbounded(double(a) / double(b))
}

fn double(bits: u32) -> Double {
    operand(bits).convert(&mut false).value
}

/// Rounds as if the exponent had no lower end, then flushes.
fn unbounded(exact: StatusAnd<Double>) -> u32 {
    const RAISE: u32 = 64;
    let round = |value: Double| -> u32 {
        let single: StatusAnd<Single> = value.convert(&mut false);
        bits_of(single.value)
    };
    let rounded = round(exact.value);
    if rounded & EXPONENT > 1 << 23 || exact.value.is_zero() {
        return rounded;
    }
    let raised = round(exact.value.scalbn(RAISE.cast_signed()));
    if (raised & EXPONENT) >> 23 > RAISE { raised - (RAISE << 23) } else { raised & SIGN }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: u32 = 0x3F80_0000;
    const HALF: u32 = 0x3F00_0000;
    const TWO: u32 = 0x4000_0000;
    const SMALLEST: u32 = 0x0080_0000;

    #[test]
    fn subnormal_operands_are_zeros_of_their_sign() {
        let subnormal = SMALLEST - 1;
        assert_eq!(add(subnormal, ONE), ONE);
        assert_eq!(add(SIGN | subnormal, SIGN), SIGN);
        assert_eq!(mul(SIGN | subnormal, ONE), SIGN);
        assert_eq!(div(ONE, SIGN | subnormal), SIGN | INFINITY);
        assert_eq!(div(subnormal, subnormal), NAN);
        assert_eq!(sqrt(SIGN | subnormal), SIGN);
        assert_eq!(max(subnormal, SIGN), SIGN);
        assert_eq!(max(ONE, SIGN | ONE), ONE);
        assert_eq!(min(subnormal, ONE), 0);
        assert!(!less(SIGN | subnormal, 0));
        assert!(!nonzero(subnormal));
        assert_eq!(sincos(SIGN | subnormal), (SIGN, ONE));
    }

    #[test]
    fn subnormal_results_are_zeros_of_their_sign() {
        assert_eq!(mul(SMALLEST, SIGN | HALF), SIGN);
        assert_eq!(div(SIGN | SMALLEST, TWO), SIGN);
        assert_eq!(add(SMALLEST + 1, SIGN | SMALLEST), 0);
        assert_eq!(add(SIGN | (SMALLEST + 1), SMALLEST), SIGN);
    }

    #[test]
    fn rounding_on_the_subnormal_grid_may_reach_the_smallest_normal_number() {
        let ones = 0x00FF_FFFF;
        assert_eq!(mul(ones, HALF), SMALLEST);
        assert_eq!(div(SIGN | ones, TWO), SIGN | SMALLEST);
        assert_eq!(mul(ones - 1, HALF), 0);
        // Without that grid the result is exact, and below the smallest normal number.
        assert_eq!(mul_unbounded(ones, HALF), 0);
        assert_eq!(div_unbounded(SIGN | ones, TWO), SIGN);
        // 24 bits of significand round up to it in both.
        let (a, b) = (0x207F_FFFF, 0x1F80_0001);
        assert_eq!(mul(a, b), mul_unbounded(a, b));
    }

    /// A fraction of ones just below the smallest normal number is what `fmul` and `fdiv` look for.
    #[test]
    fn the_operators_rule_is_the_grids() {
        // Significands whose product is a little less than 2^47, hence 24 leading ones or nearly.
        for a in (0x0080_0001..0x0100_0000_u64).step_by(4_999) {
            let b = ((1 << 47) - 1) / a;
            let product = a * b;
            assert!(product >> 46 == 1);
            let x = (0x20 << 23) | (a & 0x007F_FFFF) as u32;
            let y = ((127 - 0x20) << 23) | (b & 0x007F_FFFF) as u32;
            let ones = product >> 23 == 0x00FF_FFFF;
            assert_eq!(mul(x, y), if ones { SMALLEST } else { 0 }, "{x:08x} {y:08x}");
        }
    }

    #[test]
    fn ties_go_to_the_even_number() {
        let ulp = 0x3400_0000;
        let half_ulp = 0x3380_0000;
        assert_eq!(add(ONE, half_ulp), ONE);
        assert_eq!(add(ONE + 1, half_ulp), ONE + 2);
        assert_eq!(add(ONE, ulp), ONE + 1);
        // (1 + 2^-12)^2 = 1 + 2^-11 + 2^-24.
        assert_eq!(mul(ONE + 0x800, ONE + 0x800), ONE + 0x1000);
    }

    #[test]
    fn every_nan_is_the_quiet_one() {
        let signalling = 0xFF80_0001;
        for found in [
            add(INFINITY, SIGN | INFINITY),
            add(ONE, signalling),
            mul(0, INFINITY),
            mul(signalling, ONE),
            div(0, 0),
            div(INFINITY, INFINITY),
            sqrt(SIGN | ONE),
            sqrt(signalling),
            mul_unbounded(signalling, ONE),
            sincos(INFINITY).0,
            sincos(signalling).1,
        ] {
            assert_eq!(found, NAN);
        }
    }

    #[test]
    fn comparisons_with_nan_give_the_second_operand() {
        let other = 0x7F80_0001;
        assert_eq!(max(NAN, ONE), ONE);
        assert_eq!(max(ONE, other), other);
        assert_eq!(min(NAN, ONE), ONE);
        assert_eq!(min(ONE, other), other);
        assert!(!less(NAN, ONE) && !less(ONE, NAN));
        assert!(nonzero(NAN));
    }

    #[test]
    fn equal_zeros_give_the_second_operand() {
        assert_eq!(max(0, SIGN), SIGN);
        assert_eq!(max(SIGN, 0), 0);
        assert_eq!(min(0, SIGN), SIGN);
        assert!(!less(SIGN, 0));
    }

    #[test]
    fn square_roots_are_those_of_the_standard_library() {
        // Its square root is correctly rounded everywhere.
        for bits in (SMALLEST..INFINITY).step_by(9_973) {
            assert_eq!(sqrt(bits), f32::from_bits(bits).sqrt().to_bits(), "{bits:08x}");
        }
    }

    #[test]
    fn results_above_the_largest_number_are_infinite() {
        let largest = INFINITY - 1;
        assert_eq!(add(largest, largest), INFINITY);
        assert_eq!(mul(SIGN | largest, TWO), SIGN | INFINITY);
        assert_eq!(div(largest, SMALLEST), INFINITY);
        assert_eq!(mul_unbounded(largest, largest), INFINITY);
    }
}
