//! This file computes with the four words of a beat at once.
//!
//! Every x86-64 and every aarch64 has the instructions. Written as loops over four words the compiler
//! finds them only now and then.
#![allow(unsafe_code, reason = "instructions of a processor, and vectors of aarch64 are cast")]

use bitstream_model::interface::record::{Beat, LANES};

#[cfg(target_arch = "aarch64")]
use core::arch::aarch64 as arch;
#[cfg(target_arch = "x86_64")]
use core::arch::x86_64 as arch;

#[cfg(target_arch = "x86_64")]
type Vector = arch::__m128i;
#[cfg(target_arch = "aarch64")]
type Vector = arch::uint32x4_t;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
type Vector = [u32; LANES];
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
use std::ops::{BitAnd as _, BitOr as _};

/// One instruction for all four words, or the same word by word.
macro_rules! each {
    ($x86:ident, $arm:ident, $word:expr, $one:expr, $other:expr) => {{
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instruction.
        let vector = unsafe { arch::$x86($one.0, $other.0) };
        #[cfg(target_arch = "aarch64")]
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let vector = unsafe { arch::$arm($one.0, $other.0) };
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let vector = std::array::from_fn(|k| $word($one.0[k], $other.0[k]));
        Self(vector)
    }};
}

/// The four words of a beat.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes(Vector);

impl Lanes {
    /// These words.
    #[inline(always)]
    pub(crate) fn new(words: [u32; LANES]) -> Self {
        #[cfg(not(target_arch = "aarch64"))]
        let vector = bytemuck::cast(words);
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the vector is four u32, of any bits.
        let vector = unsafe { std::mem::transmute::<[u32; LANES], Vector>(words) };
        Self(vector)
    }

    /// The same word four times.
    #[inline(always)]
    pub(crate) fn all(word: u32) -> Self {
        Self::new([word; LANES])
    }

    /// As words.
    #[inline(always)]
    pub(crate) fn words(self) -> [u32; LANES] {
        #[cfg(not(target_arch = "aarch64"))]
        return bytemuck::cast(self.0);
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the vector is four u32.
        return unsafe { std::mem::transmute::<Vector, [u32; LANES]>(self.0) };
    }

    /// Word by word, modulo 2^32.
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        each!(_mm_add_epi32, vaddq_u32, u32::wrapping_add, self, other)
    }

    /// The bits that both have.
    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        each!(_mm_and_si128, vandq_u32, u32::bitand, self, other)
    }

    /// All bits of each word that is greater than the other's, as signed integers.
    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instruction.
        return Self(unsafe { arch::_mm_cmpgt_epi32(self.0, other.0) });
        #[cfg(not(target_arch = "x86_64"))]
        return Self::new(std::array::from_fn(|k| {
            let [one, other] = [self, other].map(|lanes| lanes.words()[k].cast_signed());
            if one > other { u32::MAX } else { 0 }
        }));
    }

    /// Differences of f32, rounded to nearest even.
    #[inline(always)]
    pub(crate) fn minus_f32(self, other: Self) -> Self {
        let [one, other] = [self, other].map(|lanes| lanes.words().map(f32::from_bits));
        Self::new(std::array::from_fn(|k| (one[k] - other[k]).to_bits()))
    }

    /// The bits that either has.
    #[inline(always)]
    pub(crate) fn or(self, other: Self) -> Self {
        each!(_mm_or_si128, vorrq_u32, u32::bitor, self, other)
    }
}

impl From<Beat> for Lanes {
    #[inline(always)]
    fn from(beat: Beat) -> Self {
        Self::new(beat.0)
    }
}

impl From<Lanes> for Beat {
    #[inline(always)]
    fn from(lanes: Lanes) -> Self {
        Self(lanes.words())
    }
}
