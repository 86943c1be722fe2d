//! This folder is the lanes of a processor: numbers side by side, each with the bits of an f32 that is
//! computed alone, one rounding an operation.
//!
//! Numbers are made of numbers, and the first ones by a value of a [`Lanes`] type, which there is only
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

/// Most lanes that there are.
pub(super) const LANES_MAX: usize = 8;

/// Numbers in memory; those beyond the lanes are left alone.
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
    /// Yes or no in each lane.
    type Mask: Mask;

    /// This number in each lane, whatever is in them now.
    fn all(self, number: f32) -> Self;

    /// What the lanes hold.
    fn row(self) -> Row;

    /// The numbers of a row, whatever is in the lanes now.
    fn of_row(self, row: &Row) -> Self;

    fn sqrt(self) -> Self;

    /// Without its sign.
    fn abs(self) -> Self;

    /// With the sign of another number, that of a zero too.
    fn with_sign(self, other: Self) -> Self;

    /// Whether it is larger; no beside a NaN.
    fn above(self, other: Self) -> Self::Mask;

    /// Whether it is larger or the same; no beside a NaN.
    fn at_least(self, other: Self) -> Self::Mask;

    /// Whether it is the same, as both zeros are; no beside a NaN.
    fn is(self, other: Self) -> Self::Mask;

    /// These where the mask says yes, and `other` elsewhere.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
}

/// Yes or no in each lane.
pub(super) trait Mask: Copy {
    fn and(self, other: Self) -> Self;

    fn either(self, other: Self) -> Self;

    /// This one where the other says no.
    fn without(self, other: Self) -> Self;

    /// A bit for each lane, the first in bit 0.
    fn bits(self) -> u32;
}

/// Yes in the lanes of these bits, whatever number `any` is.
#[inline(always)]
pub(super) fn mask<N: Numbers>(any: N, bits: u32) -> N::Mask {
    let mut row = Row::default();
    for (lane, number) in row.0.iter_mut().enumerate() {
        *number = if bits >> lane & 1 != 0 { 1.0 } else { 0.0 };
    }
    any.of_row(&row).above(any.all(0.0))
}

/// What runs with lanes.
pub(super) trait Work {
    fn with<L: Lanes>(self, lanes: L);
}

/// The lanes of a processor.
pub(super) trait Lanes: Copy {
    type Numbers: Numbers;
    /// How many there are.
    const WIDTH: usize;

    /// Runs something with these instructions enabled.
    fn run<W: Work>(self, work: W);

    /// The numbers of a row.
    fn load(self, row: &Row) -> Self::Numbers;
}

/// Runs something with the widest lanes that the processor has.
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

    /// Every operation on every two samples, in every lane.
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

    /// The bits of a number, of any NaN the same ones: their sign differs from one processor to the
    /// next.
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
