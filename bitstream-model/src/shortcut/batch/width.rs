//! Chooses the widest SIMD lanes that the processor has.

use super::lanes::{Lanes, Portable, Work};

#[cfg(target_arch = "x86_64")]
use super::lanes::Avx2;
#[cfg(all(target_arch = "x86_64", avx512))]
use super::lanes::Avx512;
#[cfg(target_arch = "aarch64")]
use super::lanes::Neon;

/// The lanes to compute with.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Width {
    /// One collision after the other.
    One,
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(all(target_arch = "x86_64", avx512))]
    Avx512(Avx512),
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
}

impl Width {
    /// All that the processor has, the widest first.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        #[cfg(all(target_arch = "x86_64", avx512))]
        let own = [Avx512::found().map(Self::Avx512), Avx2::found().map(Self::Avx2)];
        #[cfg(all(target_arch = "x86_64", not(avx512)))]
        let own = [Avx2::found().map(Self::Avx2)];
        #[cfg(target_arch = "aarch64")]
        let own = [Some(Self::Neon(Neon))];
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let own = [None];
        own.into_iter().flatten().chain([Self::Portable(Portable), Self::One])
    }

    /// The widest that the processor has.
    pub(crate) fn found() -> Self {
        Self::all().next().unwrap_or(Self::One)
    }

    /// Runs something with the lanes, or gives it back where there are none.
    #[inline]
    pub(crate) fn run<W: Work>(self, work: W) -> Result<(), W> {
        match self {
            Self::One => return Err(work),
            Self::Portable(lanes) => lanes.run(work),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(lanes) => lanes.run(work),
            #[cfg(all(target_arch = "x86_64", avx512))]
            Self::Avx512(lanes) => lanes.run(work),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(lanes) => lanes.run(work),
        }
        Ok(())
    }
}
