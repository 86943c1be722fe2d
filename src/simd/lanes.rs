//! Computes with the four words of a beat at once.
//!
//! Every x86-64 and every aarch64 has the instructions. The compiler rarely finds them in loops
//! over four words.
#![allow(unsafe_code, reason = "instructions of a processor, and vectors of aarch64 are cast")]

use pgs_interface::record::{Beat, LANES};

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
use std::ops::{Add as _, BitAnd as _, BitOr as _, Mul as _, Sub as _};

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

/// One instruction for all four words as f32, or the same word by word.
macro_rules! each_f32 {
    ($x86:ident, $arm:ident, $number:expr, $one:expr, $other:expr) => {{
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instructions, which compute or take one register for
        // another.
        let vector = unsafe {
            let [one, other] = [$one.0, $other.0].map(|vector| arch::_mm_castsi128_ps(vector));
            arch::_mm_castps_si128(arch::$x86(one, other))
        };
        #[cfg(target_arch = "aarch64")]
        // SAFETY: every aarch64 that Linux runs on has the instructions, which compute or take one
        // register for another.
        let vector = unsafe {
            let [one, other] = [$one.0, $other.0].map(|vector| arch::vreinterpretq_f32_u32(vector));
            arch::vreinterpretq_u32_f32(arch::$arm(one, other))
        };
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let vector = {
            let [one, other] = [$one, $other].map(|lanes| lanes.0.map(f32::from_bits));
            std::array::from_fn(|k| $number(one[k], other[k]).to_bits())
        };
        Self(vector)
    }};
}

/// The four words of a beat.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes(pub(crate) Vector);

impl Lanes {
    /// Takes four words.
    #[inline(always)]
    pub(crate) fn new(words: [u32; LANES]) -> Self {
        #[cfg(not(target_arch = "aarch64"))]
        let vector = bytemuck::cast(words);
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the vector is four u32, of any bits.
        let vector = unsafe { std::mem::transmute::<[u32; LANES], Vector>(words) };
        Self(vector)
    }

    /// The same word in all four lanes.
    #[inline(always)]
    pub(crate) fn all(word: u32) -> Self {
        Self::new([word; LANES])
    }

    /// The four words.
    #[inline(always)]
    pub(crate) fn words(self) -> [u32; LANES] {
        #[cfg(not(target_arch = "aarch64"))]
        return bytemuck::cast(self.0);
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the vector is four u32.
        return unsafe { std::mem::transmute::<Vector, [u32; LANES]>(self.0) };
    }

    /// The first three words, and `last` in place of the fourth.
    #[inline(always)]
    pub(crate) fn beside(self, last: u32) -> Self {
        let [first, second, third, _] = self.words();
        Self::new([first, second, third, last])
    }

    /// Sums of words, modulo 2^32.
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        each!(_mm_add_epi32, vaddq_u32, u32::wrapping_add, self, other)
    }

    /// Differences of words, modulo 2^32.
    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        each!(_mm_sub_epi32, vsubq_u32, u32::wrapping_sub, self, other)
    }

    /// The bits that both have.
    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        each!(_mm_and_si128, vandq_u32, u32::bitand, self, other)
    }

    /// The bits that this has and the other does not.
    #[inline(always)]
    pub(crate) fn without(self, other: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instruction is of SSE2, which every x86-64 has. It works on registers alone.
        return Self(unsafe { arch::_mm_andnot_si128(other.0, self.0) });
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the instruction is of NEON, which every aarch64 that Linux runs on has. It works
        // on registers alone.
        return Self(unsafe { arch::vbicq_u32(self.0, other.0) });
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        return Self::new(std::array::from_fn(|k| self.0[k] & !other.0[k]));
    }

    /// All bits of each word that is greater than the other's, as signed integers.
    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instruction.
        return Self(unsafe { arch::_mm_cmpgt_epi32(self.0, other.0) });
        #[cfg(target_arch = "aarch64")]
        // SAFETY: every aarch64 that Linux runs on has the instructions.
        return Self(unsafe {
            let [one, other] = [self.0, other.0].map(|vector| arch::vreinterpretq_s32_u32(vector));
            arch::vcgtq_s32(one, other)
        });
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        return Self::new(std::array::from_fn(|k| {
            let [one, other] = [self, other].map(|lanes| lanes.words()[k].cast_signed());
            if one > other { u32::MAX } else { 0 }
        }));
    }

    /// The last word four times.
    #[inline(always)]
    fn last(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instruction is of SSE2, which every x86-64 has. It works on registers alone.
        return Self(unsafe { arch::_mm_shuffle_epi32::<0xFF>(self.0) });
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the instruction is of NEON, which every aarch64 that Linux runs on has. It works
        // on registers alone.
        return Self(unsafe { arch::vdupq_laneq_u32::<3>(self.0) });
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        return Self::all(self.0[3]);
    }

    /// All bits of each word if the last one has the top bit, else none.
    #[inline(always)]
    pub(crate) fn top_of_last(self) -> Self {
        Self::all(0).above(self.last())
    }

    /// The first two words the other way round, and the last two.
    #[inline(always)]
    fn neighbours(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instruction is of SSE2, which every x86-64 has. It works on registers alone.
        return Self(unsafe { arch::_mm_shuffle_epi32::<0b10_11_00_01>(self.0) });
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the instruction is of NEON, which every aarch64 that Linux runs on has. It works
        // on registers alone.
        return Self(unsafe { arch::vrev64q_u32(self.0) });
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        return Self(std::array::from_fn(|k| self.0[k ^ 1]));
    }

    /// The last two words before the first two.
    #[inline(always)]
    fn halves(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instruction is of SSE2, which every x86-64 has. It works on registers alone.
        return Self(unsafe { arch::_mm_shuffle_epi32::<0b01_00_11_10>(self.0) });
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the instruction is of NEON, which every aarch64 that Linux runs on has. It works
        // on registers alone.
        return Self(unsafe { arch::vextq_u32::<2>(self.0, self.0) });
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        return Self(std::array::from_fn(|k| self.0[k ^ 2]));
    }

    /// The sum of all four f32, in each word. The first two and the last two are added, then both
    /// sums. Each sum is rounded to nearest even.
    #[inline(always)]
    pub(crate) fn sum_f32(self) -> Self {
        let pairs = self.plus_f32(self.neighbours());
        pairs.plus_f32(pairs.halves())
    }

    /// Sums of f32, rounded to nearest even.
    #[inline(always)]
    pub(crate) fn plus_f32(self, other: Self) -> Self {
        each_f32!(_mm_add_ps, vaddq_f32, f32::add, self, other)
    }

    /// Differences of f32, rounded to nearest even.
    #[inline(always)]
    pub(crate) fn minus_f32(self, other: Self) -> Self {
        each_f32!(_mm_sub_ps, vsubq_f32, f32::sub, self, other)
    }

    /// Products of f32, rounded to nearest even.
    #[inline(always)]
    pub(crate) fn times_f32(self, other: Self) -> Self {
        each_f32!(_mm_mul_ps, vmulq_f32, f32::mul, self, other)
    }

    /// The larger f32 of each pair. Beside a NaN the result depends on the processor.
    #[inline(always)]
    pub(crate) fn larger_f32(self, other: Self) -> Self {
        each_f32!(_mm_max_ps, vmaxq_f32, f32::max, self, other)
    }

    /// The smaller f32 of each pair. Beside a NaN the result depends on the processor.
    #[inline(always)]
    pub(crate) fn smaller_f32(self, other: Self) -> Self {
        each_f32!(_mm_min_ps, vminq_f32, f32::min, self, other)
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

/// An unsigned integer of a row. It stays one of four words until it is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Integer {
    pub(crate) words: Lanes,
    /// The index of the integer in `words`.
    pub(crate) at: usize,
}

impl Integer {
    /// Word `AT` of `words`.
    #[inline(always)]
    pub(crate) const fn new<const AT: usize>(words: Lanes) -> Self {
        const { assert!(AT < LANES, "it is one of four") };
        Self { words, at: AT }
    }

    /// The lower half of the integer.
    #[inline(always)]
    pub(crate) fn low(self) -> u16 {
        let [low, high, ..] = u32::from(self).to_le_bytes();
        u16::from_le_bytes([low, high])
    }
}

impl From<Integer> for u32 {
    #[inline(always)]
    fn from(Integer { words, at }: Integer) -> Self {
        words.words()[at]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn each(one: [u32; 4], other: [u32; 4], word: impl Fn(u32, u32) -> u32) -> [u32; 4] {
        std::array::from_fn(|k| word(one[k], other[k]))
    }

    proptest! {
        #[test]
        fn every_word_is_computed_by_itself(one in any::<[u32; 4]>(), other in any::<[u32; 4]>()) {
            prop_assert_eq!(
                Lanes::new(one).beside(other[3]).words(),
                [one[0], one[1], one[2], other[3]]
            );
            let [a, b] = [one, other].map(Lanes::new);
            prop_assert_eq!(a.plus(b).words(), each(one, other, u32::wrapping_add));
            prop_assert_eq!(a.and(b).words(), each(one, other, |a, b| a & b));
            prop_assert_eq!(a.or(b).words(), each(one, other, |a, b| a | b));
            prop_assert_eq!(a.without(b).words(), each(one, other, |a, b| a & !b));
            let above = |a: u32, b: u32| if a.cast_signed() > b.cast_signed() { u32::MAX } else { 0 };
            prop_assert_eq!(a.above(b).words(), each(one, other, above));
            prop_assert_eq!(a.minus(b).words(), each(one, other, u32::wrapping_sub));
            prop_assert_eq!(a.top_of_last().words(), [above(0, one[3]); 4]);
        }

        #[test]
        fn numbers_are_computed_as_one_by_one(
            one in any::<[f32; 4]>(),
            other in any::<[f32; 4]>(),
        ) {
            let [x, y] = [one, other].map(|numbers| numbers.map(f32::to_bits));
            let [a, b] = [x, y].map(Lanes::new);
            let of = |number: fn(f32, f32) -> f32| {
                each(x, y, |a, b| number(f32::from_bits(a), f32::from_bits(b)).to_bits())
            };
            prop_assert_eq!(a.plus_f32(b).words(), of(|a, b| a + b));
            prop_assert_eq!(a.minus_f32(b).words(), of(|a, b| a - b));
            prop_assert_eq!(a.times_f32(b).words(), of(|a, b| a * b));
            // Either of 0 and -0 may be the larger.
            let unsigned_zero = |word| (f32::from_bits(word) + 0.0).to_bits();
            let larger = a.larger_f32(b).words().map(unsigned_zero);
            prop_assert_eq!(larger, of(f32::max).map(unsigned_zero));
            let smaller = a.smaller_f32(b).words().map(unsigned_zero);
            prop_assert_eq!(smaller, of(f32::min).map(unsigned_zero));
            let sum = (one[0] + one[1]) + (one[2] + one[3]);
            prop_assert_eq!(a.sum_f32().words(), [sum.to_bits(); 4]);
        }
    }
}
