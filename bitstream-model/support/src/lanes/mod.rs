//! Sixteen numbers side by side, computed together by the SIMD instructions of a processor.
//!
//! Every operation is written lane by lane in plain Rust, and each lane has the bits of the same
//! operation on one f32: one rounding, subnormals kept, nothing contracted. The numbers lie in a
//! vector register type, from which the compiler sees that the sixteen operations are one: so the
//! code has no intrinsics for arithmetic and is the same for every processor. The exceptions are
//! operations for which the compiler finds no good instructions: [`Instructions`] has them.
//!
//! ```text
//! Work ── InstructionSet::run ──> the work, compiled for AVX-512, for AVX2, or for the target
//! ```
//!
//! [`InstructionSet::run`] enables the instructions around some [`Work`]. All between must be
//! `#[inline(always)]`: a function that is called apart is compiled for the target alone.

mod halves;
mod instructions;
#[cfg(test)]
mod tests;

use std::array;
use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};

pub use instructions::{InstructionSet, Instructions, Quad, Work, prefetch};

/// Number of lanes.
pub const LANES: usize = 16;

/// A register type as wide as the lanes; a narrower processor uses several registers.
#[cfg(target_arch = "x86_64")]
type Register = std::arch::x86_64::__m512;
#[cfg(target_arch = "aarch64")]
type Register = [std::arch::aarch64::float32x4_t; LANES / 4];
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
type Register = [f32; LANES];

/// An f32 in each lane.
#[derive(Clone, Copy)]
pub struct F32x16(Register);

/// A truth value in each lane: all bits are set, or none.
#[derive(Clone, Copy)]
pub struct Mask(Register);

/// An array with the values of a function of the lane.
#[inline(always)]
fn each<T: Copy + Default>(value: impl Fn(usize) -> T) -> [T; LANES] {
    let mut values = [T::default(); LANES];
    let mut lane = 0;
    // `array::from_fn` would be a function apart.
    while lane < LANES {
        values[lane] = value(lane);
        lane += 1;
    }
    values
}

impl F32x16 {
    /// The same number in each lane.
    #[inline(always)]
    #[must_use]
    pub fn splat(number: f32) -> Self {
        Self::from_array([number; LANES])
    }

    /// The numbers of an array, the first in lane 0.
    #[inline(always)]
    #[must_use]
    pub fn from_array(numbers: [f32; LANES]) -> Self {
        Self(bytemuck::cast(numbers))
    }

    /// The numbers in the order of the lanes.
    #[inline(always)]
    #[must_use]
    pub fn to_array(self) -> [f32; LANES] {
        bytemuck::cast(self.0)
    }

    /// A function of the lane.
    #[inline(always)]
    #[must_use]
    pub fn from_fn(number: impl Fn(usize) -> f32) -> Self {
        Self::from_array(each(number))
    }

    /// A function of each number.
    #[inline(always)]
    #[must_use]
    pub fn map(self, function: impl Fn(f32) -> f32) -> Self {
        let numbers = self.to_array();
        Self::from_fn(|lane| function(numbers[lane]))
    }

    /// A function of each number and the other's of its lane.
    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(f32, f32) -> f32) -> Self {
        let (numbers, others) = (self.to_array(), other.to_array());
        Self::from_fn(|lane| function(numbers[lane], others[lane]))
    }

    /// Whether each number and the other's of its lane satisfy a condition.
    #[inline(always)]
    fn test(self, other: Self, condition: impl Fn(f32, f32) -> bool) -> Mask {
        let (numbers, others) = (self.to_array(), other.to_array());
        Mask::from_fn(|lane| condition(numbers[lane], others[lane]))
    }

    /// The square root.
    #[inline(always)]
    #[must_use]
    pub fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    /// The absolute value.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        self.map(f32::abs)
    }

    /// The magnitude of this number with the sign of another one, also of a zero.
    #[inline(always)]
    #[must_use]
    pub fn with_sign(self, other: Self) -> Self {
        self.zip(other, f32::copysign)
    }

    /// Whether it is larger; false for a NaN.
    #[inline(always)]
    #[must_use]
    pub fn above(self, other: Self) -> Mask {
        self.test(other, |a, b| a > b)
    }

    /// Whether it is larger or equal; false for a NaN.
    #[inline(always)]
    #[must_use]
    pub fn at_least(self, other: Self) -> Mask {
        self.test(other, |a, b| a >= b)
    }

    /// Whether it is equal, as both zeros are; false for a NaN.
    #[inline(always)]
    #[must_use]
    #[expect(clippy::float_cmp, reason = "equality is what is asked for")]
    pub fn is(self, other: Self) -> Mask {
        self.test(other, |a, b| a == b)
    }

    /// `if a > b then a else b`: the second of two zeros, and beside a NaN.
    #[inline(always)]
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// `if a < b then a else b`: the second of two zeros, and beside a NaN.
    #[inline(always)]
    #[must_use]
    pub fn smaller(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    /// Selects these lanes where the mask is set, and `other` elsewhere.
    #[inline(always)]
    #[must_use]
    pub fn or(self, mask: Mask, other: Self) -> Self {
        // On the bits: the compiler would make branches of a condition.
        let mask = mask.words();
        let (numbers, others) = (self.to_array(), other.to_array());
        Self::from_fn(|lane| {
            let (own, other) = (numbers[lane].to_bits(), others[lane].to_bits());
            f32::from_bits(own & mask[lane] | other & !mask[lane])
        })
    }

    /// The sums of the words as whole numbers, which wrap.
    #[inline(always)]
    #[must_use]
    pub fn with_words(self, other: Self) -> Self {
        self.zip(other, |a, b| f32::from_bits(a.to_bits().wrapping_add(b.to_bits())))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for F32x16 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| $operator::$method(a, b))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl Neg for F32x16 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|number| -number)
    }
}

impl fmt::Debug for F32x16 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.to_array().fmt(f)
    }
}

impl Mask {
    /// No lane.
    #[inline(always)]
    #[must_use]
    pub fn none() -> Self {
        Self::from_words([0; LANES])
    }

    /// Whether a function of the lane is true.
    #[inline(always)]
    #[must_use]
    pub fn from_fn(is_set: impl Fn(usize) -> bool) -> Self {
        Self::from_words(each(|lane| if is_set(lane) { u32::MAX } else { 0 }))
    }

    /// One bit per lane, lane 0 in bit 0.
    #[inline(always)]
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        Self::from_fn(|lane| bits & 1 << lane != 0)
    }

    #[inline(always)]
    fn from_words(words: [u32; LANES]) -> Self {
        Self(bytemuck::cast(words))
    }

    #[inline(always)]
    fn words(self) -> [u32; LANES] {
        bytemuck::cast(self.0)
    }

    /// A function of the words of two masks.
    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(u32, u32) -> u32) -> Self {
        let (words, others) = (self.words(), other.words());
        Self::from_words(each(|lane| function(words[lane], others[lane])))
    }

    /// Set where both are.
    #[inline(always)]
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        self.zip(other, |a, b| a & b)
    }

    /// Set where one of both is.
    #[inline(always)]
    #[must_use]
    pub fn either(self, other: Self) -> Self {
        self.zip(other, |a, b| a | b)
    }

    /// Set where `self` is set and `other` is not.
    #[inline(always)]
    #[must_use]
    pub fn without(self, other: Self) -> Self {
        self.zip(other, |a, b| a & !b)
    }

    /// Whether a lane is set.
    #[inline(always)]
    #[must_use]
    pub fn any(self) -> bool {
        self.words().iter().fold(0, |all, word| all | word) != 0
    }

    /// Whether every lane is set.
    #[inline(always)]
    #[must_use]
    pub fn all(self) -> bool {
        self.words().iter().fold(u32::MAX, |all, word| all & word) != 0
    }

    /// One bit per lane, lane 0 in bit 0. Takes longer than [`any`](Self::any) and
    /// [`all`](Self::all).
    #[inline(always)]
    #[must_use]
    pub fn bits(self) -> u32 {
        let bits = array::from_fn::<u32, LANES, _>(|lane| 1 << lane);
        self.words().iter().zip(bits).fold(0, |all, (word, bit)| all | word & bit)
    }
}

impl fmt::Debug for Mask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Mask({:#06x})", self.bits())
    }
}
