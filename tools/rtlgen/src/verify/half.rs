//! The operators of binary16: a reference in integers, from `rustc_apfloat`, and operands for them.
//! Subnormal numbers are kept.

use pgs_support::random::SplitMix64;
use rustc_apfloat::ieee::{Double, Half, Single};
use rustc_apfloat::{Float, FloatConvert as _};

use super::operators::{Operator, pair};
use super::vectors::Vector;

/// The NaN that every operation gives.
const NAN: u16 = 0x7E00;
const SIGN: u16 = 0x8000;
const INFINITY: u16 = 0x7C00;
const FRACTION: u16 = 0x03FF;

/// The operators of `operators_half_top.v`.
pub static OPERATORS: [Operator; 13] = [
    Operator {
        name: "add",
        latency: 5,
        expected: |v| bits_of((first(v) + second(v)).value).into(),
        found: |outputs| outputs[0].into(),
    },
    Operator {
        name: "mul",
        latency: 5,
        expected: |v| bits_of((first(v) * second(v)).value).into(),
        found: |outputs| outputs[1].into(),
    },
    Operator {
        name: "div",
        latency: 11,
        expected: |v| bits_of((first(v) / second(v)).value).into(),
        found: |outputs| outputs[2].into(),
    },
    Operator {
        name: "sqrt",
        latency: 9,
        expected: |v| sqrt(low(v.radicand)).into(),
        found: |outputs| outputs[3].into(),
    },
    Operator {
        name: "sincos",
        latency: 12,
        expected: |v| {
            let argument = f32::from_bits(widened(low(v.radicand >> 16)));
            let [sine, cosine] = [libm::sinf(argument), libm::cosf(argument)];
            pair(rounded(sine.to_bits()).into(), rounded(cosine.to_bits()).into())
        },
        found: |outputs| pair(outputs[4], outputs[5]),
    },
    Operator {
        name: "max",
        latency: 1,
        expected: |v| max(v).into(),
        found: |outputs| outputs[6].into(),
    },
    Operator {
        name: "min",
        latency: 1,
        expected: |v| min(v).into(),
        found: |outputs| outputs[7].into(),
    },
    Operator {
        name: "select",
        latency: 1,
        expected: |v| low(if chosen(v) { v.a } else { v.b }).into(),
        found: |outputs| outputs[8].into(),
    },
    Operator {
        name: "from binary32",
        latency: 3,
        expected: |v| rounded(v.argument).into(),
        found: |outputs| outputs[9].into(),
    },
    Operator {
        name: "less",
        latency: 1,
        expected: |v| (first(v) < second(v)).into(),
        found: |outputs| (outputs[11] & 1).into(),
    },
    Operator {
        name: "nonzero",
        latency: 1,
        expected: |v| (chosen(v) && !first(v).is_zero()).into(),
        found: |outputs| (outputs[11] >> 1).into(),
    },
    Operator {
        name: "max, or a third",
        latency: 1,
        expected: |v| if chosen(v) { max(v) } else { low(v.radicand) }.into(),
        found: |outputs| outputs[12].into(),
    },
    Operator {
        name: "min, or a third",
        latency: 1,
        expected: |v| if chosen(v) { min(v) } else { low(v.radicand) }.into(),
        found: |outputs| outputs[13].into(),
    },
];

fn low(word: u32) -> u16 {
    (word & 0xFFFF) as u16
}

fn number(bits: u16) -> Half {
    Half::from_bits(bits.into())
}

fn bits_of(number: Half) -> u16 {
    if number.is_nan() { NAN } else { (number.to_bits() & 0xFFFF) as u16 }
}

fn first(vector: &Vector) -> Half {
    number(low(vector.a))
}

fn second(vector: &Vector) -> Half {
    number(low(vector.b))
}

fn chosen(vector: &Vector) -> bool {
    vector.argument & 1 == 1
}

/// `a > b ? a : b`.
fn max(vector: &Vector) -> u16 {
    low(if first(vector) > second(vector) { vector.a } else { vector.b })
}

/// `a < b ? a : b`.
fn min(vector: &Vector) -> u16 {
    low(if first(vector) < second(vector) { vector.a } else { vector.b })
}

/// The number nearest to a binary32 one.
fn rounded(bits: u32) -> u16 {
    bits_of(Single::from_bits(bits.into()).convert(&mut false).value)
}

/// The binary32 number of the same value.
fn widened(bits: u16) -> u32 {
    let wide: Single = number(bits).convert(&mut false).value;
    (wide.to_bits() & 0xFFFF_FFFF) as u32
}

/// Square root, of an integer: `rustc_apfloat` has none.
fn sqrt(a: u16) -> u16 {
    const BITS: i32 = 20;
    let magnitude = a & !SIGN;
    if magnitude == 0 || a == INFINITY {
        return a;
    }
    if a & SIGN != 0 || magnitude > INFINITY {
        return NAN;
    }
    // a = significand * 2^exponent, with an even exponent.
    let field = i32::from(a >> 10);
    let significand = u64::from(a & FRACTION) + if field > 0 { 1 << 10 } else { 0 };
    let exponent = field.max(1) - 25;
    let square = significand << (exponent.rem_euclid(2) + 2 * BITS);
    let root = square.isqrt();
    // A last bit stands for everything below it.
    let root = root << 1 | u64::from(root * root != square);
    let exact = Double::from_u128(root.into()).value.scalbn(exponent.div_euclid(2) - BITS - 1);
    bits_of(exact.convert(&mut false).value)
}

/// Operands of a seed, without an end, in strata.
///
/// *Two operands.* A stratum is a pair of signs and a pair of exponents: 4,096 of them, which take
/// turns, so that each has the same share. Each fraction is one of the edges in half of the vectors
/// and random in the others.
///
/// *One operand.* Every number takes its turn: 65,536 vectors hold all of them. The argument of the
/// sine is in the range of the operator, or NaN or infinity.
///
/// *A binary32 number.* Near each binary16 number, above and below a tie, and now and then any bits.
#[derive(Debug)]
pub struct Vectors {
    random: SplitMix64,
    count: u32,
}

impl Vectors {
    /// The same vectors for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { random: SplitMix64::new(seed), count: 0 }
    }

    fn fraction(&mut self) -> u16 {
        const EDGES: [u16; 12] =
            [0, 1, 2, 3, 0x155, 0x1FF, 0x200, 0x201, 0x2AA, 0x3FD, 0x3FE, 0x3FF];
        let random = self.random.word();
        if random & 1 == 1 { low(random >> 1) & FRACTION } else { self.random.pick(&EDGES) }
    }

    /// A number of a class: its sign and exponent.
    fn of_class(&mut self, class: u32) -> u16 {
        low(class << 10) | self.fraction()
    }

    fn binary32(&mut self, near: u16) -> u32 {
        const EDGES: [u32; 7] = [0, 1, 0x0FFF, 0x1000, 0x1001, 0x1FFF, 0x0800];
        let random = self.random.word();
        match random & 3 {
            0 => self.random.word(),
            1 => widened(near) ^ (random >> 19),
            // Half of a step of the subnormal numbers and more.
            2 => (random & 0x807F_FFFF) | (self.random.between(100, 114) << 23),
            _ => widened(near) ^ self.random.pick(&EDGES),
        }
    }

    fn argument(&self) -> u16 {
        match low(self.count) & 0x3FFF {
            within @ 0..LAST_ARGUMENT => within,
            beyond => INFINITY | (beyond & FRACTION),
        }
    }
}

/// A little above pi/8, which the integration may reach by rounding.
const LAST_ARGUMENT: u16 = 0x3680;

impl Iterator for Vectors {
    type Item = Vector;

    fn next(&mut self) -> Option<Vector> {
        let [a, b] = [self.count, self.count >> 6].map(|class| self.of_class(class & 0x3F));
        let each = low(self.count);
        let radicand = u32::from(self.argument()) << 16 | u32::from(each);
        let argument = self.binary32(each);
        self.count = self.count.wrapping_add(1);
        Some(Vector { a: a.into(), b: b.into(), radicand, argument })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_pair_of_signs_and_exponents_has_the_same_share() {
        let mut counts = vec![0; 4_096];
        for Vector { a, b, .. } in Vectors::new(1).take(3 * 4_096) {
            counts[((a >> 10) << 6 | b >> 10) as usize] += 1;
        }
        assert!(counts.iter().all(|count| *count == 3));
    }

    #[test]
    fn every_number_is_a_radicand_and_every_one_in_the_range_an_argument() {
        let vectors: Vec<Vector> = Vectors::new(1).take(1 << 16).collect();
        let radicands: BTreeSet<u16> = vectors.iter().map(|v| low(v.radicand)).collect();
        assert_eq!(radicands.len(), 1 << 16);
        let arguments: BTreeSet<u16> = vectors.iter().map(|v| low(v.radicand >> 16)).collect();
        assert!((0..LAST_ARGUMENT).chain([INFINITY, NAN]).all(|word| arguments.contains(&word)));
        // Half of the largest angle of a step.
        let largest = rounded((pgs_interface::profile::solver::ROTATION_LIMIT / 2.0).to_bits());
        assert!(largest + 8 < LAST_ARGUMENT);
    }

    #[test]
    fn square_roots_are_those_of_the_standard_library_rounded_once_more() {
        for bits in 0..=u16::MAX {
            let root = f32::from_bits(widened(bits)).sqrt();
            assert_eq!(sqrt(bits), rounded(root.to_bits()), "{bits:04x}");
        }
    }

    #[test]
    fn subnormal_numbers_are_kept_and_ties_go_to_the_even_one() {
        let of = |a: u16, b: u16| {
            let vector = Vector { a: a.into(), b: b.into(), ..Vector::default() };
            OPERATORS[..3].iter().map(|operator| (operator.expected)(&vector)).collect::<Vec<_>>()
        };
        // The smallest number and one; one and a half; the smallest normal number and two.
        assert_eq!(of(0x0001, 0x3C00), [0x3C00, 0x0001, 0x0001]);
        assert_eq!(of(0x0001, 0x3800)[1..], [0x0000, 0x0002]);
        assert_eq!(of(0x0003, 0x3800)[1..], [0x0002, 0x0006]);
        assert_eq!(of(0x0400, 0x4000)[2], 0x0200);
        assert_eq!(of(INFINITY, SIGN | INFINITY), [NAN, SIGN | INFINITY, NAN].map(u64::from));
    }
}
