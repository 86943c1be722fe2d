//! The choice of the instructions that a processor has for the operations on lanes.

use super::instructions::{Target, Work};

/// A set of instructions that the processor has.
#[derive(Debug, Clone, Copy)]
pub struct InstructionSet(Kind);

#[derive(Debug, Clone, Copy)]
enum Kind {
    Target(Target),
    #[cfg(target_arch = "aarch64")]
    Neon(super::aarch64::Neon),
    #[cfg(target_arch = "x86_64")]
    Avx2(super::x86::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(super::x86::Avx512),
}

impl InstructionSet {
    /// The sets that the processor has, the fastest first.
    pub fn all() -> impl Iterator<Item = Self> {
        #[cfg(target_arch = "x86_64")]
        let wide = [
            super::x86::Avx512::found().map(Kind::Avx512),
            super::x86::Avx2::found().map(Kind::Avx2),
        ];
        #[cfg(target_arch = "aarch64")]
        let wide = [Some(Kind::Neon(super::aarch64::Neon))];
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let wide = [];
        wide.into_iter().flatten().chain([Kind::Target(Target)]).map(Self)
    }

    /// The fastest that the processor has.
    #[must_use]
    pub fn found() -> Self {
        Self::all().next().unwrap_or(Self(Kind::Target(Target)))
    }

    /// Does work that is compiled for these instructions.
    #[inline]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        match self.0 {
            Kind::Target(target) => work.run(target),
            #[cfg(target_arch = "aarch64")]
            Kind::Neon(neon) => work.run(neon),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(avx2) => avx2.run(work),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512(avx512) => avx512.run(work),
        }
    }
}
