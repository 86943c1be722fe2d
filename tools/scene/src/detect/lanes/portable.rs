//! The four lanes that every processor of the target has.

use std::ops::{Add, Div, Mul, Neg, Sub};

use wide::{CmpEq, CmpGe, CmpGt, f32x4};

use super::{Lanes, Mask, Numbers, Row, Work};

/// The lanes of the target.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Portable;

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Four(f32x4);

/// All bits of a lane or none.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct FourMask(f32x4);

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Four {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($operator::$method(self.0, other.0))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

/// The bit of the sign.
fn sign() -> f32x4 {
    f32x4::splat(-0.0)
}

impl Neg for Four {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0 ^ sign())
    }
}

impl Numbers for Four {
    type Mask = FourMask;

    #[inline(always)]
    fn all(self, number: f32) -> Self {
        Self(f32x4::splat(number))
    }

    #[inline(always)]
    fn row(self) -> Row {
        let mut row = Row::default();
        row.0[..4].copy_from_slice(&self.0.to_array());
        row
    }

    #[inline(always)]
    fn of_row(self, row: &Row) -> Self {
        Portable.load(row)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0 & !sign())
    }

    #[inline(always)]
    fn with_sign(self, other: Self) -> Self {
        Self((other.0 & sign()) | (self.0 & !sign()))
    }

    #[inline(always)]
    fn above(self, other: Self) -> FourMask {
        FourMask(self.0.cmp_gt(other.0))
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> FourMask {
        FourMask(self.0.cmp_ge(other.0))
    }

    #[inline(always)]
    fn is(self, other: Self) -> FourMask {
        FourMask(self.0.cmp_eq(other.0))
    }

    #[inline(always)]
    fn or(self, mask: FourMask, other: Self) -> Self {
        Self((mask.0 & self.0) | (!mask.0 & other.0))
    }
}

impl Mask for FourMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.move_mask().cast_unsigned() & 0b1111
    }
}

impl Lanes for Portable {
    type Numbers = Four;
    const WIDTH: usize = 4;

    #[inline(always)]
    fn run<W: Work>(self, work: W) {
        work.with(self);
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Four {
        let [a, b, c, d, ..] = row.0;
        Four(f32x4::new([a, b, c, d]))
    }
}
