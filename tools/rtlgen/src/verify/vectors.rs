//! Operands for the operators: random ones, and more of the rare cases than random bits have.

use pgs_support::random::SplitMix64;

/// The operands of one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Vector {
    /// First operand of the operators with two.
    pub a: u32,
    /// Second operand.
    pub b: u32,
    /// Operand of the square root.
    pub radicand: u32,
    /// Argument of sine and cosine; its two lowest bits are the flags of the logic.
    pub argument: u32,
}

/// Arguments of sine and cosine with a polynomial: 2^-12 to pi/8, as bits.
pub const POLYNOMIAL: std::ops::RangeInclusive<u32> = 0x3980_0000..=0x3EC9_1000;

/// Zeros, subnormals, the ends of the normal range, infinities, NaN, and numbers near 1.
const SPECIALS: [u32; 22] = [
    0x0000_0000,
    0x8000_0000,
    0x0000_0001,
    0x807F_FFFF,
    0x007F_FFFF,
    0x0080_0000,
    0x8080_0000,
    0x0080_0001,
    0x00FF_FFFF,
    0x0100_0000,
    0x7F7F_FFFF,
    0xFF7F_FFFF,
    0x7F80_0000,
    0xFF80_0000,
    0x7FC0_0000,
    0xFF80_0001,
    0x3F80_0000,
    0xBF80_0000,
    0x3F7F_FFFF,
    0x3F80_0001,
    0x3380_0000,
    0x3300_0000,
];

const SIGN: u32 = 0x8000_0000;
const FRACTION: u32 = 0x007F_FFFF;
const BIAS: u32 = 127;

/// The vectors of a seed, without an end.
#[derive(Debug)]
pub struct Vectors(SplitMix64);

impl Vectors {
    /// The same vectors for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// The number with this exponent, and the sign and fraction of other bits.
    fn with_exponent(bits: u32, exponent: u32) -> u32 {
        (bits & !0x7F80_0000) | (exponent.min(255) << 23)
    }

    /// A pair of one of ten kinds.
    fn pair(&mut self) -> (u32, u32) {
        let random = &mut self.0;
        let a = random.word();
        let b = random.word();
        let exponent = (a >> 23) & 0xFF;
        match random.word_below(10) {
            // Any bits.
            0 => (a, b),
            // Near exponents: every distance that the adder aligns.
            1 | 2 => {
                let near = (exponent + random.word_below(57)).saturating_sub(28);
                (a, Self::with_exponent(b, near))
            }
            // Cancellation: operands that differ in sign and in a few of the lowest bits.
            3 => (a, a ^ SIGN ^ random.word_below(16)),
            // Products about the smallest normal number, quotients about it in the other order.
            4 => {
                let product = random.between(BIAS - 3, BIAS + 3);
                (a, Self::with_exponent(b, product.saturating_sub(exponent)))
            }
            5 => {
                let difference = random.between(BIAS - 3, BIAS + 3);
                let low = random.word_below(BIAS);
                (Self::with_exponent(a, low), Self::with_exponent(b, low + difference))
            }
            // Results about the largest number.
            6 => {
                let exponent = random.between(BIAS, 254);
                let product = random.between(254 + BIAS - 3, 254 + BIAS + 3);
                (Self::with_exponent(a, exponent), Self::with_exponent(b, product - exponent))
            }
            // Few bits of fraction: exact results and ties.
            7 => (a & (u32::MAX << random.between(8, 23)), b & (u32::MAX << random.between(8, 23))),
            // A result of ones just below a power of two, most of all the smallest normal number.
            8 => self.ones(a, b),
            // Special operands, with others and with each other.
            _ => match random.word_below(3) {
                0 => (random.pick(&SPECIALS), b),
                1 => (a, random.pick(&SPECIALS)),
                _ => (random.pick(&SPECIALS), random.pick(&SPECIALS)),
            },
        }
    }

    /// Significands with a product just below a power of two, or a fraction of ones beside a power
    /// of two, with exponents at the lower end.
    fn ones(&mut self, a: u32, b: u32) -> (u32, u32) {
        let random = &mut self.0;
        let sum = random.between(BIAS - 1, BIAS + 1);
        let exponent = random.between(1, BIAS - 2);
        let other = sum - exponent;
        match random.word_below(3) {
            0 => {
                let significand = u64::from(a & FRACTION | 0x0080_0000);
                let partner = ((1_u64 << 47) - 1) / significand;
                let fraction = (partner & 0x007F_FFFF) as u32;
                let b = (b & SIGN) | fraction;
                (Self::with_exponent(a, exponent), Self::with_exponent(b, other))
            }
            1 => {
                let ones = (a & SIGN) | (FRACTION - random.word_below(2));
                (Self::with_exponent(ones, exponent), Self::with_exponent(b & SIGN, other))
            }
            // The same for a quotient.
            _ => {
                let ones = (a & SIGN) | (FRACTION - random.word_below(2));
                let divisor = (b & SIGN) | random.word_below(2);
                (Self::with_exponent(ones, exponent), Self::with_exponent(divisor, exponent + sum))
            }
        }
    }

    fn radicand(&mut self) -> u32 {
        let random = &mut self.0;
        let bits = random.word();
        match random.word_below(8) {
            // Negative numbers have no root, but for -0.
            0 => bits,
            // Squares of 12 bits, and their neighbours.
            1 => {
                let root = random.between(1, 4_095);
                let square = (root * root) << root.leading_zeros().saturating_sub(20);
                let shift = square.leading_zeros().saturating_sub(8);
                let fraction = (square << shift) & FRACTION;
                let number = Self::with_exponent(fraction, random.between(1, 254));
                number.wrapping_add(random.word_below(3)).wrapping_sub(1)
            }
            2 => random.pick(&SPECIALS),
            _ => bits & !SIGN,
        }
    }

    fn argument(&mut self) -> u32 {
        let random = &mut self.0;
        let sign = random.word() & SIGN;
        match random.word_below(16) {
            // Below 2^-12, zeros and subnormals among them, and the ends of the range.
            0 => sign | random.word_below(*POLYNOMIAL.start()),
            1 => {
                let ends = [*POLYNOMIAL.start() - 1, *POLYNOMIAL.start(), *POLYNOMIAL.end(), 0];
                sign | random.pick(&ends)
            }
            // Infinity and NaN.
            2 => sign | 0x7F80_0000 | (random.word() & random.pick(&[0, FRACTION])),
            _ => sign | random.between(*POLYNOMIAL.start(), *POLYNOMIAL.end()),
        }
    }
}

impl Iterator for Vectors {
    type Item = Vector;

    fn next(&mut self) -> Option<Vector> {
        let (a, b) = self.pair();
        Some(Vector { a, b, radicand: self.radicand(), argument: self.argument() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::reference;
    use super::*;

    #[test]
    fn a_seed_gives_the_same_vectors_and_another_seed_others() {
        let of = |seed| Vectors::new(seed).take(1_000).collect::<Vec<_>>();
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
    }

    /// The share of vectors, in per mille, that have a property.
    fn per_mille(property: impl Fn(&Vector) -> bool) -> usize {
        Vectors::new(7).take(100_000).filter(property).count() / 100
    }

    #[test]
    fn rare_cases_are_frequent() {
        let magnitude = |bits: u32| bits & !SIGN;
        let sum = |v: &Vector| magnitude(reference::add(v.a, v.b));
        let product = |v: &Vector| magnitude(reference::mul(v.a, v.b));
        let quotient = |v: &Vector| magnitude(reference::div(v.a, v.b));
        let infinite = 0x7F80_0000;
        // The rule of the smallest normal number decides.
        assert!(per_mille(|v| reference::mul(v.a, v.b) != reference::mul_unbounded(v.a, v.b)) > 5);
        assert!(per_mille(|v| reference::div(v.a, v.b) != reference::div_unbounded(v.a, v.b)) > 1);
        assert!(per_mille(|v| product(v) == 0) > 50);
        assert!(per_mille(|v| quotient(v) == 0) > 50);
        assert!(per_mille(|v| product(v) == infinite) > 50);
        assert!(per_mille(|v| quotient(v) == infinite) > 50);
        assert!(per_mille(|v| sum(v) + (10 << 23) < magnitude(v.a)) > 50);
        assert!(per_mille(|v| reference::is_nan(v.a) || reference::is_nan(v.b)) > 5);
        assert!(per_mille(|v| magnitude(v.a) == magnitude(v.b)) > 3);
        // Exact roots.
        let exact = |v: &Vector| {
            let root = reference::sqrt(v.radicand);
            magnitude(v.radicand) < infinite
                && reference::mul(root, root) == v.radicand
                && root & 0xFFF == 0
        };
        assert!(per_mille(exact) > 20);
        assert!(per_mille(|v| POLYNOMIAL.contains(&magnitude(v.argument))) > 700);
        assert!(per_mille(|v| magnitude(v.argument) < *POLYNOMIAL.start()) > 50);
    }

    #[test]
    fn every_distance_of_exponents_occurs() {
        let mut distances = [0_u32; 64];
        for vector in Vectors::new(3).take(100_000) {
            let exponents = [vector.a, vector.b].map(|bits| (bits >> 23) & 0xFF);
            let distance = exponents[0].abs_diff(exponents[1]) as usize;
            if let Some(count) = distances.get_mut(distance) {
                *count += 1;
            }
        }
        assert!(distances[..29].iter().all(|&count| count > 100), "{distances:?}");
    }
}
