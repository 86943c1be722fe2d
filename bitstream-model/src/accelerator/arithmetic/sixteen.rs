//! Conversions between f32 and the sixteen-bit formats, on the bits.

const SIGN: u32 = 0x8000_0000;
const INFINITY: u32 = 0x7F80_0000;
/// Mantissa bits that an f32 has beyond the ten of sixteen bits.
const EXTRA_BITS: u32 = 13;
/// The exponent's bias of an f32 less its bias in sixteen bits.
const REBIAS: u32 = 127 - 15;

const MANTISSA_BITS: u32 = 10;
const MANTISSA: u32 = (1 << MANTISSA_BITS) - 1;
const LARGEST_EXPONENT: u32 = 31;

/// 2^-14, binary16's smallest normal number, as the bits of an f32.
pub(crate) const SMALLEST_NORMAL: u32 = (REBIAS + 1) << 23;
/// 65520, half a step beyond binary16's largest number, as the bits of an f32.
const TOO_LARGE: u32 = ((REBIAS + 30) << 23) | (MANTISSA << EXTRA_BITS) | (1 << (EXTRA_BITS - 1));

/// The binary16 number nearest to `value`, as the f32 of the same value; a tie goes to the even
/// number. A magnitude of half a step or more beyond 65504 becomes infinite. A NaN loses its
/// payload.
///
/// Every operation in binary16 ends here. Zeros and normal numbers take integer operations alone;
/// the two branches are rarely taken.
#[inline]
pub(crate) fn round(value: f32) -> f32 {
    let bits = value.to_bits();
    let sign = bits & SIGN;
    let magnitude = bits ^ sign;
    if magnitude.wrapping_sub(1) < SMALLEST_NORMAL - 1 {
        // Between one half and one the steps of f32 are the steps of binary16 below 2^-14.
        let subnormal = (f32::from_bits(magnitude) + 0.5) - 0.5;
        return f32::from_bits(sign | subnormal.to_bits());
    }
    if magnitude >= TOO_LARGE {
        return if magnitude > INFINITY { f32::NAN } else { f32::from_bits(sign | INFINITY) };
    }
    let odd = (bits >> EXTRA_BITS) & 1;
    let half = (1 << (EXTRA_BITS - 1)) - 1;
    f32::from_bits((bits + half + odd) & !((1 << EXTRA_BITS) - 1))
}

/// A binary16 word as a number. It has no branch, so that the compiler vectorises it.
#[inline(always)]
pub(crate) fn from_binary16(word: u32) -> f32 {
    const LARGEST: u32 = LARGEST_EXPONENT << MANTISSA_BITS;
    let magnitude = word & 0x7FFF;
    // Ten bits in steps of 2^-24: exact.
    let steps = (magnitude & MANTISSA).cast_signed() as f32;
    let subnormal = (steps * f32::from_bits((127 - 24) << 23)).to_bits();
    let normal = (magnitude << EXTRA_BITS) + (REBIAS << 23);
    // From the largest exponent to that of an f32.
    let special = if magnitude >= LARGEST { REBIAS << 23 } else { 0 };
    let bits = if magnitude > MANTISSA { normal + special } else { subnormal };
    f32::from_bits(bits | ((word & 0x8000) << 16))
}

/// The word of the binary16 number nearest to a number.
pub(crate) fn to_binary16(value: f32) -> u32 {
    let value = round(value);
    let bits = value.to_bits();
    let sign = (bits & SIGN) >> 16;
    let magnitude = bits & !SIGN;
    sign | if value.is_nan() {
        0x7E00
    } else if magnitude >= INFINITY {
        LARGEST_EXPONENT << MANTISSA_BITS
    } else if magnitude < SMALLEST_NORMAL {
        // A multiple of 2^-24 below 2^-14: added to one half it is in the low bits.
        (f32::from_bits(magnitude) + 0.5).to_bits() & MANTISSA
    } else {
        (magnitude - (REBIAS << 23)) >> EXTRA_BITS
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the values are exact")]
mod tests {
    use super::*;

    fn same(a: f32, b: f32) -> bool {
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
    }

    #[test]
    fn every_binary16_word_reads_and_writes_as_in_the_half_crate() {
        for word in 0..=u16::MAX {
            let theirs = ::half::f16::from_bits(word).to_f32();
            let ours = from_binary16(word.into());
            assert!(same(ours, theirs), "{word:04x}");
            if !ours.is_nan() {
                assert_eq!(to_binary16(ours), u32::from(word));
                assert!(same(round(ours), ours), "{word:04x}");
            }
        }
        assert!(from_binary16(to_binary16(f32::NAN)).is_nan());
    }

    /// All f32 whose low mantissa bits decide a rounding, in every binade.
    #[test]
    fn rounding_is_that_of_the_half_crate() {
        const TAILS: [u32; 8] = [0, 1, 0xFFF, 0x1000, 0x1001, 0x1FFF, 0x0800, 0x1800];
        for high in 0..1 << 19 {
            for tail in TAILS {
                let value = f32::from_bits((high << EXTRA_BITS) | tail);
                let theirs = ::half::f16::from_f32(value);
                assert!(same(round(value), theirs.to_f32()), "{value:e}");
                if !value.is_nan() {
                    assert_eq!(to_binary16(value), u32::from(theirs.to_bits()), "{value:e}");
                }
            }
        }
    }

    /// Around the tie of every binary16 number, subnormal ones among them, and its successor.
    #[test]
    fn ties_go_to_the_even_word() {
        for word in 0..0x7C00_u16 {
            let low = f64::from(from_binary16(word.into()));
            let high =
                if word == 0x7BFF { 65_536.0 } else { from_binary16(u32::from(word) + 1).into() };
            #[expect(clippy::cast_possible_truncation, reason = "twelve bits, exact")]
            let tie = ((low + high) / 2.0) as f32;
            let even = u32::from(word) + u32::from(word & 1);
            assert_eq!(to_binary16(tie), even, "{word:04x}");
            assert_eq!(to_binary16(-tie), even | 0x8000, "{word:04x}");
            assert_eq!(to_binary16(f32::from_bits(tie.to_bits() - 1)), word.into());
            assert_eq!(to_binary16(f32::from_bits(tie.to_bits() + 1)), u32::from(word) + 1);
        }
    }
}
