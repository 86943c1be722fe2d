//! Numbers side by side in the two formats that the batch computes in: f32, and binary16 held as the
//! f32 of the same value. Each operation has the bits of the same one in `number.rs`.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use pgs_support::lanes::{F32x16, Instructions, Mask};

use super::block::Words;
use crate::accelerator::arithmetic::number::{Format, Half, Single};

/// A format that the batch computes in.
pub(crate) trait Computed: Format {
    /// Its arithmetic by these instructions.
    fn arithmetic(instructions: impl Instructions) -> impl Arithmetic;
}

impl Computed for Single {
    #[inline(always)]
    fn arithmetic(_: impl Instructions) -> impl Arithmetic {
        Singles
    }
}

impl Computed for Half {
    #[inline(always)]
    fn arithmetic(instructions: impl Instructions) -> impl Arithmetic {
        Halves(instructions)
    }
}

/// The arithmetic of a format in all lanes.
pub(crate) trait Arithmetic: Copy + Debug {
    /// The format.
    type Format: Format;

    /// The nearest number of the format in each lane.
    fn round(self, numbers: F32x16) -> F32x16;

    /// Takes numbers that are of the format already.
    #[inline(always)]
    fn of(self, numbers: F32x16) -> Numbers<Self> {
        Numbers(numbers, self)
    }

    /// The number of the format that is nearest to `number`, in every lane.
    #[inline(always)]
    fn splat(self, number: f32) -> Numbers<Self> {
        self.of(F32x16::splat(Self::Format::round(number)))
    }

    /// Loads numbers that are of the format already.
    #[inline(always)]
    fn load(self, words: &Words) -> Numbers<Self> {
        self.of(F32x16::from_array(*words))
    }
}

/// The arithmetic of f32.
#[derive(Debug, Clone, Copy)]
struct Singles;

impl Arithmetic for Singles {
    type Format = Single;

    #[inline(always)]
    fn round(self, numbers: F32x16) -> F32x16 {
        numbers
    }
}

/// The arithmetic of binary16. The instructions round the result of each operation.
#[derive(Debug, Clone, Copy)]
struct Halves<I>(I);

impl<I: Instructions> Arithmetic for Halves<I> {
    type Format = Half;

    #[inline(always)]
    fn round(self, numbers: F32x16) -> F32x16 {
        self.0.round_to_halves(numbers)
    }
}

/// One number of a format in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers<A>(F32x16, A);

impl<A: Arithmetic> Numbers<A> {
    /// The numbers as f32.
    #[inline(always)]
    pub(crate) fn lanes(self) -> F32x16 {
        self.0
    }

    #[inline(always)]
    pub(crate) fn store(self, words: &mut Words) {
        *words = self.0.to_array();
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.1.round(self.0.sqrt()), self.1)
    }

    /// The absolute value.
    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0.abs(), self.1)
    }

    /// Whether it is larger; false for a NaN.
    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> Mask {
        self.0.above(other.0)
    }

    /// Whether it is a zero of either sign.
    #[inline(always)]
    pub(crate) fn is_zero(self) -> Mask {
        self.0.is(F32x16::splat(0.0))
    }

    /// `if a > b then a else b`.
    #[inline(always)]
    pub(crate) fn larger(self, other: Self) -> Self {
        Self(self.0.larger(other.0), self.1)
    }

    /// `if a < b then a else b`.
    #[inline(always)]
    pub(crate) fn smaller(self, other: Self) -> Self {
        Self(self.0.smaller(other.0), self.1)
    }

    /// Selects these lanes where the mask is set, and `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: Mask, other: Self) -> Self {
        Self(self.0.or(mask, other.0), self.1)
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<A: Arithmetic> $operator for Numbers<A> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.1.round($operator::$method(self.0, other.0)), self.1)
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl<A: Arithmetic> Neg for Numbers<A> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, self.1)
    }
}

#[cfg(test)]
mod tests {
    use pgs_support::lanes::{InstructionSet, Instructions, LANES, Work};

    use super::*;
    use crate::accelerator::arithmetic::number::Number;
    use crate::accelerator::arithmetic::sixteen;

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
            let halves = Halves(instructions);
            let read = |numbers: Numbers<_>| numbers.lanes().to_array();
            for pairs in self.0.chunks(LANES) {
                let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
                for (lane, pair) in pairs.iter().enumerate() {
                    (a[lane], b[lane]) = *pair;
                }
                let (p, q) = (halves.load(&a), halves.load(&b));
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
            let halves = Halves(instructions);
            for numbers in self.0.chunks(LANES) {
                let mut words = [0.0; LANES];
                words[..numbers.len()].copy_from_slice(numbers);
                let found = halves.round(F32x16::from_array(words)).to_array();
                for (number, found) in numbers.iter().zip(found) {
                    let expected = Number::<Half>::new(*number).value();
                    assert_eq!(found.to_bits(), expected.to_bits(), "{instructions:?} {number:e}");
                }
            }
            let [first, ..] = halves.splat(0.1).lanes().to_array();
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
