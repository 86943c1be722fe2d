//! Sums of the words of beats.
#![allow(unsafe_code, reason = "an instruction for four words, which the compiler rarely finds")]

use pgs_interface::record::{Beat, LANES};

/// The sum of words, modulo 2^32, lane by lane.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sum([u32; LANES]);

impl Sum {
    /// Adds the words of a beat.
    #[inline(always)]
    pub(crate) fn add(&mut self, Beat(words): Beat) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instruction. The vectors are four words, of any bits.
        let sum = unsafe {
            use std::arch::x86_64::{__m128i, _mm_add_epi32};
            let [sum, words] = [self.0, words].map(bytemuck::cast::<_, __m128i>);
            bytemuck::cast(_mm_add_epi32(sum, words))
        };
        #[cfg(target_arch = "aarch64")]
        // SAFETY: every aarch64 that Linux runs on has the instruction. The vectors are four words,
        // of any bits.
        let sum = unsafe {
            use std::arch::aarch64::{uint32x4_t, vaddq_u32};
            let [sum, words] = [self.0, words].map(bytemuck::cast::<_, uint32x4_t>);
            bytemuck::cast(vaddq_u32(sum, words))
        };
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let sum = std::array::from_fn(|lane| self.0[lane].wrapping_add(words[lane]));
        self.0 = sum;
    }

    /// The sum of all words, modulo 2^32.
    pub(crate) fn total(self) -> u32 {
        self.0.into_iter().fold(0, u32::wrapping_add)
    }
}
