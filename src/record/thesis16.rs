//! The thesis' sixteen-bit numbers: words from f32 by truncation, and back.
//!
//! ```text
//! f32     s eeeeeeee mmmmmmmmmm mmmmmmmmmmmmm
//!         |    \        |
//! word    s  fffff  mmmmmmmmmm          (1 + m / 1024) x 2^(F - 15), F = E - 112, for every F
//! ```
//!
//! There is no zero, no subnormal, no infinity. A magnitude below 2^-15, zero included, becomes the
//! word 0 with its sign, which reads as 2^-15. A magnitude of 2^16 or more becomes F = 31. The
//! accelerator writes F = 31 for every number that it cannot hold, and this module reads it as
//! infinite.
//!
//! Taken literally, the encoder cuts the three bits after the exponent's top bit out of E, whatever
//! they are: magnitudes below 2^-15 and from 2^17 on become words of other magnitudes.
//!
//! Source: thesis §4.6.4; interface specification, sixteen-bit numbers.

/// Bits of an f32 mantissa that a word has no room for.
const CUT: u32 = 13;
/// The exponent field of an f32 that becomes F = 0.
const LOWEST: u32 = 112;
/// Sign of an f32.
const SIGN: u32 = 1 << 31;
/// F = 0, m = 0 as the rest of an f32: 2^-15.
const SMALLEST: u32 = LOWEST << 23;
/// F = 31, m = 0 as the rest of an f32: 2^16.
const OVERFLOW: u32 = (LOWEST + 31) << 23;

/// The word of a number, given and made as bits.
#[inline(always)]
pub(super) fn narrow(bits: u32) -> u16 {
    // Clamped as integers: the bits of magnitudes are in the order of the magnitudes, and infinity
    // and NaN are above all numbers.
    let magnitude = (bits & !SIGN).clamp(SMALLEST, OVERFLOW) - SMALLEST;
    let word = ((bits & SIGN) >> 16) | (magnitude >> CUT);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a sign in bit 15, below it at most 0x7C00"
    )]
    let word = word as u16;
    word
}

/// [`narrow`] taken literally: the bits of the number that a word has, with no look at the others.
#[inline(always)]
pub(super) fn narrow_literal(bits: u32) -> u16 {
    let word = ((bits >> 16) & 0xC000) | ((bits >> CUT) & 0x3FFF);
    #[expect(clippy::cast_possible_truncation, reason = "both masks are below bit 16")]
    let word = word as u16;
    word
}

/// The number of a word, as the bits of an f32.
#[inline(always)]
pub(super) fn widen(word: u16) -> u32 {
    let word = u32::from(word);
    let sign = (word & 0x8000) << 16;
    let magnitude = ((word & 0x7FFF) << CUT) + SMALLEST;
    sign | if magnitude >= OVERFLOW { f32::INFINITY.to_bits() } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(value: f32) -> u16 {
        narrow(value.to_bits())
    }

    /// Compares with the written definition, in numbers. Every word except F = 31 comes back
    /// unchanged, and every f32 from it up to the next word is truncated to it.
    #[test]
    fn every_word_is_its_own_number_and_what_lies_above_it_is_cut_off() {
        for bits in 0..=u16::MAX {
            let (f, m) = ((bits >> 10) & 31, bits & 1023);
            let sign = if bits >> 15 == 0 { 1.0_f64 } else { -1.0 };
            let value = sign * (1.0 + f64::from(m) / 1024.0) * 2.0_f64.powi(i32::from(f) - 15);
            let found = f32::from_bits(widen(bits));
            if f == 31 {
                assert!(found.is_infinite() && (found > 0.0) == (sign > 0.0), "{bits:#06x}");
                continue;
            }
            assert_eq!(f64::from(found).to_bits(), value.to_bits(), "{bits:#06x}");
            assert_eq!(word(found), bits, "{bits:#06x}");
            // The last f32 before the next word.
            assert_eq!(narrow(found.to_bits() + 0x1FFF), bits, "{bits:#06x}");
        }
    }

    #[test]
    fn what_cannot_be_held_saturates() {
        for value in [0.0, 1e-45, f32::MIN_POSITIVE, 2.0_f32.powi(-15).next_down()] {
            assert_eq!((word(value), word(-value)), (0x0000, 0x8000), "{value:e}");
        }
        assert_eq!(word(65_504.0), 0x7BFF);
        assert_eq!(word(65_536.0_f32.next_down()), 0x7BFF);
        for value in [65_536.0, 1e30, f32::MAX, f32::INFINITY] {
            assert_eq!((word(value), word(-value)), (0x7C00, 0xFC00), "{value:e}");
        }
        assert_eq!(word(f32::NAN) & 0x7C00, 0x7C00);
    }

    #[test]
    fn taken_literally_small_magnitudes_become_others() {
        let literal = |value: f32| narrow_literal(value.to_bits());
        // Between 2^-15 and 2^16 the words are the same.
        for bits in 0..=u16::MAX {
            let found = widen(bits);
            if f32::from_bits(found).is_finite() {
                assert_eq!((narrow_literal(found), narrow_literal(found + 0x1FFF)), (bits, bits));
            }
        }
        for (value, reads) in [(0.0, -15), (2.0_f32.powi(-16), 0), (2.0_f32.powi(-30), -14)] {
            let read = |value| f32::from_bits(widen(literal(value)));
            let expected = 2.0_f32.powi(reads);
            assert_eq!(
                [read(value), read(-value)].map(f32::to_bits),
                [expected, -expected].map(f32::to_bits)
            );
        }
        assert_eq!((literal(65_536.0), literal(f32::INFINITY)), (0x7C00, 0x7C00));
    }

    #[test]
    fn zero_comes_back_as_two_to_the_minus_15() {
        assert_eq!(widen(0), 2.0_f32.powi(-15).to_bits());
        assert_eq!(widen(0x8000), (-2.0_f32.powi(-15)).to_bits());
    }
}
