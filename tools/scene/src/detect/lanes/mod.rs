//! The lanes of a processor: numbers side by side, each with the bits of an f32 that is computed
//! alone, with one rounding per operation.
//!
//! Numbers are made from numbers. A value of a [`Lanes`] type makes the first ones, and exists only
//! where the processor has its instructions.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;
mod vector;

use std::ops::{Add, Div, Mul, Neg, Sub};

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;
pub(super) use portable::Portable;
pub(super) use vector::{Rotation, Vector};

/// The largest width of all lanes.
pub(super) const LANES_MAX: usize = 8;

/// Numbers in memory; a narrower processor uses the first ones only.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
pub(super) struct Row(pub(super) [f32; LANES_MAX]);

/// One number in each lane.
pub(super) trait Numbers:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A truth value in each lane.
    type Mask: Mask;

    /// The given number in each lane; `self` serves only as proof of the instructions.
    fn all(self, number: f32) -> Self;

    /// Stores the lanes.
    fn row(self) -> Row;

    /// Loads the numbers of a row; `self` serves only as proof of the instructions.
    fn of_row(self, row: &Row) -> Self;

    fn sqrt(self) -> Self;

    /// The absolute value.
    fn abs(self) -> Self;

    /// The magnitude of this number with the sign of another one, also of a zero.
    fn with_sign(self, other: Self) -> Self;

    /// Whether it is larger; false for a NaN.
    fn above(self, other: Self) -> Self::Mask;

    /// Whether it is larger or equal; false for a NaN.
    fn at_least(self, other: Self) -> Self::Mask;

    /// Whether it is equal, as both zeros are; false for a NaN.
    fn is(self, other: Self) -> Self::Mask;

    /// Selects these lanes where the mask is set, and `other` elsewhere.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
}

/// A truth value in each lane.
pub(super) trait Mask: Copy {
    fn and(self, other: Self) -> Self;

    fn either(self, other: Self) -> Self;

    /// Set where `self` is set and `other` is not.
    fn without(self, other: Self) -> Self;

    /// One bit per lane, lane 0 in bit 0.
    fn bits(self) -> u32;
}

/// A mask with these bits set; `any` serves only as proof of the instructions.
#[inline(always)]
pub(super) fn mask<N: Numbers>(any: N, bits: u32) -> N::Mask {
    let mut row = Row::default();
    for (lane, number) in row.0.iter_mut().enumerate() {
        *number = if bits >> lane & 1 != 0 { 1.0 } else { 0.0 };
    }
    any.of_row(&row).above(any.all(0.0))
}

/// Code that is generic over lanes.
pub(super) trait Work {
    fn with<L: Lanes>(self, lanes: L);
}

/// The lanes of a processor.
pub(super) trait Lanes: Copy {
    type Numbers: Numbers;
    /// The number of lanes.
    const WIDTH: usize;

    /// Runs code with these instructions enabled.
    fn run<W: Work>(self, work: W);

    /// Loads the numbers of a row.
    fn load(self, row: &Row) -> Self::Numbers;
}

/// Runs code with the widest lanes of the processor.
pub(super) fn run<W: Work>(work: W) {
    #[cfg(target_arch = "x86_64")]
    if let Some(lanes) = Avx2::found() {
        return lanes.run(work);
    }
    Portable.run(work);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: [f32; 11] = [
        0.0,
        -0.0,
        1.0,
        -1.5,
        0.1,
        1e-40,
        -3e38,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        16_777_216.0,
    ];

    /// Tests every operation on every two samples, in every lane.
    struct Check;

    impl Work for Check {
        fn with<L: Lanes>(self, lanes: L) {
            for shift in 0..SAMPLES.len() {
                for other in SAMPLES {
                    let mut row = Row::default();
                    for (lane, number) in row.0.iter_mut().enumerate() {
                        *number = SAMPLES[(lane + shift) % SAMPLES.len()];
                    }
                    check(lanes, &row, other);
                }
            }
        }
    }

    /// The bits of a number; the same bits for every NaN, since its sign differs between
    /// processors.
    fn bits(number: f32) -> u32 {
        if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() }
    }

    type OfTwo<R> = fn(f32, f32) -> R;

    #[allow(clippy::float_cmp, reason = "that is what is compared")]
    fn check<L: Lanes>(lanes: L, row: &Row, other: f32) {
        let a = lanes.load(row);
        let b = a.all(other);
        let numbers: [(L::Numbers, OfTwo<f32>); 9] = [
            (a + b, |a, b| a + b),
            (a - b, |a, b| a - b),
            (a * b, |a, b| a * b),
            (a / b, |a, b| a / b),
            (-a, |a, _| -a),
            (a.sqrt(), |a, _| a.sqrt()),
            (a.abs(), |a, _| a.abs()),
            (a.with_sign(b), f32::copysign),
            (a.or(a.above(b), b), |a, b| if a > b { a } else { b }),
        ];
        let masks: [(<L::Numbers as Numbers>::Mask, OfTwo<bool>); 6] = [
            (a.above(b), |a, b| a > b),
            (a.at_least(b), |a, b| a >= b),
            (a.is(b), |a, b| a == b),
            (a.above(b).either(a.is(b)), |a, b| a >= b),
            (a.at_least(b).and(b.at_least(a)), |a, b| a == b),
            (a.at_least(b).without(a.is(b)), |a, b| a > b),
        ];
        for (lane, number) in row.0.iter().enumerate().take(L::WIDTH) {
            for (operation, (found, expected)) in numbers.iter().enumerate() {
                let (found, expected) = (found.row().0[lane], expected(*number, other));
                assert_eq!(bits(found), bits(expected), "{operation} of {number} and {other}");
            }
            for (operation, (found, expected)) in masks.iter().enumerate() {
                let (found, expected) = (found.bits() >> lane & 1 != 0, expected(*number, other));
                assert_eq!(found, expected, "mask {operation} of {number} and {other}");
            }
        }
        assert!(masks.iter().all(|(mask, _)| mask.bits() >> L::WIDTH == 0));
        for bits in 0..1 << L::WIDTH {
            assert_eq!(mask(a, bits).bits(), bits);
        }
    }

    #[test]
    fn every_lane_computes_what_a_number_alone_does() {
        Portable.run(Check);
        #[cfg(target_arch = "x86_64")]
        if let Some(lanes) = Avx2::found() {
            lanes.run(Check);
        }
    }
}
