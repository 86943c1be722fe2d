//! This file makes the records of a block of collisions, and has them looked at on their way.

use bitstream_model::interface::record::{collision, relative};

use super::format::Records;
use crate::platform::{Lanes, prefetch};
use crate::record;
use crate::record::end::{End, Ends};
use crate::scene::Collision;
use crate::scene::validate::{Block, Look, Quick, Reach};

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

/// The records of a block of collisions. Those ahead are fetched meanwhile.
pub(super) struct Encoding<'p, K> {
    kind: K,
    first: usize,
    collisions: &'p [&'p Collision],
    ahead: &'p [&'p Collision],
    ends: Ends<'p>,
}

impl<'p, K> Encoding<'p, K> {
    /// Those of a block. Of those `ahead` as many are fetched; if they are fewer, none.
    #[inline(always)]
    pub(super) fn new(kind: K, block: &Block<'p>, ahead: &'p [&'p Collision]) -> Self {
        let Block { first, collisions, ends, .. } = *block;
        // Those of a last block that is not whole come by themselves.
        let ahead = ahead.get(..collisions.len()).unwrap_or(collisions);
        Self { kind, first, collisions, ahead, ends }
    }

    /// A record, with the collision and the ends that it is made of.
    #[inline(always)]
    fn take<const ROWS: usize>(&self, at: usize) -> Option<([Lanes; ROWS], &'p Collision, [End; 2])>
    where
        K: Kind<ROWS>,
    {
        let (collision, ahead) = (self.collisions.get(at)?, self.ahead.get(at)?);
        prefetch::<Collision>(ahead);
        let ends = both(self.ends, collision);
        Some((self.kind.encode(self.first + at, collision, ends), collision, ends))
    }
}

impl<K: Kind<ROWS>, const ROWS: usize> Records<ROWS> for Encoding<'_, K> {
    const INTEGERS: [bool; ROWS] = K::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline(always)]
    fn get(&mut self, at: usize) -> Option<[Lanes; ROWS]> {
        self.take(at).map(|(record, ..)| record)
    }
}

/// The same, looked at on their way.
pub(super) struct LookedAt<'p, K> {
    records: Encoding<'p, K>,
    quick: &'p Quick<'p>,
    look: Look<'p>,
    scheduled: bool,
}

impl<'p, K: Copy> LookedAt<'p, K> {
    #[inline(always)]
    pub(super) fn new(records: Encoding<'p, K>, quick: &'p Quick<'p>, scheduled: bool) -> Self {
        Self { records, quick, look: Look::new(quick), scheduled }
    }

    /// How many of those taken look like padding.
    #[inline(always)]
    pub(super) fn paddings(&self) -> usize {
        self.look.paddings()
    }

    /// Whether validation refuses none of the block, all of whose records were taken.
    #[inline(always)]
    pub(super) fn good<const ROWS: usize>(self, block: &Block<'_>) -> bool
    where
        K: Kind<ROWS>,
    {
        let Self { records: Encoding { kind, .. }, look, .. } = self;
        let reaches = (block.first..).zip(block.collisions).map(|(index, collision)| {
            let record = kind.encode(index, collision, both(block.ends, collision));
            K::reach(&record, collision.count)
        });
        look.good(block, reaches)
    }
}

impl<K: Kind<ROWS>, const ROWS: usize> Records<ROWS> for LookedAt<'_, K> {
    const INTEGERS: [bool; ROWS] = K::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.records.collisions.len()
    }

    #[inline(always)]
    fn get(&mut self, at: usize) -> Option<[Lanes; ROWS]> {
        let (record, collision, ends) = self.records.take(at)?;
        self.look.head(collision, ends, self.scheduled);
        self.look.numbers(K::beyond(self.quick, &record, collision.count));
        if self.look.asks_how_far() {
            self.look.reach(&K::reach(&record, collision.count), ends);
        }
        Some(record)
    }
}
