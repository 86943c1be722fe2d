//! Rounds numbers to 16-bit formats, from the definitions of the formats: an implementation
//! independent of the driver's packing.

use pgs_interface::number::StreamFormat;

/// A 16-bit format of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NarrowFormat {
    /// IEEE 754, rounded to nearest even.
    Binary16,
    /// The thesis' own format, as this project writes it: small magnitudes become 2^-15.
    Thesis16,
    /// The thesis' own format taken literally: three bits of the exponent are cut out, and reading
    /// guesses them from the bit before.
    Thesis16Literal,
}

impl NarrowFormat {
    pub(crate) const ALL: [Self; 3] = [Self::Binary16, Self::Thesis16, Self::Thesis16Literal];

    /// The format of a stream; `None` for streams of more than sixteen bits.
    pub(crate) const fn of(stream: StreamFormat) -> Option<Self> {
        match stream {
            StreamFormat::F32 => None,
            StreamFormat::Binary16 => Some(Self::Binary16),
        }
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Binary16 => StreamFormat::Binary16.name(),
            Self::Thesis16 => "thesis16",
            Self::Thesis16Literal => "thesis16-literal",
        }
    }

    /// Writes a number and reads it back. `None` for a NaN, and for a number that the driver
    /// refuses to write; thesis16-literal has a word for every number, also for these.
    pub(crate) fn round_trip(self, value: f32) -> Option<f32> {
        let largest = match self {
            Self::Binary16 | Self::Thesis16 => StreamFormat::Binary16.largest(),
            Self::Thesis16Literal => return Some(literal(value)),
        };
        if value.is_nan() || value.abs() > largest {
            return None;
        }
        Some(match self {
            Self::Binary16 => binary16(value),
            _ => thesis16(value),
        })
    }
}

/// Smallest exponent of a normal binary16 number; smaller numbers keep its step.
const EXPONENT_MIN: i32 = -14;
/// Bits of the mantissa.
const MANTISSA: i32 = 10;

/// Exponent of a magnitude that is a normal f32.
fn exponent(value: f32) -> i32 {
    i32::from((value.to_bits() >> 23 & 0xFF) as u8) - 127
}

/// The nearest binary16 number; ties go to the even one. Only the rounding is inexact in f64.
fn binary16(value: f32) -> f32 {
    // A subnormal f32 is far below half of the smallest step.
    let step = 2.0_f64.powi(exponent(value).max(EXPONENT_MIN) - MANTISSA);
    let steps = (f64::from(value) / step).round_ties_even();
    #[allow(clippy::cast_possible_truncation, reason = "eleven bits and a power of two are exact")]
    let nearest = (steps * step) as f32;
    nearest.copysign(value)
}

/// Rounded toward zero, and not below 2^-15.
fn thesis16(value: f32) -> f32 {
    const SMALLEST: f32 = 1.0 / 32_768.0;
    if value.abs() < SMALLEST {
        return SMALLEST.copysign(value);
    }
    f32::from_bits(value.to_bits() & !0x1FFF)
}

/// Rounds a number as words of this format do, `None` for f32; one that a step refuses stays as it
/// is, also in thesis16-literal.
pub(crate) fn carried(format: Option<NarrowFormat>, value: f32) -> f32 {
    let taken = |_: &NarrowFormat| value.abs() <= StreamFormat::Binary16.largest();
    format.filter(taken).and_then(|format| format.round_trip(value)).unwrap_or(value)
}

/// Keeps the f32's sign, the top bit and the four low bits of the exponent, and ten bits of the
/// mantissa. The three bits between become the complement of the top bit, all others 0.
fn literal(value: f32) -> f32 {
    const KEPT: u32 = 0xC780_0000 | 0x007F_E000;
    const BETWEEN: u32 = 0x3800_0000;
    let kept = value.to_bits() & KEPT;
    let top = kept & 0x4000_0000 != 0;
    f32::from_bits(if top { kept } else { kept | BETWEEN })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bits(format: NarrowFormat, value: f32) -> Option<u32> {
        format.round_trip(value).map(f32::to_bits)
    }

    #[test]
    fn binary16_rounds_to_nearest_even() {
        for (value, expected) in [
            (0.0, 0.0),
            (-0.0, -0.0),
            (1.0, 1.0),
            // Half a step above 1 goes down to even, one and a half up.
            (1.0 + 1.0 / 2048.0, 1.0),
            (1.0 + 3.0 / 2048.0, 1.0 + 2.0 / 1024.0),
            (100.03, 100.0),
            (-100.04, -100.0625),
            (65_504.0, 65_504.0),
            // Subnormal: steps of 2^-24, half of one to 0.
            (6.0e-8, 5.960_464_5e-8),
            (2.98e-8, 0.0),
            (f32::from_bits(1), 0.0),
            // Up to the smallest normal number.
            (6.103_4e-5, 6.103_515_6e-5),
        ] {
            assert_eq!(
                bits(NarrowFormat::Binary16, value),
                Some(f32::to_bits(expected)),
                "{value}"
            );
        }
    }

    #[test]
    fn thesis16_is_cut_off_and_has_no_zero() {
        let smallest = 2.0_f32.powi(-15);
        for (value, expected) in [
            (1.0, 1.0),
            (1.000_976_5, 1.0),
            (-1.999_9, -1.999_023_4),
            (0.0, smallest),
            (-1e-9, -smallest),
            (smallest * 1.5, smallest * 1.5),
            (65_504.0, 65_504.0),
        ] {
            assert_eq!(
                bits(NarrowFormat::Thesis16, value),
                Some(f32::to_bits(expected)),
                "{value}"
            );
        }
    }

    #[test]
    fn what_the_driver_refuses_is_no_number() {
        for value in [65_505.0, -1e9, f32::INFINITY, f32::NAN] {
            assert_eq!(bits(NarrowFormat::Binary16, value), None, "{value}");
            assert_eq!(bits(NarrowFormat::Thesis16, value), None, "{value}");
        }
    }

    #[test]
    fn taken_literally_small_numbers_become_large() {
        let of = |value| bits(NarrowFormat::Thesis16Literal, value).map(f32::from_bits);
        assert_eq!(of(0.0), Some(2.0_f32.powi(-15)));
        // 2^-16 has the exponent bits of 1.0, apart from the three cut out.
        assert_eq!(of(2.0_f32.powi(-16)), Some(1.0));
        assert_eq!(of(-1.5 * 2.0_f32.powi(-16)), Some(-1.5));
        assert_eq!(of(2.0_f32.powi(17)), Some(2.0));
    }

    proptest! {
        #[test]
        fn between_its_limits_the_literal_format_is_ours(value in 3.1e-5_f32..65_504.0, minus: bool) {
            let value = if minus { -value } else { value };
            let of = |format| bits(format, value);
            prop_assert_eq!(of(NarrowFormat::Thesis16Literal), of(NarrowFormat::Thesis16));
        }

        #[test]
        fn what_binary16_gives_stays_as_it_is(word in 0_u16..0x7C00) {
            // Decodes every finite number of the format, as IEEE 754 defines it.
            let (field, mantissa) = (i32::from(word >> 10), f32::from(word & 0x3FF));
            let value = match field {
                0 => mantissa * 2.0_f32.powi(-24),
                _ => (1024.0 + mantissa) * 2.0_f32.powi(field - 25),
            };
            prop_assert_eq!(bits(NarrowFormat::Binary16, value), Some(value.to_bits()));
        }

        #[test]
        fn no_number_is_farther_than_half_a_step(value in 6.2e-5_f32..65_504.0) {
            let back = NarrowFormat::Binary16.round_trip(value).expect("in range");
            prop_assert!(((back - value) / value).abs() <= 1.0 / 2048.0);
        }
    }
}
