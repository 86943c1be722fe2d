//! The SIMD instructions that a processor may have: compiles work for each set, turns quads into
//! columns, and rounds to binary16. For the latter two the compiler finds no good instructions by
//! itself.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;
use std::fmt::Debug;

use super::{F32x16, LANES, halves};

/// Four numbers in memory.
pub type Quad = [f32; 4];

/// Code that computes with lanes.
pub trait Work {
    /// The result.
    type Output;

    /// Does the work. The implementation is `#[inline(always)]`.
    fn run(self, instructions: impl Instructions) -> Self::Output;
}

/// Proof that the processor has a set of instructions.
pub trait Instructions: Copy + Debug {
    /// The numbers of one quad for each lane, by their place in the quad.
    fn columns(self, quads: [Quad; LANES]) -> [F32x16; 4];

    /// One quad for each lane, from the numbers by their place in it.
    fn quads(self, columns: [F32x16; 4]) -> [Quad; LANES];

    /// The binary16 number nearest to each number, as the f32 of the same value.
    ///
    /// A tie goes to the even number. A magnitude of half a step or more beyond 65504 becomes
    /// infinite. Subnormal numbers of binary16 are kept, and zeros keep their sign. Every NaN
    /// becomes [`f32::NAN`]: sign and payload are lost.
    fn round_to_halves(self, numbers: F32x16) -> F32x16;

    /// The columns of quads that lie `stride` quads apart.
    ///
    /// # Panics
    ///
    /// If `quads` does not reach to the last lane's.
    #[inline(always)]
    fn load(self, quads: &[Quad], stride: usize) -> [F32x16; 4] {
        assert!(quads.len() > (LANES - 1) * stride, "a quad for each lane");
        self.columns(super::each(|lane| quads[lane * stride]))
    }

    /// Stores columns as quads that lie `stride` quads apart.
    ///
    /// # Panics
    ///
    /// If `quads` does not reach to the last lane's.
    #[inline(always)]
    fn store(self, columns: [F32x16; 4], quads: &mut [Quad], stride: usize) {
        assert!(quads.len() > (LANES - 1) * stride, "a quad for each lane");
        for (lane, quad) in self.quads(columns).into_iter().enumerate() {
            quads[lane * stride] = quad;
        }
    }
}

/// The instructions that every processor of the target has.
#[derive(Debug, Clone, Copy)]
struct Target;

impl Instructions for Target {
    #[inline(always)]
    fn columns(self, quads: [Quad; LANES]) -> [F32x16; 4] {
        [0, 1, 2, 3].map(|place| F32x16::from_fn(|lane| quads[lane][place]))
    }

    #[inline(always)]
    fn quads(self, columns: [F32x16; 4]) -> [Quad; LANES] {
        let [a, b, c, d] = columns.map(F32x16::to_array);
        super::each(|lane| [a[lane], b[lane], c[lane], d[lane]])
    }

    #[inline(always)]
    fn round_to_halves(self, numbers: F32x16) -> F32x16 {
        numbers.map(halves::nearest)
    }
}

/// Defines a set of x86-64 instructions; `$parts` of its registers hold all lanes.
#[cfg(target_arch = "x86_64")]
macro_rules! instructions {
    (
        $(#[$meta:meta])*
        $name:ident: [$register:ident; $parts:literal], $features:literal,
        $low:ident $high:ident $shuffle:ident $narrow:ident $widen:ident
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy)]
        struct $name(());

        impl $name {
            #[target_feature(enable = $features)]
            fn enabled<W: Work>(self, work: W) -> W::Output {
                work.run(self)
            }

            /// Exchanges rows and columns of each four lanes.
            #[inline]
            #[target_feature(enable = $features)]
            fn transposed_part([a, b, c, d]: [$register; 4]) -> [$register; 4] {
                let (low_ab, high_ab) = ($low(a, b), $high(a, b));
                let (low_cd, high_cd) = ($low(c, d), $high(c, d));
                [
                    $shuffle::<0x44>(low_ab, low_cd),
                    $shuffle::<0xEE>(low_ab, low_cd),
                    $shuffle::<0x44>(high_ab, high_cd),
                    $shuffle::<0xEE>(high_ab, high_cd),
                ]
            }

            /// Rounds to binary16 and back. A NaN keeps its sign and the head of its payload.
            #[inline]
            #[target_feature(enable = $features)]
            fn rounded_part(numbers: $register) -> $register {
                $widen($narrow::<_MM_FROUND_TO_NEAREST_INT>(numbers))
            }

            #[inline(always)]
            fn transposed(self, rows: [F32x16; 4]) -> [F32x16; 4] {
                let [a, b, c, d]: [[$register; $parts]; 4] = bytemuck::cast(rows.map(|row| row.0));
                let mut columns = [a, b, c, d];
                for part in 0..$parts {
                    let rows = [a[part], b[part], c[part], d[part]];
                    // SAFETY: a value of this type is made where the processor has the features.
                    let transposed = unsafe { Self::transposed_part(rows) };
                    for (column, transposed) in columns.iter_mut().zip(transposed) {
                        column[part] = transposed;
                    }
                }
                columns.map(|column| F32x16(bytemuck::cast(column)))
            }
        }

        impl Instructions for $name {
            #[inline(always)]
            fn columns(self, quads: [Quad; LANES]) -> [F32x16; 4] {
                let row = |at: usize| {
                    let row = [quads[at], quads[4 + at], quads[8 + at], quads[12 + at]];
                    F32x16(bytemuck::cast(row))
                };
                self.transposed([row(0), row(1), row(2), row(3)])
            }

            #[inline(always)]
            fn quads(self, columns: [F32x16; 4]) -> [Quad; LANES] {
                let rows = self.transposed(columns);
                let rows: [[Quad; 4]; 4] = rows.map(|row| bytemuck::cast(row.0));
                super::each(|lane| rows[lane % 4][lane / 4])
            }

            #[inline(always)]
            fn round_to_halves(self, numbers: F32x16) -> F32x16 {
                let mut parts: [$register; $parts] = bytemuck::cast(numbers.0);
                for part in &mut parts {
                    // SAFETY: a value of this type, such as `self`, is made in
                    // `InstructionSet::all` alone, where the processor has the features.
                    *part = unsafe { Self::rounded_part(*part) };
                }
                let rounded = F32x16(bytemuck::cast(parts));
                rounded.or(numbers.is(numbers), F32x16::splat(f32::NAN))
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
instructions! {
    /// AVX2 with F16C, which all processors with AVX2 have: a register holds eight lanes.
    Avx2: [__m256; 2], "avx2,f16c",
    _mm256_unpacklo_ps _mm256_unpackhi_ps _mm256_shuffle_ps _mm256_cvtps_ph _mm256_cvtph_ps
}

#[cfg(target_arch = "x86_64")]
instructions! {
    /// The part of AVX-512 that all its server and desktop processors have: a register holds all
    /// lanes.
    Avx512: [__m512; 1], "avx512f,avx512bw,avx512dq,avx512vl",
    _mm512_unpacklo_ps _mm512_unpackhi_ps _mm512_shuffle_ps _mm512_cvtps_ph _mm512_cvtph_ps
}

/// A set of instructions that the processor has.
#[derive(Debug, Clone, Copy)]
pub struct InstructionSet(Kind);

#[derive(Debug, Clone, Copy)]
enum Kind {
    Target(Target),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl InstructionSet {
    /// The sets that the processor has, the fastest first.
    pub fn all() -> impl Iterator<Item = Self> {
        let target = Some(Kind::Target(Target));
        #[cfg(target_arch = "x86_64")]
        let avx2 = (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("f16c"))
            .then_some(Kind::Avx2(Avx2(())));
        #[cfg(not(target_arch = "x86_64"))]
        let avx2 = None;
        #[cfg(target_arch = "x86_64")]
        let avx512 = (is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl"))
        .then_some(Kind::Avx512(Avx512(())));
        #[cfg(not(target_arch = "x86_64"))]
        let avx512 = None;
        [avx512, avx2, target].into_iter().flatten().map(Self)
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
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a value is made in `all` alone, where the processor has the features.
            Kind::Avx2(avx2) => unsafe { avx2.enabled(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a value is made in `all` alone, where the processor has the features.
            Kind::Avx512(avx512) => unsafe { avx512.enabled(work) },
        }
    }
}

/// Prefetches a value into the cache, on processors with such an instruction. The address may be
/// invalid.
#[inline(always)]
pub fn prefetch<T>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<T>()).step_by(64) {
        let line = value.cast::<i8>().wrapping_add(line);
        // SAFETY: the instruction is of SSE and reads nothing: any address will do.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
