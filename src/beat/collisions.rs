//! This file writes the collision segments of a step into the channels' buffers.
//!
//! As [`bodies`](super::bodies) writes theirs: by ranges for several threads, and in these block by block,
//! once, upwards, never read back.

use std::marker::PhantomData;
use std::ops::Range;
use std::{mem, ptr};

use bitstream_model::interface::profile::Geometry;
use bitstream_model::interface::record::Beat;

use super::collision_records::{Absolute, Encoding, Kind, LookedAt, Relative, Worded};
use super::deal::{BLOCK, Dealer};
use super::ranges::{Packers, Piece, Pieces, ranges, whole};
use super::stripe::Segment;
use super::target::Target;
use crate::platform::{Lanes, Vectors, Work, in_wide_vectors};
use crate::record::end::Ends;
use crate::scene::validate::{Block, Quick};
use crate::scene::{Collision, Collisions};

/// The collisions of a step, as they are sent.
#[derive(Debug)]
pub(crate) struct Entries<'a, C: ?Sized> {
    pub(crate) collisions: &'a C,
    /// Records, those that an order added included.
    pub(crate) count: usize,
    /// How many were added by the order that was made for them; `None` if there is none.
    pub(crate) added: Option<usize>,
    /// What stands in place of the bodies' indices, of each record. Only for
    /// [`Geometry::Relative`].
    pub(crate) words: Option<&'a [[u32; 2]]>,
}

/// Writes the records of collisions; the sum of the words written, modulo 2^32, and whether
/// validation refuses none.
///
/// A body that does not exist has its position written as zeros, and one without a shape is static.
/// Should a caller's [`Collisions`] answer differently from one look to the next, validation looks at
/// what is written; of what looks like padding it refuses more than the order added.
pub(crate) fn pack_collisions<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    channels: &mut [&mut [Beat]],
    packers: &mut Packers,
) -> (u32, bool) {
    let layout = Segment::Collisions.layout(target.variant);
    let (mut sum, mut good, mut paddings) = (0_u32, true, 0);
    let channels = whole(channels);
    let cut = |size| {
        let mut pieces = Pieces::new(&layout, size, channels);
        ranges(entries.count, size).map(move |range| (range, pieces.cut()))
    };
    let work = |part: (Range<usize>, Piece<'_>)| pack_range(target, ends, entries, part);
    packers.each(entries.count, cut, work, |(of_range, seen): (u32, Seen)| {
        sum = sum.wrapping_add(of_range);
        good &= seen.good;
        paddings += seen.paddings;
    });
    let as_many = target.quick.is_none() || entries.added.is_none_or(|added| added == paddings);
    (sum, good & as_many)
}

/// What was seen of collisions on their way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Whether validation refuses none.
    pub(super) good: bool,
    /// How many look like padding, where an order may have added some.
    paddings: usize,
}

impl Seen {
    /// Of none.
    const NOTHING: Self = Self { good: true, paddings: 0 };

    fn and(self, other: Self) -> Self {
        Self { good: self.good & other.good, paddings: self.paddings + other.paddings }
    }
}

/// Writes the records of a range of collisions, otherwise as [`pack_collisions`].
///
/// Here is only what depends on the caller's container: where each collision of a block lies. They
/// may lie anywhere, and those of the next block are on their way while a block is written.
fn pack_range<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    (range, mut channels): (Range<usize>, Piece<'_>),
) -> (u32, Seen) {
    let Entries { collisions, added, words, .. } = *entries;
    let marks = Marks { scheduled: added.is_some(), words };
    let mut packer = CollisionPacker::new(target, ends, marks, range.start, &mut channels);
    let mut seen = Seen::NOTHING;
    let (mut here, mut next) = (&mut [&ELSEWHERE; BLOCK], &mut [&ELSEWHERE; BLOCK]);
    let mut copies = [Collision::NOTHING; BLOCK];
    let until = range.end;
    let mut all_lie = find(collisions, range.start, &mut here[..range.len().min(BLOCK)]);
    for first in range.step_by(BLOCK) {
        let here_lie = all_lie;
        let behind = until.min(first + BLOCK);
        let ahead = &mut next[..(until - behind).min(BLOCK)];
        all_lie = find(collisions, behind, ahead);
        let block = &here[..behind - first];
        seen = seen.and(if here_lie {
            packer.write(block, ahead)
        } else {
            let mut block = *here;
            let elsewhere = (first..behind).zip(block.iter_mut().zip(&mut copies));
            for (index, (to, copy)) in
                elsewhere.filter(|(_, (to, _))| ptr::eq::<Collision>(**to, &raw const ELSEWHERE))
            {
                *copy = collisions.collision(index);
                *to = copy;
            }
            packer.write(&block[..behind - first], ahead)
        });
        mem::swap(&mut here, &mut next);
    }
    (packer.finish(), seen)
}

/// Where the next collisions lie, the first of which has the index `first`; whether all do. One that
/// does not lie there as it is ([`ELSEWHERE`]) will be asked for soon.
#[inline]
fn find<'a, C: Collisions + ?Sized>(
    collisions: &'a C,
    first: usize,
    to: &mut [&'a Collision],
) -> bool {
    to.fill(&ELSEWHERE);
    let all_lie = collisions.structures(first, to);
    if !all_lie {
        let places = (first..).zip(to.iter());
        let elsewhere = places.filter(|(_, at)| ptr::eq::<Collision>(**at, &raw const ELSEWHERE));
        elsewhere.for_each(|(index, _)| collisions.soon(index));
    }
    all_lie
}

/// Stands for a collision that does not lie anywhere as it is. Should a constant of the same value
/// have its address, that one is asked for once more, and is what it is.
static ELSEWHERE: Collision = Collision::NOTHING;

/// What is said of collisions beside what they hold.
#[derive(Debug, Clone, Copy)]
pub(super) struct Marks<'a> {
    /// Whether they are in an order that was made for them, which may have added some.
    pub(super) scheduled: bool,
    /// As in [`Entries`].
    pub(super) words: Option<&'a [[u32; 2]]>,
}

/// Writes collisions, a block at a time.
///
/// It knows nothing of the caller's container, so that it is compiled once, with the driver.
pub(super) struct CollisionPacker<'a, 'b> {
    quick: Option<&'a Quick<'a>>,
    ends: Ends<'a>,
    marks: Marks<'a>,
    dealer: Dealer<'a, 'b>,
    geometry: Geometry,
    /// The index of the next.
    next: usize,
}

impl<'a, 'b> CollisionPacker<'a, 'b> {
    /// From collision `first` on, with which a group begins.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel)
    /// says of what is written.
    pub(super) fn new(
        target: Target<'a>,
        ends: Ends<'a>,
        marks: Marks<'a>,
        first: usize,
        channels: &'a mut [&'b mut [Beat]],
    ) -> Self {
        let layout = Segment::Collisions.layout(target.variant);
        let geometry = target.variant.profile.geometry;
        let dealer = Dealer::new(&layout, channels);
        Self { quick: target.quick, ends, marks, dealer, geometry, next: first }
    }

    /// Writes the next collisions, at most [`BLOCK`]; only the last may be fewer. Those `ahead` are
    /// asked for next, and are on their way meanwhile.
    pub(super) fn write(&mut self, collisions: &[&Collision], ahead: &[&Collision]) -> Seen {
        let Self { quick, ends, marks: Marks { scheduled, words }, dealer, geometry, next } = self;
        let (quick, first) = (*quick, *next);
        *next += collisions.len();
        let block = Block { first, collisions, ends: *ends, scheduled: *scheduled };
        match (*geometry, *words) {
            (Geometry::Absolute, _) => in_wide_vectors(Writing {
                kind: Absolute,
                rows: PhantomData,
                quick,
                block,
                ahead,
                dealer,
            }),
            (Geometry::Relative, None) => in_wide_vectors(Writing {
                kind: Relative,
                rows: PhantomData,
                quick,
                block,
                ahead,
                dealer,
            }),
            (Geometry::Relative, Some(words)) => {
                let kind = Worded(words);
                in_wide_vectors(Writing { kind, rows: PhantomData, quick, block, ahead, dealer })
            }
        }
    }

    /// The index of the next collision.
    pub(super) const fn next(&self) -> usize {
        self.next
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(super) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// A block of collisions, and where it goes.
struct Writing<'p, 'a, 'b, K, const ROWS: usize> {
    kind: K,
    rows: PhantomData<[Lanes; ROWS]>,
    quick: Option<&'p Quick<'p>>,
    block: Block<'p>,
    ahead: &'p [&'p Collision],
    dealer: &'p mut Dealer<'a, 'b>,
}

impl<K: Kind<ROWS>, const ROWS: usize> Work for Writing<'_, '_, '_, K, ROWS> {
    type Output = Seen;

    /// Encodes, looks at and deals out.
    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> Seen {
        let Self { kind, quick, block, ahead, dealer, .. } = self;
        for collision in block.collisions {
            block.ends.soon([collision.body_a, collision.body_b]);
        }
        let mut records = Encoding::new(kind, &block, ahead);
        let Some(quick) = quick else {
            dealer.write(vectors, &mut records);
            return Seen::NOTHING;
        };
        let mut records = LookedAt::new(records, quick, block.scheduled);
        dealer.write(vectors, &mut records);
        Seen { paddings: records.paddings(), good: records.good(&block) }
    }
}
