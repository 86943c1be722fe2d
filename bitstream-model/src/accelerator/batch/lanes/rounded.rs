//! This file is the lanes of any processor with numbers in binary16, held as the f32 of the same
//! value: what an operation gives is rounded once more, as in `number.rs`.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::super::number::{Format, Half, Number, Single};
use super::super::block::Words;
use super::{Lanes, Numbers, Quad, Work};

/// A format that lanes compute in.
pub(in super::super) trait Computed: Format {
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
pub(in super::super) struct Rounded<L>(L);

/// A binary16 number in each lane.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Sixteens<N>(N);

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
        // SAFETY: the caller promises it.
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
        // SAFETY: the caller promises it.
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
