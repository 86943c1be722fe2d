//! This file says where the collisions lie that a caller keeps as structures: they are read there, without a
//! copy.

use std::iter;
use std::ops::Range;

use super::Collision;
use crate::platform::{soon_alone, soon_with_neighbours};

/// Where collisions lie ([`Collisions::structures`](super::Collisions::structures)).
#[derive(Debug, Clone, Copy)]
pub enum Structures<'a> {
    /// One behind the other, in their order.
    Array(&'a [Collision]),
    /// In an order of their own.
    Ordered {
        /// One behind the other.
        all: &'a [Collision],
        /// Where each of them lies in `all`. Beyond its end is one without contact points, which has no
        /// effect, and which a step refuses if it is a caller's.
        order: &'a [u32],
    },
}

impl Structures<'_> {
    /// Number of collisions.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Array(all) => all.len(),
            Self::Ordered { order, .. } => order.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Collisions that lie somewhere, to look up.
///
/// All of it is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(crate) trait Lying<'a>: Copy {
    /// Whether neighbours lie apart, and so do their bodies, which are asked for before they are needed.
    const APART: bool;

    /// How many there are.
    fn len(self) -> usize;

    /// The `nth` so many of them, if there are as many.
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]>;

    /// Says that these are asked for soon, and those before and behind them, too.
    fn soon<const N: usize>(self, nth: usize);

    /// Whether these, which are entry `first` and those behind it, lie apart, but about where they would
    /// lie one behind the other.
    fn is_nearby(self, first: usize) -> bool;

    /// Says that what lies at a place is asked for soon, and its neighbours, too.
    fn soon_at(self, place: usize);

    /// Those of a range, as many as there are.
    fn part(self, range: Range<usize>) -> Self;

    /// One after the other.
    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = &'a Collision> {
        let mut at = 0;
        iter::from_fn(move || {
            let [next] = self.some(at)?;
            at += 1;
            Some(next)
        })
    }
}

/// Entries from which on one is no longer where it would lie in an array: so many collisions are in
/// none of the inner caches.
const NEARBY: usize = 4096;

/// Those of a range, as many as there are.
#[inline(always)]
fn part<T>(all: &[T], range: Range<usize>) -> &[T] {
    let until = range.end.min(all.len());
    all.get(range.start..until).unwrap_or_default()
}

/// [`Structures::Array`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct InArray<'a>(pub(crate) &'a [Collision]);

impl<'a> Lying<'a> for InArray<'a> {
    const APART: bool = false;

    #[inline(always)]
    fn len(self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        self.0.as_chunks::<N>().0.get(nth).map(<[_; N]>::each_ref)
    }

    #[inline(always)]
    fn soon<const N: usize>(self, nth: usize) {
        for at in 0..N {
            self.soon_at(nth * N + at);
        }
    }

    #[inline(always)]
    fn is_nearby(self, _: usize) -> bool {
        false
    }

    #[inline(always)]
    fn soon_at(self, place: usize) {
        soon_with_neighbours(self.0, place);
    }

    #[inline(always)]
    fn part(self, range: Range<usize>) -> Self {
        Self(part(self.0, range))
    }
}

/// [`Structures::Ordered`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct InOrder<'a> {
    pub(crate) all: &'a [Collision],
    pub(crate) order: &'a [u32],
}

impl<'a> Lying<'a> for InOrder<'a> {
    const APART: bool = true;

    #[inline(always)]
    fn len(self) -> usize {
        self.order.len()
    }

    #[inline(always)]
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        let places = self.order.as_chunks::<N>().0.get(nth)?;
        let mut some = [&Collision::NOTHING; N];
        for (to, place) in some.iter_mut().zip(places) {
            if let Some(collision) = self.all.get(*place as usize) {
                *to = collision;
            }
        }
        Some(some)
    }

    #[inline(always)]
    fn soon<const N: usize>(self, nth: usize) {
        if let Some(places) = self.order.as_chunks::<N>().0.get(nth) {
            places.iter().for_each(|place| soon_alone(self.all, *place as usize));
        }
    }

    #[inline(always)]
    fn is_nearby(self, first: usize) -> bool {
        self.order.first().is_some_and(|place| first.abs_diff(*place as usize) < NEARBY)
    }

    #[inline(always)]
    fn soon_at(self, place: usize) {
        soon_with_neighbours(self.all, place);
    }

    #[inline(always)]
    fn part(self, range: Range<usize>) -> Self {
        Self { order: part(self.order, range), ..self }
    }
}
