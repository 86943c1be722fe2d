//! This file runs loops in wider vectors than every processor has, where this one has them.
#![allow(unsafe_code, reason = "not every processor has the instructions")]

/// Loops that are compiled anew for wider vectors.
///
/// What is in them is so compiled only where it becomes a part of them: what they call for every record
/// is inlined always. The bits are the same: nothing is fused and no sum of numbers reordered.
pub(crate) trait Work {
    type Output;

    /// Does it. An `#[inline(always)]` belongs to every implementation.
    fn run(self) -> Self::Output;
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
    work.run()
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Work;

    #[target_feature(enable = "avx2,f16c")]
    pub(super) fn run<W: Work>(work: W) -> W::Output {
        work.run()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [u32]);

    impl Work for Sum<'_> {
        type Output = u32;

        #[inline(always)]
        fn run(self) -> u32 {
            self.0.iter().sum()
        }
    }

    #[test]
    fn what_is_run_says_what_it_found() {
        let numbers: Vec<u32> = (1..=100).collect();
        assert_eq!(in_wide_vectors(Sum(&numbers)), 5050);
    }
}
