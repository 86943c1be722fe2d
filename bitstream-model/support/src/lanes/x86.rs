//! AVX2 and AVX-512.

use std::arch::x86_64::*;

use super::instructions::{Instructions, Quad, Work};
use super::{LANES, each};

/// Operations of registers that hold all lanes in some parts, by an instruction each.
macro_rules! by_instructions {
    ($($method:ident($first:ident $(, $other:ident)*) $instruction:path;)*) => {$(
        #[inline(always)]
        fn $method(self, $first: Self::Register $(, $other: Self::Register)*) -> Self::Register {
            let mut result = $first;
            for (part, result) in result.iter_mut().enumerate() {
                // SAFETY: a value of this type is made where the processor has the instructions.
                *result = unsafe { $instruction($first[part] $(, $other[part])*) };
            }
            result
        }
    )*};
}

/// A set of instructions, and the exchange of rows and columns in its registers.
macro_rules! set {
    (
        $(#[$meta:meta])*
        $name:ident: $register:ident, $features:literal, $($feature:tt)*
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy)]
        pub(super) struct $name<const BINARY16: bool>(());

        impl $name<false> {
            /// If the processor has it.
            pub(super) fn found() -> Option<Self> {
                [$(is_x86_feature_detected!($feature)),*].iter().all(|has| *has).then_some(Self(()))
            }

            /// The same instructions, rounding to binary16.
            pub(super) fn in_binary16(self) -> $name<true> {
                $name(())
            }
        }

        impl<const BINARY16: bool> $name<BINARY16> {

            #[inline]
            pub(super) fn run<W: Work>(self, work: W) -> W::Output {
                // SAFETY: a value of this type is made where the processor has the instructions.
                unsafe { self.enabled(work) }
            }

            #[target_feature(enable = $features)]
            fn enabled<W: Work>(self, work: W) -> W::Output {
                work.run(self)
            }
        }
    };
}

set! {
    /// A register holds eight lanes.
    Avx2: __m256, "avx2,f16c", "avx2" "f16c"
}

set! {
    /// The part of AVX-512 that all its server and desktop processors have: a register holds all
    /// lanes.
    Avx512: __m512, "avx512f,avx512bw,avx512dq,avx512vl", "avx512f" "avx512bw" "avx512dq" "avx512vl"
}

impl<const BINARY16: bool> Avx2<BINARY16> {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn four([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        let (low_ab, high_ab) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (low_cd, high_cd) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0x44>(low_ab, low_cd),
            _mm256_shuffle_ps::<0xEE>(low_ab, low_cd),
            _mm256_shuffle_ps::<0x44>(high_ab, high_cd),
            _mm256_shuffle_ps::<0xEE>(high_ab, high_cd),
        ]
    }

    /// The columns of eight rows.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn eight([a, b, c, d, e, f, g, h]: [__m256; 8]) -> [__m256; 8] {
        let (low, high) = (Self::four([a, b, c, d]), Self::four([e, f, g, h]));
        [
            _mm256_permute2f128_ps::<0x20>(low[0], high[0]),
            _mm256_permute2f128_ps::<0x20>(low[1], high[1]),
            _mm256_permute2f128_ps::<0x20>(low[2], high[2]),
            _mm256_permute2f128_ps::<0x20>(low[3], high[3]),
            _mm256_permute2f128_ps::<0x31>(low[0], high[0]),
            _mm256_permute2f128_ps::<0x31>(low[1], high[1]),
            _mm256_permute2f128_ps::<0x31>(low[2], high[2]),
            _mm256_permute2f128_ps::<0x31>(low[3], high[3]),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx2,f16c")]
    fn kept(a: __m256) -> __m256 {
        match BINARY16 {
            true => _mm256_cvtph_ps(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(a)),
            false => a,
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn bits<const COMPARISON: i32>(a: [__m256; 2], b: [__m256; 2]) -> u32 {
        let of = |part: usize| {
            _mm256_movemask_ps(_mm256_cmp_ps::<COMPARISON>(a[part], b[part])).cast_unsigned()
        };
        of(0) | of(1) << 8
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn selected(bits: u32, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        let of = |part: usize| {
            let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let bits = _mm256_set1_epi32((bits >> (8 * part)).cast_signed());
            let mask = _mm256_cmpeq_epi32(_mm256_and_si256(bits, lanes), lanes);
            _mm256_blendv_ps(b[part], a[part], _mm256_castsi256_ps(mask))
        };
        [of(0), of(1)]
    }
}

impl<const BINARY16: bool> Instructions for Avx2<BINARY16> {
    const BINARY16: bool = BINARY16;

    type Register = [__m256; 2];

    by_instructions! {
        add(a, b) _mm256_add_ps;
        sub(a, b) _mm256_sub_ps;
        mul(a, b) _mm256_mul_ps;
        div(a, b) _mm256_div_ps;
        larger(a, b) _mm256_max_ps;
        smaller(a, b) _mm256_min_ps;
        sqrt(a) _mm256_sqrt_ps;
        rounded(a) Self::kept;
    }

    #[inline(always)]
    fn above(self, a: Self::Register, b: Self::Register) -> u32 {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::bits::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    fn is(self, a: Self::Register, b: Self::Register) -> u32 {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::bits::<_CMP_EQ_OQ>(a, b) }
    }

    #[inline(always)]
    fn select(self, bits: u32, a: Self::Register, b: Self::Register) -> Self::Register {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::selected(bits, a, b) }
    }

    #[inline(always)]
    fn transposed(self, [a, b, c, d]: [Self::Register; 4]) -> [Self::Register; 4] {
        // SAFETY: a value of this type is made where the processor has the instructions.
        let of = |part: usize| unsafe { Self::four([a[part], b[part], c[part], d[part]]) };
        let (low, high) = (of(0), of(1));
        [0, 1, 2, 3].map(|at| [low[at], high[at]])
    }

    #[inline(always)]
    unsafe fn gather(self, rows: *const [Quad; 2], indices: &[u32; LANES]) -> [Self::Register; 8] {
        let row = |lane: usize| {
            // SAFETY: the caller promises that the row exists.
            let row = unsafe { rows.add(indices[lane] as usize) };
            // SAFETY: the row exists, and by the caller no other thread writes it.
            unsafe { *row }
        };
        let of = |part: usize| {
            let rows = [0, 1, 2, 3, 4, 5, 6, 7].map(|lane| bytemuck::cast(row(8 * part + lane)));
            // SAFETY: a value of this type is made where the processor has the instructions.
            unsafe { Self::eight(rows) }
        };
        let (low, high) = (of(0), of(1));
        [0, 1, 2, 3, 4, 5, 6, 7].map(|at| [low[at], high[at]])
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        columns: [Self::Register; 8],
        rows: *mut [Quad; 2],
        indices: &[u32; LANES],
    ) {
        for part in 0..2 {
            // SAFETY: a value of this type is made where the processor has the instructions.
            let quads = unsafe { Self::eight(columns.map(|column| column[part])) };
            for (row, index) in quads.into_iter().zip(&indices[8 * part..]) {
                // SAFETY: the caller promises that the row exists.
                let to = unsafe { rows.add(*index as usize) };
                // SAFETY: the row exists, and by the caller no other thread accesses it.
                unsafe { *to = bytemuck::cast(row) };
            }
        }
    }
}

impl<const BINARY16: bool> Avx512<BINARY16> {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn four([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
        let (low_ab, high_ab) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let (low_cd, high_cd) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0x44>(low_ab, low_cd),
            _mm512_shuffle_ps::<0xEE>(low_ab, low_cd),
            _mm512_shuffle_ps::<0x44>(high_ab, high_cd),
            _mm512_shuffle_ps::<0xEE>(high_ab, high_cd),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn quads([a, b, c, d]: [__m128; 4]) -> __m512 {
        let low = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(a), b);
        _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(low, c), d)
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn columns_of(row: impl Fn(usize) -> __m256) -> [__m512; 8] {
        let both =
            |at: usize| _mm512_insertf32x8::<1>(_mm512_castps256_ps512(row(at)), row(at + 4));
        let low = Self::four([both(0), both(1), both(2), both(3)]);
        let high = Self::four([both(8), both(9), both(10), both(11)]);
        [
            _mm512_shuffle_f32x4::<0x88>(low[0], high[0]),
            _mm512_shuffle_f32x4::<0x88>(low[1], high[1]),
            _mm512_shuffle_f32x4::<0x88>(low[2], high[2]),
            _mm512_shuffle_f32x4::<0x88>(low[3], high[3]),
            _mm512_shuffle_f32x4::<0xDD>(low[0], high[0]),
            _mm512_shuffle_f32x4::<0xDD>(low[1], high[1]),
            _mm512_shuffle_f32x4::<0xDD>(low[2], high[2]),
            _mm512_shuffle_f32x4::<0xDD>(low[3], high[3]),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn rows_of([a, b, c, d, e, f, g, h]: [__m512; 8]) -> [__m256; LANES] {
        let low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
        let high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
        let beside = |places, a, b| {
            let (a, b) = (_mm512_castps_pd(a), _mm512_castps_pd(b));
            _mm512_castpd_ps(_mm512_permutex2var_pd(a, places, b))
        };
        let [p, q, r, s] = Self::four([
            beside(low, a, e),
            beside(low, b, f),
            beside(low, c, g),
            beside(low, d, h),
        ]);
        let [t, u, v, w] = Self::four([
            beside(high, a, e),
            beside(high, b, f),
            beside(high, c, g),
            beside(high, d, h),
        ]);
        let first = |row| _mm512_castps512_ps256(row);
        let second = |row| _mm512_extractf32x8_ps::<1>(row);
        [
            first(p),
            first(q),
            first(r),
            first(s),
            second(p),
            second(q),
            second(r),
            second(s),
            first(t),
            first(u),
            first(v),
            first(w),
            second(t),
            second(u),
            second(v),
            second(w),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn kept(a: __m512) -> __m512 {
        match BINARY16 {
            true => _mm512_cvtph_ps(_mm512_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(a)),
            false => a,
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn selected(bits: u32, a: __m512, b: __m512) -> __m512 {
        #[allow(clippy::cast_possible_truncation, reason = "there are sixteen lanes")]
        let mask = bits as __mmask16;
        _mm512_mask_blend_ps(mask, b, a)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn bits<const COMPARISON: i32>(a: __m512, b: __m512) -> u32 {
        _mm512_cmp_ps_mask::<COMPARISON>(a, b).into()
    }
}

impl<const BINARY16: bool> Instructions for Avx512<BINARY16> {
    const BINARY16: bool = BINARY16;

    type Register = [__m512; 1];

    by_instructions! {
        add(a, b) _mm512_add_ps;
        sub(a, b) _mm512_sub_ps;
        mul(a, b) _mm512_mul_ps;
        div(a, b) _mm512_div_ps;
        larger(a, b) _mm512_max_ps;
        smaller(a, b) _mm512_min_ps;
        sqrt(a) _mm512_sqrt_ps;
        abs(a) _mm512_abs_ps;
        rounded(a) Self::kept;
    }

    #[inline(always)]
    fn above(self, [a]: Self::Register, [b]: Self::Register) -> u32 {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::bits::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    fn is(self, [a]: Self::Register, [b]: Self::Register) -> u32 {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::bits::<_CMP_EQ_OQ>(a, b) }
    }

    #[inline(always)]
    fn select(self, bits: u32, [a]: Self::Register, [b]: Self::Register) -> Self::Register {
        // SAFETY: a value of this type is made where the processor has the instructions.
        [unsafe { Self::selected(bits, a, b) }]
    }

    #[inline(always)]
    fn transposed(self, rows: [Self::Register; 4]) -> [Self::Register; 4] {
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::four(rows.map(|[row]| row)) }.map(|column| [column])
    }

    #[inline(always)]
    fn of_quads(self, quads: [Quad; LANES / 4]) -> Self::Register {
        // SAFETY: a value of this type is made where the processor has the instructions.
        [unsafe { Self::quads(quads.map(bytemuck::cast)) }]
    }

    #[inline(always)]
    unsafe fn gather(self, rows: *const [Quad; 2], indices: &[u32; LANES]) -> [Self::Register; 8] {
        let row = |lane: usize| {
            // SAFETY: the caller promises that the row exists.
            let row = unsafe { rows.add(indices[lane] as usize) };
            // SAFETY: the row exists, and by the caller no other thread writes it.
            bytemuck::cast(unsafe { *row })
        };
        // SAFETY: a value of this type is made where the processor has the instructions.
        unsafe { Self::columns_of(row) }.map(|column| [column])
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        columns: [Self::Register; 8],
        rows: *mut [Quad; 2],
        indices: &[u32; LANES],
    ) {
        // SAFETY: a value of this type is made where the processor has the instructions.
        let quads = unsafe { Self::rows_of(columns.map(|[column]| column)) };
        let quads: [[Quad; 2]; LANES] = each(|lane| bytemuck::cast(quads[lane]));
        for (row, index) in quads.into_iter().zip(indices) {
            // SAFETY: the caller promises that the row exists.
            let to = unsafe { rows.add(*index as usize) };
            // SAFETY: the row exists, and by the caller no other thread accesses it.
            unsafe { *to = row };
        }
    }
}
