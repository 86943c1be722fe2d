//! A source of collisions that packing reads in place, chunk by chunk, without a copy.

use std::iter;
use std::ops::Range;

use crate::scene::Collision;
use crate::simd::{later_with_those_behind, soon_alone, soon_with_those_behind};
use pgs_support::chunks::Chunks;

/// Collisions in the order in which they are sent, looked up where the caller keeps them.
///
/// Every implementation carries `#[inline(always)]`: each look-up becomes a part of the packing
/// loop.
pub(crate) trait CollisionSource<'a>: Copy {
    /// The number of collisions.
    fn len(self) -> usize;

    /// The `nth` chunk of `N` collisions, if it is complete.
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]>;

    /// The `nth` chunk of `N` collisions, if it is complete. Prefetches collisions of later chunks.
    fn next<const N: usize>(self, nth: usize) -> Option<Next<'a, N>>;

    /// The collisions of a range; a range past the end is cut.
    fn part(self, range: Range<usize>) -> Self;

    /// All collisions, one by one.
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

/// The chunk that is packed now, and the chunk whose bodies are prefetched.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Next<'a, const N: usize> {
    pub(crate) these: [&'a Collision; N],
    /// A later chunk, whose bodies the caller prefetches. `None` near the end, and where a prefetch
    /// costs more than it saves: the bodies of adjacent collisions are adjacent, too.
    pub(crate) soon: Option<[&'a Collision; N]>,
}

/// Prefetch distance in collisions: long enough for a collision to arrive in time, short enough
/// that it is not evicted before its turn.
const SOON: usize = 30;

/// The prefetch distance in an array, which needs no look-up of the index and may start earlier.
const SOON_IN_ARRAY: usize = 70;

/// The prefetch distance of bodies. The collision must have arrived by then: it holds their
/// indices.
const BODIES_SOON: usize = SOON / 2;

/// Prefetch distance into the second cache, line by line in memory order, for an order close to
/// memory order. Nearly all collisions are displaced by less than this distance, and lines this far
/// ahead stay in the cache until their turn. At the end of a thread's part, the prefetch covers the
/// beginning of the next part.
const NEARBY_LATER: usize = 1100;

/// Prefetch distance by index in such an order: most collisions come from the second cache then.
const NEARBY_SOON: usize = 14;

/// A collision is near its place in an array if its index differs by less than this. The inner
/// caches hold fewer collisions.
const NEARBY: usize = 4096;

/// One entry in this many is sampled to detect a nearby order.
const SAMPLED: usize = 64;

/// The elements of a range; a range past the end is cut.
#[inline(always)]
fn part<T>(all: &[T], range: Range<usize>) -> &[T] {
    let until = range.end.min(all.len());
    all.get(range.start..until).unwrap_or_default()
}

/// [`Structures::Array`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contiguous<'a>(pub(crate) &'a [Collision]);

impl<'a> CollisionSource<'a> for Contiguous<'a> {
    #[inline(always)]
    fn len(self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        self.0.split_arrays::<N>().0.get(nth).map(<[_; N]>::each_ref)
    }

    #[inline(always)]
    fn next<const N: usize>(self, nth: usize) -> Option<Next<'a, N>> {
        let these = self.some(nth)?;
        // The address may be past the end: a prefetch does not change the memory there.
        soon_with_those_behind::<N, _>(self.0, nth * N + SOON_IN_ARRAY);
        Some(Next { these, soon: None })
    }

    #[inline(always)]
    fn part(self, range: Range<usize>) -> Self {
        Self(part(self.0, range))
    }
}

/// [`Structures::Ordered`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Indexed<'a> {
    all: &'a [Collision],
    /// Indices of these collisions in `all`, followed by the indices of later parts.
    order: &'a [u32],
    /// The number of these collisions.
    count: usize,
}

impl<'a> Indexed<'a> {
    /// The collisions of a whole order.
    pub(crate) fn new(all: &'a [Collision], order: &'a [u32]) -> Self {
        Self { all, order, count: order.len() }
    }

    /// The collision at a place; past the end, a collision without contact points.
    #[inline(always)]
    fn at(self, place: u32) -> &'a Collision {
        match self.all.get(place as usize) {
            Some(collision) => collision,
            None => {
                // A predicted branch, as in `Ends::get`.
                pgs_support::cold_path();
                &Collision::NOTHING
            }
        }
    }

    /// Prefetches the `N` collisions that are `soon` entries after the start of the `nth` chunk.
    /// Returns the places from that start on, up to the last prefetched one; `None` if fewer are
    /// left.
    #[inline(always)]
    fn fetch_behind<const N: usize>(self, nth: usize, soon: usize) -> Option<&'a [u32]> {
        let places = self.order.get(nth * N..)?.get(..soon + N)?;
        for place in &places[soon..] {
            soon_alone(self.all, *place as usize);
        }
        Some(places)
    }

    /// The `nth` chunk of `N` collisions, near the end, where too few follow for a prefetch.
    #[inline(always)]
    fn last<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        Some(self.those(self.order.get(nth * N..)?.first_chunk()?))
    }

    /// The collisions at these places.
    #[inline(always)]
    fn those<const N: usize>(self, places: &[u32; N]) -> [&'a Collision; N] {
        let mut those = [&Collision::NOTHING; N];
        for (to, place) in those.iter_mut().zip(places) {
            *to = self.at(*place);
        }
        those
    }
}

impl<'a> CollisionSource<'a> for Indexed<'a> {
    #[inline(always)]
    fn len(self) -> usize {
        self.count
    }

    #[inline(always)]
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        let places = self.order.get(..self.count)?.split_arrays::<N>().0.get(nth)?;
        Some(self.those(places))
    }

    #[inline(always)]
    fn next<const N: usize>(self, nth: usize) -> Option<Next<'a, N>> {
        // One check of the length serves the chunk and both prefetches.
        let Some(places) = self.fetch_behind::<N>(nth, SOON) else {
            return Some(Next { these: self.last(nth)?, soon: None });
        };
        let soon = places[BODIES_SOON..].first_chunk().map(|places| self.those(places));
        Some(Next { these: self.those(places.first_chunk()?), soon })
    }

    #[inline(always)]
    fn part(self, range: Range<usize>) -> Self {
        let count = range.end.min(self.count).saturating_sub(range.start);
        Self { order: self.order.get(range.start..).unwrap_or_default(), count, ..self }
    }
}

/// [`Structures::Ordered`] in an order close to memory order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InNearbyOrder<'a> {
    order: Indexed<'a>,
    /// The index of the first of these collisions in the whole order.
    first: usize,
}

impl<'a> Indexed<'a> {
    /// These collisions, if nearly all are near their place in an array; `first` is the index of
    /// the first in the whole order. A place past the end does not count as far.
    pub(crate) fn nearby(self, first: usize) -> Option<InNearbyOrder<'a>> {
        let order = self.order.get(..self.count)?;
        let sampled = (first..).step_by(SAMPLED).zip(order.iter().step_by(SAMPLED));
        let (mut near, mut far) = (0, 0);
        for (entry, place) in sampled {
            let place = *place as usize;
            match entry.abs_diff(place) < NEARBY {
                true => near += 1,
                false => far += usize::from(place < self.all.len()),
            }
        }
        (near > 15 * far).then_some(InNearbyOrder { order: self, first })
    }
}

impl<'a> CollisionSource<'a> for InNearbyOrder<'a> {
    #[inline(always)]
    fn len(self) -> usize {
        self.order.len()
    }

    #[inline(always)]
    fn some<const N: usize>(self, nth: usize) -> Option<[&'a Collision; N]> {
        self.order.some(nth)
    }

    #[inline(always)]
    fn next<const N: usize>(self, nth: usize) -> Option<Next<'a, N>> {
        let Self { order, first } = self;
        later_with_those_behind::<N, _>(order.all, first + nth * N + NEARBY_LATER);
        let Some(places) = order.fetch_behind::<N>(nth, NEARBY_SOON) else {
            return Some(Next { these: order.last(nth)?, soon: None });
        };
        Some(Next { these: order.those(places.first_chunk()?), soon: None })
    }

    #[inline(always)]
    fn part(self, range: Range<usize>) -> Self {
        let first = self.first + range.start;
        Self { order: self.order.part(range), first }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` collisions; each holds its place in `body_a`.
    fn collisions(count: u32) -> Vec<Collision> {
        (0..count).map(|body_a| Collision { body_a, ..Collision::NOTHING }).collect()
    }

    fn names<'a>(some: impl IntoIterator<Item = &'a Collision>) -> Vec<u32> {
        some.into_iter().map(|collision| collision.body_a).collect()
    }

    /// Checks that a part ends at its own end, even if more collisions follow.
    fn parts_are_as_long_as_they_say<'a>(all: impl CollisionSource<'a>, expected: &[u32]) {
        let whole = all.part(10..90).part(15..200);
        assert_eq!(names(whole.iter()), expected[25..90]);
        for range in [0..0, 0..7, 30..60, 60..100, 95..130, 100..101, 200..230] {
            let part = all.part(range.clone());
            let there = super::part(expected, range);
            assert_eq!((part.len(), names(part.iter())), (there.len(), there.to_vec()));
            assert!(part.some::<2>(there.len() / 2).is_none());
            for (nth, pair) in there.split_arrays::<2>().0.iter().enumerate() {
                let next = part.next::<2>(nth).expect("as many");
                assert_eq!(names(next.these), pair);
            }
        }
    }

    #[test]
    fn a_part_is_as_long_as_it_says() {
        let all = collisions(100);
        let in_turn: Vec<u32> = (0..100).collect();
        parts_are_as_long_as_they_say(Contiguous(&all), &in_turn);
        // Backwards, with one place past the end.
        let mut order: Vec<u32> = in_turn.into_iter().rev().collect();
        order[40] = u32::MAX;
        let mut expected = order.clone();
        expected[40] = Collision::NOTHING.body_a;
        parts_are_as_long_as_they_say(Indexed::new(&all, &order), &expected);
        let near = Indexed::new(&all, &order).nearby(0).expect("a hundred lie near each other");
        parts_are_as_long_as_they_say(near, &expected);
        // The prefetch in memory order starts from the index of the entry.
        let part = near.part(10..90).part(15..200);
        assert_eq!(part.first, 25);
        assert!(part.next::<2>(3).expect("as many").soon.is_none());
    }

    #[test]
    fn an_order_is_nearby_where_nearly_all_of_it_lies_about_where_it_would() {
        let all = collisions(100_000);
        let in_turn: Vec<u32> = (0..100_000).collect();
        let nearby = |order: &[u32], range: Range<usize>| {
            let first = range.start;
            Indexed::new(&all, order).part(range).nearby(first).is_some()
        };
        assert!(nearby(&in_turn, 0..100_000) && nearby(&in_turn, 90_000..100_000));
        // Swapped in pairs; every third place is past the end.
        let mut swapped: Vec<u32> = in_turn.iter().map(|place| place ^ 1).collect();
        swapped.iter_mut().step_by(3).for_each(|place| *place = u32::MAX);
        assert!(nearby(&swapped, 0..100_000));
        let backwards: Vec<u32> = in_turn.iter().rev().copied().collect();
        assert!(!nearby(&backwards, 0..100_000) && !nearby(&backwards, 0..10_000));
        assert!(nearby(&backwards, 49_000..51_000));
        // A tenth lies elsewhere.
        let mut scattered = in_turn.clone();
        scattered.iter_mut().step_by(10).for_each(|place| *place = 99_999 - *place);
        assert!(!nearby(&scattered, 0..40_000));
        assert!(!nearby(&[], 0..0));
    }

    #[test]
    fn those_whose_bodies_are_fetched_are_a_little_behind() {
        let all = collisions(100);
        let order: Vec<u32> = (0..100).rev().collect();
        let part = Indexed::new(&all, &order).part(30..60);
        let soon = |nth| part.next::<2>(nth).expect("as many").soon.map(names);
        // Entries 30 + 15 and the next, even if they are past the end of the part.
        assert_eq!(soon(0), Some(vec![54, 53]));
        assert_eq!(soon(14), Some(vec![26, 25]));
        // The last chunks prefetch no bodies.
        let last = Indexed::new(&all, &order).part(90..100);
        assert!(last.next::<2>(0).expect("as many").soon.is_none());
        assert!(Contiguous(&all).next::<2>(0).expect("as many").soon.is_none());
    }
}
