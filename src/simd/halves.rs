//! Converts numbers between f32 and binary16, by the conversion instructions of the processor if it
//! has them.
//!
//! On aarch64 the crate `half` uses them only with an extension that a Cortex-A53 lacks, although
//! that processor has the conversions.
#![cfg_attr(
    target_arch = "aarch64",
    allow(unsafe_code, reason = "an instruction, and vectors of aarch64 are cast")
)]

use pgs_interface::record::Beat;

/// Rounds the numbers of rows to binary16, to nearest even: two rows a beat.
pub(crate) fn narrow(rows: &[Beat], to: &mut [Beat]) {
    #[cfg(not(target_arch = "aarch64"))]
    {
        use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};
        let words: &mut [u16] = bytemuck::cast_slice_mut(to);
        words
            .reinterpret_cast_mut::<half::f16>()
            .convert_from_f32_slice(bytemuck::cast_slice(rows));
    }
    #[cfg(target_arch = "aarch64")]
    for (from, to) in rows.iter().zip(bytemuck::cast_slice_mut::<_, [u16; 4]>(to)) {
        *to = aarch64::narrow(*from);
    }
}

/// The numbers of beats of binary16 in f32: two rows a beat, up to the end of `rows`.
pub(crate) fn widen(beats: &[Beat], rows: &mut [Beat]) {
    let words: &[[u16; 4]] = &bytemuck::cast_slice(beats)[..rows.len()];
    #[cfg(not(target_arch = "aarch64"))]
    {
        use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};
        let halves: &[half::f16] = words.as_flattened().reinterpret_cast();
        halves.convert_to_f32_slice(bytemuck::cast_slice_mut(rows));
    }
    #[cfg(target_arch = "aarch64")]
    for (from, to) in words.iter().zip(rows) {
        *to = aarch64::widen(*from);
    }
}

#[cfg(target_arch = "aarch64")]
mod aarch64 {
    use core::arch::aarch64::{float16x4_t, float32x4_t, vcvt_f16_f32, vcvt_f32_f16};

    use pgs_interface::record::Beat;

    #[inline(always)]
    pub(super) fn narrow(row: Beat) -> [u16; 4] {
        // SAFETY: a beat and the vector have four words of 32 bits, sixteen bytes, and the vector
        // may hold any bits.
        let wide = unsafe { std::mem::transmute::<Beat, float32x4_t>(row) };
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let narrow = unsafe { vcvt_f16_f32(wide) };
        // SAFETY: both have four words of sixteen bits, eight bytes, and a word may hold any bits.
        unsafe { std::mem::transmute::<float16x4_t, [u16; 4]>(narrow) }
    }

    #[inline(always)]
    pub(super) fn widen(words: [u16; 4]) -> Beat {
        // SAFETY: both have four words of sixteen bits, eight bytes, and the vector may hold any
        // bits.
        let narrow = unsafe { std::mem::transmute::<[u16; 4], float16x4_t>(words) };
        // SAFETY: every aarch64 that Linux runs on has the instruction.
        let wide = unsafe { vcvt_f32_f16(narrow) };
        // SAFETY: both have four words of 32 bits, sixteen bytes, and a beat may hold any bits.
        unsafe { std::mem::transmute::<float32x4_t, Beat>(wide) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widened(word: u16) -> f32 {
        let mut rows = [Beat::default()];
        widen(&[bytemuck::cast([[0, word, 0, 0_u16], [0; 4]])], &mut rows);
        f32::from_bits(rows[0].0[1])
    }

    fn narrowed(value: f32) -> u16 {
        let mut beats = [Beat::default()];
        narrow(&[Beat::default(), Beat([value.to_bits(); 4])], &mut beats);
        let [first, second]: [[u16; 4]; 2] = bytemuck::cast(beats[0]);
        assert_eq!((first, second), ([0; 4], [second[0]; 4]));
        second[0]
    }

    /// Every word comes back unchanged. A number between two words goes to the nearer one, and from
    /// the middle to the even one.
    #[test]
    fn binary16_is_rounded_to_nearest_even_over_its_whole_range() {
        for bits in 0..0x7BFF_u16 {
            let [low, high] = [bits, bits + 1].map(widened);
            // Both have eleven significant bits, so that the middle is exact in f32.
            let middle = f32::midpoint(low, high);
            let even = if bits % 2 == 0 { bits } else { bits + 1 };
            for (value, expected) in [
                (low, bits),
                (middle.next_down(), bits),
                (middle, even),
                (middle.next_up(), bits + 1),
            ] {
                assert_eq!(narrowed(value), expected, "{value:e}");
                assert_eq!(narrowed(-value), expected | 0x8000, "-{value:e}");
            }
        }
        assert_eq!(narrowed(65_504.0), 0x7BFF);
        assert_eq!(narrowed(f32::INFINITY), 0x7C00);
    }

    #[test]
    fn what_is_not_finite_comes_back_as_such() {
        for word in 0..=u16::MAX {
            assert_eq!(widened(word).is_finite(), word & 0x7C00 != 0x7C00, "{word:#06x}");
        }
    }
}
