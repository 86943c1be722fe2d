//! Numbers side by side in the two formats that the batch computes in: f32, and binary16 held as the
//! f32 of the same value. Each operation has the bits of the same one in `number.rs`.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use pgs_support::lanes::{F32x16, Mask};

use super::block::Words;
use crate::accelerator::arithmetic::number::{Format, Half, Number, Single};
use crate::accelerator::arithmetic::sixteen;

/// One number of a format in each lane.
pub(crate) trait Numbers:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Takes numbers that are of the format already.
    fn of(numbers: F32x16) -> Self;

    /// The numbers as f32.
    fn lanes(self) -> F32x16;

    /// The nearest number of the format in each lane.
    fn splat(number: f32) -> Self;

    fn sqrt(self) -> Self;

    #[inline(always)]
    fn load(words: &Words) -> Self {
        Self::of(F32x16::from_array(*words))
    }

    #[inline(always)]
    fn store(self, words: &mut Words) {
        *words = self.lanes().to_array();
    }

    /// The absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        Self::of(self.lanes().abs())
    }

    /// Whether it is larger; false for a NaN.
    #[inline(always)]
    fn above(self, other: Self) -> Mask {
        self.lanes().above(other.lanes())
    }

    /// Whether it is a zero of either sign.
    #[inline(always)]
    fn is_zero(self) -> Mask {
        self.lanes().is(F32x16::splat(0.0))
    }

    /// `if a > b then a else b`.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self::of(self.lanes().larger(other.lanes()))
    }

    /// `if a < b then a else b`.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self::of(self.lanes().smaller(other.lanes()))
    }

    /// Selects these lanes where the mask is set, and `other` elsewhere.
    #[inline(always)]
    fn or(self, mask: Mask, other: Self) -> Self {
        Self::of(self.lanes().or(mask, other.lanes()))
    }
}

impl Numbers for F32x16 {
    #[inline(always)]
    fn of(numbers: Self) -> Self {
        numbers
    }

    #[inline(always)]
    fn lanes(self) -> Self {
        self
    }

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self::splat(number)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// A binary16 number in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sixteens(F32x16);

impl Sixteens {
    #[inline(always)]
    fn rounded(numbers: F32x16) -> Self {
        Self(numbers.map(sixteen::round_without_branches))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Sixteens {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self::rounded($operator::$method(self.0, other.0))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl Neg for Sixteens {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Numbers for Sixteens {
    #[inline(always)]
    fn of(numbers: F32x16) -> Self {
        Self(numbers)
    }

    #[inline(always)]
    fn lanes(self) -> F32x16 {
        self.0
    }

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self(F32x16::splat(Number::<Half>::new(number).value()))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::rounded(self.0.sqrt())
    }
}

/// A format that the batch computes in.
pub(crate) trait Computed: Format {
    /// Its numbers, side by side.
    type Numbers: Numbers;
}

impl Computed for Single {
    type Numbers = F32x16;
}

impl Computed for Half {
    type Numbers = Sixteens;
}

#[cfg(test)]
mod tests {
    use pgs_support::lanes::{InstructionSet, Instructions, LANES, Work};

    use super::*;

    /// All NaNs as one.
    fn bits(number: f32) -> u32 {
        if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() }
    }

    /// Compares binary16 operations on pairs with the operations of `number.rs`.
    struct Pairs<'a>(&'a [(f32, f32)]);

    impl Work for Pairs<'_> {
        type Output = ();

        #[inline(always)]
        fn run(self, instructions: impl Instructions) {
            let read = |numbers: Sixteens| numbers.lanes().to_array();
            for pairs in self.0.chunks(LANES) {
                let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
                for (lane, pair) in pairs.iter().enumerate() {
                    (a[lane], b[lane]) = *pair;
                }
                let (p, q) = (Sixteens::load(&a), Sixteens::load(&b));
                let [sums, differences] = [p + q, p - q].map(read);
                let [products, quotients] = [p * q, p / q].map(read);
                let [roots, opposites, absolutes] = [p.sqrt(), -p, p.abs()].map(read);
                let [larger, smaller] = [p.larger(q), p.smaller(q)].map(read);
                let [above, zero] = [p.above(q), p.is_zero()].map(Mask::bits);
                for (lane, (x, y)) in pairs.iter().enumerate() {
                    let (p, q) = (Number::<Half>::new(*x), Number::<Half>::new(*y));
                    let case = format!("{instructions:?} {x:e} {y:e}");
                    for (found, expected, what) in [
                        (sums, p + q, "sum"),
                        (differences, p - q, "difference"),
                        (products, p * q, "product"),
                        (quotients, p / q, "quotient"),
                        (roots, p.sqrt(), "square root"),
                        (opposites, -p, "opposite"),
                        (larger, p.larger(q), "larger"),
                        (smaller, p.smaller(q), "smaller"),
                    ] {
                        assert_eq!(bits(found[lane]), bits(expected.value()), "{what}: {case}");
                    }
                    assert_eq!(bits(absolutes[lane]), bits(x.abs()), "{case}");
                    assert_eq!(above >> lane & 1 != 0, p.above(q), "{case}");
                    assert_eq!(zero >> lane & 1 != 0, p.is_zero(), "{case}");
                }
            }
        }
    }

    /// Compares the rounding of f32 numbers with that of `number.rs`.
    struct Conversions<'a>(&'a [f32]);

    impl Work for Conversions<'_> {
        type Output = ();

        #[inline(always)]
        fn run(self, instructions: impl Instructions) {
            for numbers in self.0.chunks(LANES) {
                let mut words = [0.0; LANES];
                words[..numbers.len()].copy_from_slice(numbers);
                let found = Sixteens::rounded(F32x16::from_array(words)).lanes().to_array();
                for (number, found) in numbers.iter().zip(found) {
                    let expected = Number::<Half>::new(*number).value();
                    assert_eq!(bits(found), bits(expected), "{instructions:?} {number:e}");
                }
            }
            let [first, ..] = Sixteens::splat(0.1).lanes().to_array();
            assert_eq!(first.to_bits(), Number::<Half>::new(0.1).value().to_bits());
        }
    }

    fn number(word: u16) -> f32 {
        sixteen::from_binary16(word.into())
    }

    #[test]
    fn operations_have_the_bits_of_one_number_after_the_other() {
        // Every number beside one that depends on it in no simple way, then a few, each beside all of
        // them.
        let all = 0..=u16::MAX;
        let scattered = |word: u16| word.wrapping_mul(40_503).rotate_left(7) ^ 0x1234;
        let mut pairs: Vec<_> =
            all.clone().map(|word| (number(word), number(scattered(word)))).collect();
        let near = |word: u16| (number(word), number(word ^ 0x8000 ^ (word >> 3 & 7)));
        pairs.extend(all.map(near));
        let few: Vec<f32> = (0..64_u16)
            .flat_map(|high| [0, 1, 0x155, 0x200, 0x3FE, 0x3FF].map(|low| high << 10 | low))
            .map(number)
            .collect();
        pairs.extend(few.iter().flat_map(|a| few.iter().map(|b| (*a, *b))));
        for set in InstructionSet::all() {
            set.run(Pairs(&pairs));
        }
    }

    #[test]
    fn all_kinds_of_numbers_are_rounded_to_the_nearest() {
        const TAILS: [u32; 9] = [0, 1, 0xFFF, 0x1000, 0x1001, 0x1FFF, 0x2000, 0x3000, 0xFFFF];
        let numbers: Vec<f32> = (0..=u16::MAX)
            .flat_map(|high| TAILS.map(|tail| f32::from_bits(u32::from(high) << 16 | tail)))
            .collect();
        for set in InstructionSet::all() {
            set.run(Conversions(&numbers));
        }
    }
}
