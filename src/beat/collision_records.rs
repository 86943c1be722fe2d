//! This file makes the records of a block of collisions, and has them looked at on their way.

use bitstream_model::interface::record::{collision, relative};

use super::format::Records;
use crate::platform::Lanes;
use crate::record;
use crate::record::end::{End, Ends};
use crate::scene::validate::{Block, Look, Quick, Reach};
use crate::scene::{Collision, Lying};

/// A kind of collision record of `ROWS` rows.
pub(super) trait Kind<const ROWS: usize>: Copy {
    /// Rows whose word is an unsigned integer.
    const INTEGERS: [bool; ROWS];

    /// The record of collision `index`.
    fn encode(self, index: usize, from: &Collision, ends: [End; 2]) -> [Lanes; ROWS];

    /// Bits where a number is beyond what the stream holds.
    fn beyond(quick: &Quick<'_>, record: &[Lanes; ROWS], count: u32) -> Lanes;

    /// How far the contact points are.
    fn reach(record: &[Lanes; ROWS], count: u32) -> Reach;
}

/// Records in world coordinates.
#[derive(Clone, Copy)]
pub(super) struct Absolute;

impl Kind<{ collision::ROWS }> for Absolute {
    const INTEGERS: [bool; collision::ROWS] = record::collision::INTEGERS;

    #[inline(always)]
    fn encode(self, _: usize, from: &Collision, ends: [End; 2]) -> [Lanes; collision::ROWS] {
        record::collision::encode(from, ends)
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; collision::ROWS], _: u32) -> Lanes {
        quick.beyond_absolute(record)
    }

    #[inline(always)]
    fn reach([_, a, b, points @ ..]: &[Lanes; collision::ROWS], count: u32) -> Reach {
        Reach::new([*a, *b], *points, count)
    }
}

/// Records relative to body A.
#[derive(Clone, Copy)]
pub(super) struct Relative;

impl Kind<{ relative::ROWS }> for Relative {
    const INTEGERS: [bool; relative::ROWS] = record::relative::INTEGERS;

    #[inline(always)]
    fn encode(self, _: usize, from: &Collision, ends: [End; 2]) -> [Lanes; relative::ROWS] {
        let ends = record::relative::anchors(ends, ends.map(|end| !end.is_static()));
        record::relative::encode(from, ends)
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; relative::ROWS], count: u32) -> Lanes {
        quick.beyond_relative(record, count)
    }

    #[inline(always)]
    fn reach([_, offset, points @ ..]: &[Lanes; relative::ROWS], count: u32) -> Reach {
        Reach::new([Lanes::all(0), *offset], *points, count)
    }
}

/// The same, with these words in place of the indices of each one's bodies.
#[derive(Clone, Copy)]
pub(super) struct Worded<'a>(pub(super) &'a [[u32; 2]]);

impl Kind<{ relative::ROWS }> for Worded<'_> {
    const INTEGERS: [bool; relative::ROWS] = Relative::INTEGERS;

    #[inline(always)]
    fn encode(self, index: usize, from: &Collision, ends: [End; 2]) -> [Lanes; relative::ROWS] {
        let [body_a, body_b] = self.0[index];
        Relative.encode(index, &Collision { body_a, body_b, ..*from }, ends)
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; relative::ROWS], count: u32) -> Lanes {
        Relative::beyond(quick, record, count)
    }

    #[inline(always)]
    fn reach(record: &[Lanes; relative::ROWS], count: u32) -> Reach {
        Relative::reach(record, count)
    }
}

/// The ends of a collision's bodies.
#[inline(always)]
fn both(ends: Ends<'_>, collision: &Collision) -> [End; 2] {
    [collision.body_a, collision.body_b].map(|body| ends.get(body))
}

/// The records of a block of collisions. What is behind it is fetched meanwhile.
pub(super) struct Encoding<'p, K, L> {
    kind: K,
    first: usize,
    collisions: L,
    /// Those that are asked for meanwhile.
    soon: L,
    /// Those whose bodies are.
    bodies_soon: L,
    ends: Ends<'p>,
    /// Whether they lie about where they would in an array.
    nearby: bool,
}

/// How far behind a collision is asked for: so far that it is there in time, so near that it is not gone
/// again.
const SOON: usize = 30;

/// The same of its bodies, which it has to say by then.
const BODIES_SOON: usize = SOON / 2;

/// How far behind what lies about there is asked for, where the order is near to that in memory: from
/// there it comes line by line, which takes longer than [`SOON`] if it is not in a cache.
const FAR: usize = 768;

impl<'p, K, L: Lying<'p>> Encoding<'p, K, L> {
    /// Those of a block, the first of which is number `at` of `all`.
    #[inline(always)]
    pub(super) fn new(kind: K, block: &Block<'p, L>, all: L, at: usize) -> Self {
        let Block { first, collisions, ends, .. } = *block;
        let behind = |distance| all.part(at + distance..at + distance + collisions.len());
        let (soon, bodies_soon) = (behind(SOON), behind(BODIES_SOON));
        let nearby = collisions.is_nearby(first);
        Self { kind, first, collisions, soon, bodies_soon, ends, nearby }
    }

    /// The `nth` so many records, if there are as many, with the collisions and the ends that they are
    /// made of.
    #[inline(always)]
    fn made<const ROWS: usize, const N: usize>(&self, nth: usize) -> Option<Made<'p, ROWS, N>>
    where
        K: Kind<ROWS>,
    {
        let collisions = self.collisions.some::<N>(nth)?;
        self.soon.soon::<N>(nth);
        // Bodies of neighbours are neighbours.
        if L::APART
            && let Some(collisions) = self.bodies_soon.some::<N>(nth)
        {
            for collision in collisions {
                self.ends.soon([collision.body_a, collision.body_b]);
            }
        }
        let first = self.first + nth * N;
        if self.nearby {
            for at in 0..N {
                self.collisions.soon_at(first + FAR + at);
            }
        }
        let mut made =
            Made { records: [[Lanes::all(0); ROWS]; N], collisions, ends: [[End::MISSING; 2]; N] };
        for (at, collision) in collisions.into_iter().enumerate() {
            made.ends[at] = both(self.ends, collision);
            made.records[at] = self.kind.encode(first + at, collision, made.ends[at]);
        }
        Some(made)
    }
}

/// Records, and what they are made of.
struct Made<'p, const ROWS: usize, const N: usize> {
    records: [[Lanes; ROWS]; N],
    collisions: [&'p Collision; N],
    ends: [[End; 2]; N],
}

impl<'p, K: Kind<ROWS>, L: Lying<'p>, const ROWS: usize> Records<ROWS> for Encoding<'p, K, L> {
    const INTEGERS: [bool; ROWS] = K::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize) -> Option<[[Lanes; ROWS]; N]> {
        let Made { records, .. } = self.made(nth)?;
        Some(records)
    }
}

/// The same, looked at on their way.
pub(super) struct LookedAt<'p, K, L> {
    records: Encoding<'p, K, L>,
    quick: &'p Quick<'p>,
    look: Look<'p>,
    scheduled: bool,
}

impl<'p, K: Copy, L: Lying<'p>> LookedAt<'p, K, L> {
    #[inline(always)]
    pub(super) fn new(records: Encoding<'p, K, L>, quick: &'p Quick<'p>, scheduled: bool) -> Self {
        Self { records, quick, look: Look::new(quick), scheduled }
    }

    /// How many of those taken look like padding.
    #[inline(always)]
    pub(super) fn paddings(&self) -> usize {
        self.look.paddings()
    }

    /// Whether validation refuses none of the block, all of whose records were taken.
    #[inline(always)]
    pub(super) fn good<const ROWS: usize>(self, block: &Block<'p, L>) -> bool
    where
        K: Kind<ROWS>,
    {
        let Self { records: Encoding { kind, .. }, look, .. } = self;
        let reaches = (block.first..).zip(block.collisions.iter()).map(|(index, collision)| {
            let record = kind.encode(index, collision, both(block.ends, collision));
            K::reach(&record, collision.count)
        });
        look.good(block, reaches)
    }
}

impl<'p, K: Kind<ROWS>, L: Lying<'p>, const ROWS: usize> Records<ROWS> for LookedAt<'p, K, L> {
    const INTEGERS: [bool; ROWS] = K::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.records.collisions.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize) -> Option<[[Lanes; ROWS]; N]> {
        let Made { records, collisions, ends } = self.records.made(nth)?;
        for ((record, collision), ends) in records.iter().zip(collisions).zip(ends) {
            self.look.head(collision, ends, self.scheduled);
            self.look.numbers(K::beyond(self.quick, record, collision.count));
            if self.look.asks_how_far() {
                self.look.reach(&K::reach(record, collision.count), ends);
            }
        }
        Some(records)
    }
}
