//! SIMD lanes for every processor: an array, left to the compiler.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::block::Words;
use super::{Lanes, Mask, Numbers, Quad, Work, quad};
use crate::accelerator::arithmetic::sixteen;

/// Four lanes of no instructions in particular.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

/// A number in each of four lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Four([f32; 4]);

/// Yes or no in each of four lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FourMask([bool; 4]);

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Four {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut result = self.0;
                for (a, b) in result.iter_mut().zip(other.0) {
                    *a = $operator::$method(*a, b);
                }
                Self(result)
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl Neg for Four {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|number| -number))
    }
}

impl Four {
    #[inline(always)]
    fn compared(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> FourMask {
        let mut mask = [false; 4];
        for (lane, yes) in mask.iter_mut().enumerate() {
            *yes = holds(self.0[lane], other.0[lane]);
        }
        FourMask(mask)
    }
}

impl Numbers for Four {
    type Mask = FourMask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    fn above(self, other: Self) -> FourMask {
        self.compared(other, |a, b| a > b)
    }

    #[inline(always)]
    fn is_zero(self) -> FourMask {
        self.compared(self, |a, _| a == 0.0)
    }

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
        let either = |lane: usize| if mask.0[lane] { self.0[lane] } else { other.0[lane] };
        Self(std::array::from_fn(either))
    }

    #[inline(always)]
    fn to_binary16(self) -> Self {
        Self(self.0.map(sixteen::round))
    }

    #[inline(always)]
    fn with_words(self, other: Self) -> Self {
        let sum = |lane: usize| self.0[lane].to_bits().wrapping_add(other.0[lane].to_bits());
        Self(std::array::from_fn(|lane| f32::from_bits(sum(lane))))
    }
}

impl Mask for FourMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] & other.0[lane]))
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] | other.0[lane]))
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] & !other.0[lane]))
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        let [a, b, c, d] = self.0.map(u32::from);
        a | b << 1 | c << 2 | d << 3
    }
}

/// Rows for columns.
#[inline(always)]
fn transposed(rows: [[f32; 4]; 4]) -> [Four; 4] {
    let [a, b, c, d] = rows;
    [0, 1, 2, 3].map(|word| Four([a[word], b[word], c[word], d[word]]))
}

impl Lanes for Portable {
    type Numbers = Four;
    type Mask = FourMask;

    const WIDTH: usize = 4;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        work.with(self);
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Four {
        Four([number; 4])
    }

    #[inline(always)]
    fn load(self, words: &Words, at: usize) -> Four {
        Four([words[at], words[at + 1], words[at + 2], words[at + 3]])
    }

    #[inline(always)]
    fn store(self, numbers: Four, words: &mut Words, at: usize) {
        words[at..at + 4].copy_from_slice(&numbers.0);
    }

    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "they are small")]
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Four {
        Four(std::array::from_fn(|lane| (words[at + lane] & mask) as f32))
    }

    #[inline(always)]
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> FourMask {
        FourMask(std::array::from_fn(|lane| words[at + lane] & bit != 0))
    }

    #[inline(always)]
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Four; 4] {
        let mut rows = [[0.0; 4]; 4];
        for (lane, row) in rows.iter_mut().enumerate() {
            // SAFETY: the caller promises it.
            let quad = unsafe { quad(quads, index, at + lane, half) };
            // SAFETY: the caller promises that it can be read.
            *row = unsafe { *quad };
        }
        transposed(rows)
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        numbers: [Four; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) {
        let rows = transposed(numbers.map(|numbers| numbers.0));
        for (lane, row) in rows.into_iter().enumerate() {
            // SAFETY: the caller promises it.
            let quad = unsafe { quad(quads, index, at + lane, half) };
            // SAFETY: the caller promises that it can be written.
            unsafe { *quad.cast_mut() = row.0 };
        }
    }

    #[inline(always)]
    fn transposed(self, quads: &[Quad], stride: usize) -> [Four; 4] {
        transposed(std::array::from_fn(|lane| quads[lane * stride]))
    }

    #[inline(always)]
    fn spread(self, numbers: [Four; 4], quads: &mut [Quad], stride: usize) {
        let rows = transposed(numbers.map(|numbers| numbers.0));
        for (lane, row) in rows.into_iter().enumerate() {
            quads[lane * stride] = row.0;
        }
    }
}
