//! Rounds f32 to binary16 on the bits, for processors without instructions that convert.

const SIGN: u32 = 0x8000_0000;
const INFINITY: u32 = 0x7F80_0000;
/// Mantissa bits that an f32 has beyond the ten of binary16.
const EXTRA_BITS: u32 = 13;
/// 2^-14, binary16's smallest normal number, as the bits of an f32.
const SMALLEST_NORMAL: u32 = (127 - 14) << 23;
/// 65520, half a step beyond binary16's largest number, as the bits of an f32.
const TOO_LARGE: u32 = ((127 + 15) << 23) | (0x7FF << (EXTRA_BITS - 1));

/// The binary16 number nearest to `value`, as the f32 of the same value.
/// [`round_to_halves`](super::Instructions::round_to_halves) says the rules.
///
/// It has no branch, so that the compiler vectorises it.
#[inline(always)]
pub(super) fn nearest(value: f32) -> f32 {
    let magnitude = value.to_bits() & !SIGN;
    let sign = value.to_bits() & SIGN;
    // Between one half and one the steps of f32 are the steps of binary16 below 2^-14.
    let subnormal = ((f32::from_bits(magnitude) + 0.5) - 0.5).to_bits();
    let odd = (magnitude >> EXTRA_BITS) & 1;
    let half = (1 << (EXTRA_BITS - 1)) - 1;
    let normal = (magnitude + half + odd) & !((1 << EXTRA_BITS) - 1);
    let finite = if magnitude < SMALLEST_NORMAL { subnormal } else { normal };
    let rounded = if magnitude < TOO_LARGE { finite } else { INFINITY };
    // The sum overflows for a NaN alone.
    f32::from_bits(if magnitude > INFINITY { f32::NAN.to_bits() } else { sign | rounded })
}
