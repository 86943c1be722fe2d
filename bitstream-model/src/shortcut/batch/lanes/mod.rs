//! The operations of a processor's SIMD lanes. Each gives the bits of the same operation in
//! `number.rs`, with one rounding.
//!
//! A value of a [`Lanes`] type proves that the processor has its instructions, and numbers are made
//! by one only.

#![allow(
    unsafe_code,
    reason = "instructions of a processor, and rows that several threads reach by pointers"
)]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(all(target_arch = "x86_64", avx512))]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
mod rounded;

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::block::Words;

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
#[cfg(all(target_arch = "x86_64", avx512))]
pub(crate) use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub(crate) use neon::Neon;
pub(crate) use portable::Portable;
pub(crate) use rounded::Computed;

/// Four numbers in memory: half a row of velocities, or a beat.
pub(crate) type Quad = [f32; 4];

/// One number in each lane.
pub(crate) trait Numbers:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Yes or no in each lane.
    type Mask: Mask;

    fn sqrt(self) -> Self;

    /// Without its sign.
    fn abs(self) -> Self;

    /// Whether it is larger; no beside a NaN.
    fn above(self, other: Self) -> Self::Mask;

    /// Whether it is a zero of either sign.
    fn is_zero(self) -> Self::Mask;

    /// `if a > b then a else b`.
    fn larger(self, other: Self) -> Self;

    /// `if a < b then a else b`.
    fn smaller(self, other: Self) -> Self;

    /// These where the mask says yes, and `other` elsewhere.
    fn or(self, mask: Self::Mask, other: Self) -> Self;

    /// The binary16 numbers nearest to them; of two the even one.
    fn to_binary16(self) -> Self;

    /// Their words added as whole numbers that wrap.
    fn with_words(self, other: Self) -> Self;
}

/// Yes or no in each lane.
pub(crate) trait Mask: Copy {
    fn and(self, other: Self) -> Self;
    fn either(self, other: Self) -> Self;
    /// This one where the other says no.
    fn without(self, other: Self) -> Self;
    /// A bit for each lane, the first in bit 0.
    fn bits(self) -> u32;
}

/// What runs with lanes.
pub(crate) trait Work {
    fn with<L: Lanes>(self, lanes: L);
}

/// The lanes of a processor.
pub(crate) trait Lanes: Copy + Debug {
    type Numbers: Numbers<Mask = Self::Mask>;
    type Mask: Mask;
    /// How many there are.
    const WIDTH: usize;

    /// Runs something with these instructions enabled.
    fn run<W: Work>(self, work: W);

    /// The same number in each lane.
    fn splat(self, number: f32) -> Self::Numbers;

    /// Words from `at` on.
    fn load(self, words: &Words, at: usize) -> Self::Numbers;

    /// Sets the words from `at` on.
    fn store(self, numbers: Self::Numbers, words: &mut Words, at: usize);

    /// Small counts in the words from `at` on, under a mask of bits.
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Self::Numbers;

    /// Whether the words from `at` on have a bit set.
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> Self::Mask;

    /// The numbers of one quad for each lane, by their place in it: quad `index[at + lane] * 2 +
    /// half` from `quads` on.
    ///
    /// # Safety
    ///
    /// These quads can be read, and nobody writes them at the same time.
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Self::Numbers; 4];

    /// Writes one quad for each lane, in the order of the lanes.
    ///
    /// # Safety
    ///
    /// These quads can be written, and nobody else accesses them at the same time.
    unsafe fn scatter(
        self,
        numbers: [Self::Numbers; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    );

    /// The numbers of one quad for each lane, `stride` quads apart, by their place in it.
    /// `quads` reaches to the last lane's.
    fn transposed(self, quads: &[Quad], stride: usize) -> [Self::Numbers; 4];

    /// Sets one quad for each lane, `stride` quads apart. `quads` reaches to the last lane's.
    fn spread(self, numbers: [Self::Numbers; 4], quads: &mut [Quad], stride: usize);
}

/// Where the quad of a lane is.
///
/// # Safety
///
/// It lies in the memory that `quads` points to.
#[inline(always)]
unsafe fn quad(quads: *const Quad, index: &Words<u32>, lane: usize, half: usize) -> *const Quad {
    // SAFETY: the caller promises it.
    unsafe { quads.add(index[lane] as usize * 2 + half) }
}

/// Asks for a value that is used soon, where the processor can be asked.
#[inline(always)]
pub(crate) fn prefetch<T>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let line = value.cast::<i8>().wrapping_add(line);
        // SAFETY: the instruction is of SSE and reads nothing: any address will do.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
