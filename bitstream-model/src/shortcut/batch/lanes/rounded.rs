//! SIMD lanes with numbers in binary16, held as the f32 of the same value. Each result is rounded once
//! more, as in `number.rs`.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::block::Words;
use super::{Lanes, Numbers, Quad, Work};
use crate::accelerator::arithmetic::number::{Format, Half, Number, Single};

/// A format that lanes compute in.
pub(crate) trait Computed: Format {
    /// Lanes with numbers of the format.
    type In<L: Lanes>: Lanes;

    fn of<L: Lanes>(lanes: L) -> Self::In<L>;
}

impl Computed for Single {
    type In<L: Lanes> = L;

    #[inline(always)]
    fn of<L: Lanes>(lanes: L) -> L {
        lanes
    }
}

impl Computed for Half {
    type In<L: Lanes> = Rounded<L>;

    #[inline(always)]
    fn of<L: Lanes>(lanes: L) -> Rounded<L> {
        Rounded(lanes)
    }
}

/// Lanes with numbers in binary16. What is in memory is of that format.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rounded<L>(L);

/// A binary16 number in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sixteens<N>(N);

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<N: Numbers> $operator for Sixteens<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($operator::$method(self.0, other.0).to_binary16())
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl<N: Numbers> Neg for Sixteens<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl<N: Numbers> Numbers for Sixteens<N> {
    type Mask = N::Mask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt().to_binary16())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn above(self, other: Self) -> N::Mask {
        self.0.above(other.0)
    }

    #[inline(always)]
    fn is_zero(self) -> N::Mask {
        self.0.is_zero()
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(self.0.larger(other.0))
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self(self.0.smaller(other.0))
    }

    #[inline(always)]
    fn or(self, mask: N::Mask, other: Self) -> Self {
        Self(self.0.or(mask, other.0))
    }

    #[inline(always)]
    fn to_binary16(self) -> Self {
        self
    }

    #[inline(always)]
    fn with_words(self, other: Self) -> Self {
        Self(self.0.with_words(other.0))
    }
}

/// What runs with the lanes of a processor, and is given rounded ones.
struct InBinary16<W>(W);

impl<W: Work> Work for InBinary16<W> {
    #[inline(always)]
    fn with<L: Lanes>(self, lanes: L) {
        self.0.with(Rounded(lanes));
    }
}

impl<L: Lanes> Lanes for Rounded<L> {
    type Numbers = Sixteens<L::Numbers>;
    type Mask = L::Mask;

    const WIDTH: usize = L::WIDTH;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        self.0.run(InBinary16(work));
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Self::Numbers {
        Sixteens(self.0.splat(Number::<Half>::new(number).value()))
    }

    #[inline(always)]
    fn load(self, words: &Words, at: usize) -> Self::Numbers {
        Sixteens(self.0.load(words, at))
    }

    #[inline(always)]
    fn store(self, numbers: Self::Numbers, words: &mut Words, at: usize) {
        self.0.store(numbers.0, words, at);
    }

    #[inline(always)]
    fn counts(self, words: &Words<u32>, at: usize, mask: u32) -> Self::Numbers {
        Sixteens(self.0.counts(words, at, mask))
    }

    #[inline(always)]
    fn tested(self, words: &Words<u32>, at: usize, bit: u32) -> Self::Mask {
        self.0.tested(words, at, bit)
    }

    #[inline(always)]
    unsafe fn gather(
        self,
        quads: *const Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) -> [Self::Numbers; 4] {
        // SAFETY: the caller promises that these quads can be read and nobody writes them meanwhile,
        // which is all that the lanes within ask for.
        unsafe { self.0.gather(quads, index, at, half) }.map(Sixteens)
    }

    #[inline(always)]
    unsafe fn scatter(
        self,
        numbers: [Self::Numbers; 4],
        quads: *mut Quad,
        index: &Words<u32>,
        at: usize,
        half: usize,
    ) {
        // SAFETY: the caller promises that these quads can be written and nobody else accesses them
        // meanwhile, which is all that the lanes within ask for.
        unsafe { self.0.scatter(numbers.map(|number| number.0), quads, index, at, half) }
    }

    #[inline(always)]
    fn transposed(self, quads: &[Quad], stride: usize) -> [Self::Numbers; 4] {
        self.0.transposed(quads, stride).map(Sixteens)
    }

    #[inline(always)]
    fn spread(self, numbers: [Self::Numbers; 4], quads: &mut [Quad], stride: usize) {
        self.0.spread(numbers.map(|number| number.0), quads, stride);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::block::LANES;
    use super::super::super::width::Width;
    use super::super::Mask;
    use super::*;
    use crate::accelerator::arithmetic::sixteen;

    /// All NaNs as one.
    fn bits(number: f32) -> u32 {
        if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() }
    }

    /// What is held against what `number.rs` says, sixteen pairs at a time.
    struct Pairs<'a>(&'a [(f32, f32)]);

    impl Work for Pairs<'_> {
        fn with<L: Lanes>(self, lanes: L) {
            let rounded = Half::of(lanes);
            let read = |numbers: Sixteens<L::Numbers>| {
                let mut words = [0.0; LANES];
                rounded.store(numbers, &mut words, 0);
                words
            };
            for pairs in self.0.chunks(L::WIDTH) {
                let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
                for (lane, pair) in pairs.iter().enumerate() {
                    (a[lane], b[lane]) = *pair;
                }
                let (p, q) = (rounded.load(&a, 0), rounded.load(&b, 0));
                let [sums, differences] = [p + q, p - q].map(read);
                let [products, quotients] = [p * q, p / q].map(read);
                let [roots, opposites, absolutes] = [p.sqrt(), -p, p.abs()].map(read);
                let [larger, smaller] = [p.larger(q), p.smaller(q)].map(read);
                let [above, zero] = [p.above(q), p.is_zero()].map(Mask::bits);
                for (lane, (x, y)) in pairs.iter().enumerate() {
                    let (p, q) = (Number::<Half>::new(*x), Number::<Half>::new(*y));
                    let case = format!("{lanes:?} {x:e} {y:e}");
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

    /// Of numbers in f32.
    struct Conversions<'a>(&'a [f32]);

    impl Work for Conversions<'_> {
        fn with<L: Lanes>(self, lanes: L) {
            let mut words = [0.0; LANES];
            for numbers in self.0.chunks(L::WIDTH) {
                words[..numbers.len()].copy_from_slice(numbers);
                let converted = lanes.load(&words, 0).to_binary16();
                let mut found = [0.0; LANES];
                lanes.store(converted, &mut found, 0);
                for (number, found) in numbers.iter().zip(found) {
                    let expected = Number::<Half>::new(*number).value();
                    assert_eq!(bits(found), bits(expected), "{lanes:?} {number:e}");
                }
            }
            let splat = Half::of(lanes).splat(0.1);
            Half::of(lanes).store(splat, &mut words, 0);
            assert_eq!(words[0].to_bits(), Number::<Half>::new(0.1).value().to_bits());
        }
    }

    fn number(word: u16) -> f32 {
        sixteen::from_binary16(word.into())
    }

    #[test]
    fn operations_have_the_bits_of_one_number_after_the_other() {
        // Every number beside one that depends on it in no simple way, then few beside all of these.
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
        for width in Width::all() {
            // One after the other there are no lanes.
            let _ = width.run(Pairs(&pairs));
        }
    }

    #[test]
    fn all_kinds_of_numbers_are_rounded_to_the_nearest() {
        const TAILS: [u32; 9] = [0, 1, 0xFFF, 0x1000, 0x1001, 0x1FFF, 0x2000, 0x3000, 0xFFFF];
        let numbers: Vec<f32> = (0..=u16::MAX)
            .flat_map(|high| TAILS.map(|tail| f32::from_bits(u32::from(high) << 16 | tail)))
            .collect();
        for width in Width::all() {
            let _ = width.run(Conversions(&numbers));
        }
    }
}
