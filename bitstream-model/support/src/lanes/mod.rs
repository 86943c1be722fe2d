//! Numbers side by side, computed together by the SIMD instructions of a processor: sixteen on
//! x86-64, four on aarch64, where a register holds no more and sixteen would be spilled.
//!
//! Each lane has the bits of the same operation on one f32: one rounding, subnormals kept, nothing
//! contracted. A set that rounds to binary16 rounds once more: of binary16 numbers that is the
//! binary16 operation. [`Instructions`] writes every operation lane by lane; a set of instructions
//! overrides the operations for which it has one.
//!
//! ```text
//! Work ── InstructionSet::run ──> the work, compiled for AVX-512, for AVX2, or for the target
//! ```
//!
//! [`InstructionSet::run`] enables the instructions around some [`Work`]. All between must be
//! `#[inline(always)]`: a function that is called apart is compiled for the target alone.

#[cfg(target_arch = "aarch64")]
mod aarch64;
mod instruction_set;
mod instructions;
#[cfg(test)]
mod tests;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};

pub use instruction_set::InstructionSet;
pub use instructions::{Instructions, Quad, Work, prefetch};

/// Number of lanes.
pub const LANES: usize = if cfg!(target_arch = "aarch64") { 4 } else { 16 };

/// One bit for each lane, lane 0 in bit 0.
pub const ALL: u32 = (1 << LANES) - 1;

/// An f32 in each lane, and the instructions that compute with them.
#[derive(Clone, Copy)]
pub struct F32s<I: Instructions>(I::Register, I);

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

impl<I: Instructions> F32s<I> {
    /// The same number in each lane.
    #[inline(always)]
    #[must_use]
    pub fn splat(instructions: I, number: f32) -> Self {
        Self(instructions.rounded(instructions.splat(number)), instructions)
    }

    /// The same number in each lane, for the same instructions.
    #[inline(always)]
    #[must_use]
    pub fn like(self, number: f32) -> Self {
        Self::splat(self.1, number)
    }

    /// The numbers of an array, the first in lane 0.
    #[inline(always)]
    #[must_use]
    pub fn from_array(instructions: I, numbers: &[f32; LANES]) -> Self {
        Self(instructions.load(numbers), instructions)
    }

    /// The numbers in the order of the lanes.
    #[inline(always)]
    #[must_use]
    pub fn to_array(self) -> [f32; LANES] {
        self.1.store(self.0)
    }

    /// One quad for each lane, by their places in it.
    #[inline(always)]
    #[must_use]
    pub fn columns(instructions: I, quad: impl Fn(usize) -> Quad) -> [Self; 4] {
        instructions.columns(quad).map(|register| Self(register, instructions))
    }

    /// Reads a row of two quads for each lane, by their places in it.
    ///
    /// # Safety
    ///
    /// The rows that the indices name exist from `rows` on, and no other thread writes them during
    /// the call.
    #[inline(always)]
    #[must_use]
    pub unsafe fn gather(
        instructions: I,
        rows: *const [Quad; 2],
        indices: &[u32; LANES],
    ) -> [Self; 8] {
        // SAFETY: the caller promises it.
        let registers = unsafe { instructions.gather(rows, indices) };
        registers.map(|register| Self(register, instructions))
    }

    /// Writes a row of two quads for each lane, lane after lane.
    ///
    /// # Safety
    ///
    /// The rows that the indices name exist from `rows` on, and no other thread accesses them
    /// during the call.
    #[inline(always)]
    pub unsafe fn scatter(columns: [Self; 8], rows: *mut [Quad; 2], indices: &[u32; LANES]) {
        let [Self(_, instructions), ..] = columns;
        // SAFETY: the caller promises it.
        unsafe { instructions.scatter(columns.map(|column| column.0), rows, indices) };
    }

    /// The square root.
    #[inline(always)]
    #[must_use]
    pub fn sqrt(self) -> Self {
        Self(self.1.rounded(self.1.sqrt(self.0)), self.1)
    }

    /// The absolute value.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        Self(self.1.abs(self.0), self.1)
    }

    /// One bit per lane: it is larger; not a NaN.
    #[inline(always)]
    #[must_use]
    pub fn above(self, other: Self) -> u32 {
        self.1.above(self.0, other.0)
    }

    /// One bit per lane: it is equal, as both zeros are; not a NaN.
    #[inline(always)]
    #[must_use]
    pub fn is(self, other: Self) -> u32 {
        self.1.is(self.0, other.0)
    }

    /// `if a > b then a else b`: the second of two zeros, and beside a NaN.
    #[inline(always)]
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        Self(self.1.larger(self.0, other.0), self.1)
    }

    /// `if a < b then a else b`: the second of two zeros, and beside a NaN.
    #[inline(always)]
    #[must_use]
    pub fn smaller(self, other: Self) -> Self {
        Self(self.1.smaller(self.0, other.0), self.1)
    }

    /// Selects the lanes whose bits are set, and the lanes of `other` elsewhere.
    #[inline(always)]
    #[must_use]
    pub fn or(self, bits: u32, other: Self) -> Self {
        Self(self.1.select(bits, self.0, other.0), self.1)
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<I: Instructions> $operator for F32s<I> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.1.rounded(self.1.$method(self.0, other.0)), self.1)
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl<I: Instructions> Neg for F32s<I> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.1.neg(self.0), self.1)
    }
}

impl<I: Instructions> fmt::Debug for F32s<I> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.to_array().fmt(f)
    }
}
