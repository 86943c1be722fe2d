//! Runs loops in wider vectors on processors that have them.
#![allow(unsafe_code, reason = "not every processor has the instructions")]

use super::halves::{self, Narrow};
use super::lanes::{Integer, Lanes};

/// Loops that are compiled anew for wider vectors.
///
/// What is in them is so compiled only where it becomes a part of them: what they call for every record
/// is inlined always. The bits are the same: nothing is fused and no sum of numbers reordered.
pub(crate) trait Work {
    type Output;

    /// Does it. An `#[inline(always)]` belongs to every implementation.
    fn run<V: Vectors>(self, vectors: V) -> Self::Output;
}

/// What the vectors that a loop is compiled for can do. Whoever has one knows that the processor has
/// them.
pub(crate) trait Vectors: Copy {
    /// Rounds the numbers of two rows to binary16, to nearest even. Where a row ends in an unsigned integer
    /// its lower half is taken.
    fn to_binary16(self, rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2];

    /// The numbers of two rows of binary16, in f32.
    fn to_f32(self, rows: [Narrow; 2]) -> [Lanes; 2];

    /// Does it as a function of its own, which is compiled for these vectors, too: a loop that is no part of
    /// others shares no registers with them. Each closure is called from one such function alone, and becomes
    /// a part of it; should it not, the bits are the same.
    fn apart<T, W: FnOnce() -> T>(self, work: W) -> T;
}

/// Those that every processor has.
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

/// Does it in the vectors of AVX2 and with the conversions of F16C, where there are both.
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

    /// Those of AVX2, and the conversions of F16C. There is one in [`run`] alone.
    #[derive(Debug, Clone, Copy)]
    struct Wide(());

    impl Vectors for Wide {
        #[inline(always)]
        fn to_binary16(self, rows: [Lanes; 2], integers: [Option<Integer>; 2]) -> [Narrow; 2] {
            // SAFETY: the function wants AVX2 and F16C. A `Wide` is made in `run` alone, which is called
            // only where both were found.
            unsafe { halves::x86::to_binary16(rows, integers) }
        }

        #[inline(always)]
        fn to_f32(self, rows: [Narrow; 2]) -> [Lanes; 2] {
            // SAFETY: there is one of these only where the processor has the instructions that the
            // function is compiled for.
            unsafe { halves::x86::to_f32(rows) }
        }

        #[inline(always)]
        fn apart<T, W: FnOnce() -> T>(self, work: W) -> T {
            // From here, where the vectors are not said, the compiler would inline it nevertheless.
            let apart: unsafe fn(W) -> T = black_box(apart::<T, W>);
            // SAFETY: `apart` wants AVX2 and F16C. A `Wide` is made in `run` alone, which is called only
            // where both were found.
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
