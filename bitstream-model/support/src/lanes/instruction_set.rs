//! The choice of the instructions that a processor has for the operations on lanes.

use super::instructions::{Target, Work};

/// A set of instructions that the processor has, and whether it rounds to binary16.
#[derive(Debug, Clone, Copy)]
pub struct InstructionSet(Kind, bool);

#[derive(Debug, Clone, Copy)]
enum Kind {
    Target,
    #[cfg(target_arch = "aarch64")]
    Neon,
    #[cfg(target_arch = "x86_64")]
    Avx2(super::x86::Avx2<false>),
    #[cfg(target_arch = "x86_64")]
    Avx512(super::x86::Avx512<false>),
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
        let wide = [Some(Kind::Neon)];
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let wide = [];
        wide.into_iter().flatten().chain([Kind::Target]).map(|kind| Self(kind, false))
    }

    /// The fastest that the processor has.
    #[must_use]
    pub fn found() -> Self {
        Self::all().next().unwrap_or(Self(Kind::Target, false))
    }

    /// The same instructions, which round to binary16 if asked to: each result of arithmetic, and a
    /// number that is put in each lane. Binary16 numbers so compute as binary16 does.
    #[must_use]
    pub fn in_binary16(self, binary16: bool) -> Self {
        Self(self.0, binary16)
    }

    /// Does work that is compiled for these instructions.
    #[inline]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        match self {
            Self(Kind::Target, false) => work.run(Target::<false>),
            Self(Kind::Target, true) => work.run(Target::<true>),
            #[cfg(target_arch = "aarch64")]
            Self(Kind::Neon, false) => work.run(super::aarch64::Neon::<false>),
            #[cfg(target_arch = "aarch64")]
            Self(Kind::Neon, true) => work.run(super::aarch64::Neon::<true>),
            #[cfg(target_arch = "x86_64")]
            Self(Kind::Avx2(avx2), false) => avx2.run(work),
            #[cfg(target_arch = "x86_64")]
            Self(Kind::Avx2(avx2), true) => avx2.in_binary16().run(work),
            #[cfg(target_arch = "x86_64")]
            Self(Kind::Avx512(avx512), false) => avx512.run(work),
            #[cfg(target_arch = "x86_64")]
            Self(Kind::Avx512(avx512), true) => avx512.in_binary16().run(work),
        }
    }
}
