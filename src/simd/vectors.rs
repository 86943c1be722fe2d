//! Runs loops in wider vectors on processors that have them.
#![allow(unsafe_code, reason = "not every processor has the instructions")]

use super::halves::{self, Narrow};
use super::lanes::{Integer, Lanes};

/// A loop that is compiled again for wider vectors.
///
/// Only inlined code is compiled for them: every function that the loop calls per record is
/// `#[inline(always)]`. The result bits are the same: no operation is fused and no sum is
/// reordered.
pub(crate) trait Work {
    type Output;

    /// Runs the loop. Every implementation carries `#[inline(always)]`.
    fn run<V: Vectors>(self, vectors: V) -> Self::Output;
}

/// The operations of the vectors that a loop is compiled for. A value of such a type exists only
/// where the processor has the instructions.
pub(crate) trait Vectors: Copy {
    /// Rounds the numbers of two rows to binary16, to nearest even. A row with an unsigned integer
    /// ends in the integer's lower half.
    fn to_binary16(self, rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2];

    /// The numbers of two rows of binary16, in f32.
    fn to_f32(self, rows: [Narrow; 2]) -> [Lanes; 2];

    /// Runs `work` in a function of its own, which is compiled for these vectors, too. A loop in
    /// its own function shares no registers with others. The compiler inlines each closure into its
    /// only caller; without that, the result bits are the same.
    fn apart<T, W: FnOnce() -> T>(self, work: W) -> T;
}

/// The vectors that every processor has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Baseline;

impl Vectors for Baseline {
    #[inline(always)]
    fn to_binary16(self, rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2] {
        halves::to_binary16(rows, integers)
    }

    #[inline(always)]
    fn to_f32(self, rows: [Narrow; 2]) -> [Lanes; 2] {
        halves::to_f32(rows)
    }

    #[inline(never)]
    fn apart<T, W: FnOnce() -> T>(self, work: W) -> T {
        work()
    }
}

/// Runs `work` in vectors of AVX2 with the conversions of F16C if the processor has both, else in
/// the [`Baseline`].
#[inline]
pub(crate) fn in_wide_vectors<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("f16c") {
        // SAFETY: the processor has the instructions that the function is compiled for, and the
        // system keeps their registers.
        return unsafe { x86::run(work) };
    }
    work.run(Baseline)
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::hint::black_box;

    use super::{Integer, Lanes, Narrow, Vectors, Work, halves};

    /// The vectors of AVX2 and the conversions of F16C. Only [`run`] makes a value.
    #[derive(Debug, Clone, Copy)]
    struct Wide(());

    impl Vectors for Wide {
        #[inline(always)]
        fn to_binary16(self, rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2] {
            // SAFETY: the function needs AVX2 and F16C. Only `run` makes a `Wide`, and `run` is
            // called only where both were found.
            unsafe { halves::x86::to_binary16(rows, integers) }
        }

        #[inline(always)]
        fn to_f32(self, rows: [Narrow; 2]) -> [Lanes; 2] {
            // SAFETY: a `Wide` exists only where the processor has the instructions that the
            // function is compiled for.
            unsafe { halves::x86::to_f32(rows) }
        }

        #[inline(always)]
        fn apart<T, W: FnOnce() -> T>(self, work: W) -> T {
            // This function enables no target features: without `black_box`, the compiler inlines
            // `apart` here.
            let apart: unsafe fn(W) -> T = black_box(apart::<T, W>);
            // SAFETY: `apart` needs AVX2 and F16C. Only `run` makes a `Wide`, and `run` is called
            // only where both were found.
            unsafe { apart(work) }
        }
    }

    #[target_feature(enable = "avx2,f16c")]
    #[inline(never)]
    fn apart<T, W: FnOnce() -> T>(work: W) -> T {
        work()
    }

    #[target_feature(enable = "avx2,f16c")]
    pub(crate) fn run<W: Work>(work: W) -> W::Output {
        work.run(Wide(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [u32]);

    impl Work for Sum<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<V: Vectors>(self, _: V) -> u32 {
            self.0.iter().sum()
        }
    }

    #[test]
    fn what_is_run_says_what_it_found() {
        let numbers: Vec<u32> = (1..=100).collect();
        assert_eq!(in_wide_vectors(Sum(&numbers)), 5050);
    }
}
