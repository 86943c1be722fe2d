//! Writes the collision segments of a step into the channels' buffers.
//!
//! Threads take ranges of collisions, and a range goes by blocks that fit in the cache: one loop
//! looks a collision up, checks it and makes its rows, then the block is dealt out. Packing reports
//! that the input is wrong, but not the cause.

use std::ops::Range;

use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, collision};

use super::Target;
use super::deal::Dealer;
use super::format::beats_of;
use super::impulses::{WarmDealer, WarmSegments, WarmSums};
use super::pool::{ChannelChunks, PackPool, Piece, ranges, whole};
use super::stripe::{BLOCK, Segment};
use crate::record::Magnitudes;
use crate::record::body_table::Ends;
use crate::record::collision::encode;
use crate::scene::{Collision, Collisions, Impulses, Structures};
use crate::simd::prefetch_at;
use crate::validate::Scene;

/// The collisions of a step, as they are sent.
#[derive(Debug)]
pub(crate) struct Entries<'a, C: ?Sized> {
    pub(crate) collisions: &'a C,
    /// Number of records, with the entries that an order added.
    pub(crate) count: usize,
    /// Number of entries that the order added; `None` without an order.
    pub(crate) added: Option<usize>,
}

/// The sums of the collisions that were written, and the result of their checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Packed {
    /// The sum of the words of a pass without impulses, modulo 2^32.
    pub(crate) sum: u32,
    pub(crate) warm: WarmSums,
    /// Whether validation accepts all of them.
    pub(crate) good: bool,
    /// Number of collisions without contact points.
    pub(crate) paddings: usize,
}

impl Packed {
    /// The result of no collisions.
    const NOTHING: Self = Self { sum: 0, warm: WarmSums::NONE, good: true, paddings: 0 };

    fn and(self, other: Self) -> Self {
        Self {
            sum: self.sum.wrapping_add(other.sum),
            warm: self.warm.and(other.warm),
            good: self.good & other.good,
            paddings: self.paddings + other.paddings,
        }
    }
}

/// Writes the records of collisions, and in a step with a warm start the segments of the warm
/// passes. A collision without contact points is written as padding.
///
/// A body that does not exist has a position of zeros, and a body without a shape is static. The
/// records are never sent if validation does not accept all of them.
///
/// Each collision is read once: a caller's [`Collisions`] may answer differently from one read to
/// the next, and the check applies to the collisions as written. With an order, the number of
/// paddings must be the number of entries that the order added: it has left out the caller's
/// collisions without contact points.
pub(crate) fn pack_collisions<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    channels: &mut [&mut [Beat]],
    warm: Option<WarmSegments<'_>>,
    packers: &mut PackPool,
) -> Packed {
    let work = |part: Part<'_>| pack_range(entries, part);
    let Entries { count, added, .. } = *entries;
    let mut packed = pack_parts((target.scene, ends), count, channels, warm, packers, &work);
    packed.good &= added.is_none_or(|added| added == packed.paddings);
    packed
}

/// A range of entries, and their packer.
type Part<'a> = (Range<usize>, CollisionPacker<'a>);

/// [`pack_collisions`] by the work on each range.
fn pack_parts<'a>(
    (scene, ends): (&'a Scene<'a>, Ends<'a>),
    count: usize,
    channels: &'a mut [&mut [Beat]],
    mut warm: Option<WarmSegments<'a>>,
    packers: &mut PackPool,
    work: &(dyn Fn(Part<'a>) -> Packed + Sync),
) -> Packed {
    let mut packed = Packed::NOTHING;
    let channels = whole(channels);
    let cut = |size| {
        let layout = Segment::Collisions.layout(scene.variant);
        let mut pieces = ChannelChunks::new(&layout, size, channels);
        ranges(count, size).map(move |range| {
            let warm = warm.as_mut().map(|warm| warm.cut(scene.variant, size));
            (range, CollisionPacker::new(scene, ends, pieces.cut(), warm))
        })
    };
    packers.each(count, cut, work, |of_range| packed = packed.and(of_range));
    packed
}

/// Packs a range of collisions.
///
/// Only this function depends on the caller's container: it finds where the collisions lie. It
/// copies them one by one if they do not lie in memory as structures, or if the number of
/// structures is not `count`.
fn pack_range<C: Collisions + ?Sized>(
    entries: &Entries<'_, C>,
    (range, mut packer): Part<'_>,
) -> Packed {
    let Entries { collisions, count, .. } = *entries;
    let lying = collisions.structures().filter(|all| all.len() == count);
    let mut copies = [Collision::NOTHING; BLOCK];
    for first in range.clone().step_by(BLOCK) {
        let block = first..range.end.min(first + BLOCK);
        match lying {
            Some(Structures::Array(all)) => packer.write(&all[first..], &IN_ARRAY, block.len()),
            Some(Structures::Ordered { all, order }) => {
                packer.write(all, &Places::of(&order[first..]), block.len());
            }
            None => {
                // Prefetches the whole block before the first collision is copied.
                block.clone().for_each(|index| collisions.prefetch(index));
                for (to, index) in copies.iter_mut().zip(block.clone()) {
                    *to = collisions.collision(index);
                }
                packer.write(&copies, &IN_ARRAY, block.len());
            }
        }
        packer.write_impulses(block.len(), |at, normal, points| {
            collisions.impulses(first + at, normal, points)
        });
    }
    packer.finish()
}

/// Prefetch distance in collisions: long enough for a collision to arrive in time, short enough
/// that it is not evicted before its turn.
const SOON: usize = 30;

/// The prefetch distance of bodies. The collision must have arrived by then: it holds their
/// indices.
const BODIES_SOON: usize = SOON / 2;

/// The places of a block's collisions in an array, and of the next collisions.
pub(crate) struct Places([u32; BLOCK + SOON]);

impl Places {
    /// The first places of an order.
    fn of(order: &[u32]) -> Self {
        let mut places = [u32::MAX; BLOCK + SOON];
        let count = order.len().min(places.len());
        places[..count].copy_from_slice(&order[..count]);
        Self(places)
    }
}

/// The places in the order of memory.
pub(crate) const IN_ARRAY: Places = {
    let mut places = [0; BLOCK + SOON];
    let mut at = 1;
    while at < places.len() {
        places[at] = places[at - 1] + 1;
        at += 1;
    }
    Places(places)
};

/// The rows of a collision record that end in an integer.
const INTEGERS: [usize; 3] = [collision::NORMAL, collision::BODY_A, collision::BODY_B];

/// Checks and writes collisions, a block at a time.
///
/// It is independent of the caller's container, so that it is compiled once, with the driver.
pub(crate) struct CollisionPacker<'a> {
    scene: &'a Scene<'a>,
    ends: Ends<'a>,
    dealer: Dealer<'a>,
    warm: Option<WarmDealer<'a>>,
    /// The rows of a block, and its beats in a stream of sixteen bits.
    rows: [[Beat; collision::ROWS]; BLOCK],
    halves: [[Beat; collision::ROWS]; BLOCK.div_ceil(2)],
    /// Number of beats in the block that was written last.
    beats: usize,
    good: bool,
    paddings: usize,
}

impl<'a> CollisionPacker<'a> {
    /// Begins with a collision that begins a group.
    ///
    /// Shape: each channel is as long as
    /// [`Layout::beats_on_channel`](crate::beat::stripe::Layout::beats_on_channel) says for the
    /// collisions that are written.
    pub(crate) fn new(
        scene: &'a Scene<'a>,
        ends: Ends<'a>,
        channels: Piece<'a>,
        warm: Option<WarmDealer<'a>>,
    ) -> Self {
        let layout = Segment::Collisions.layout(scene.variant);
        // The stream's indices must name all bodies.
        let named = ends.len() as u64 <= u64::from(layout.format.largest_index()) + 1;
        let (rows, halves) = (
            [[Beat::default(); collision::ROWS]; BLOCK],
            [[Beat::default(); collision::ROWS]; BLOCK.div_ceil(2)],
        );
        let dealer = Dealer::new(layout, channels);
        Self { scene, ends, dealer, warm, rows, halves, beats: 0, good: named, paddings: 0 }
    }

    /// Whether validation accepts all collisions so far.
    pub(crate) const fn is_good(&self) -> bool {
        self.good
    }

    /// Writes the next collisions, which lie at the first `count` of these places; a place past the
    /// end is a collision without contact points. `count` is [`BLOCK`], except at the end.
    pub(crate) fn write(&mut self, all: &[Collision], places: &Places, count: usize) {
        let Self { scene, ends, .. } = *self;
        let Places(places) = places;
        let (mut good, mut paddings) = (true, 0);
        let mut largest = Magnitudes::default();
        let ahead = places[BODIES_SOON..].iter().zip(&places[SOON..]);
        for ((place, (soon, later)), rows) in places[..count].iter().zip(ahead).zip(&mut self.rows)
        {
            prefetch_at(all, *later as usize);
            if let Some(soon) = all.get(*soon as usize) {
                ends.prefetch(soon.body_a);
                ends.prefetch(soon.body_b);
            }
            let collision = at(all, *place);
            let pair = [collision.body_a, collision.body_b].map(|body| ends.get(body));
            let points = scene.points(collision);
            encode(collision, points, pair, rows);
            for row in &rows[collision::CONTACTS..] {
                largest.see(*row);
            }
            let padding = collision.is_empty();
            good &= padding | scene.accepts(collision, points, pair);
            paddings += usize::from(padding);
        }
        good &= largest.are_within(scene.held.collisions.largest());
        if let Some(bounds) = &scene.short_rows {
            let mut positions = Magnitudes::default();
            for rows in &self.rows[..count] {
                positions.see(rows[collision::BODY_A]);
                positions.see(rows[collision::BODY_B]);
            }
            good &= bounds.all_fit(largest, positions)
                || places[..count].iter().all(|place| scene.rows_fit(at(all, *place), ends));
        }
        self.good &= good;
        self.paddings += paddings;
        let Self { dealer, rows, halves, .. } = self;
        let layout = dealer.layout;
        let beats = beats_of(&layout, (rows, count), &INTEGERS, halves.as_flattened_mut());
        self.beats = beats.len();
        dealer.write(beats);
    }

    /// Writes the impulses of the `count` collisions that were written last: `impulses` has them, by
    /// the place of a collision among these, its normal and number of points.
    #[inline]
    fn write_impulses(
        &mut self,
        count: usize,
        impulses: impl Fn(usize, [f32; 3], u32) -> Impulses,
    ) {
        let Self { warm: Some(warm), dealer, rows, halves, beats, .. } = self else { return };
        warm.take(&rows[..count], impulses);
        let all = match dealer.layout.format {
            StreamFormat::F32 => rows.as_flattened(),
            StreamFormat::Binary16 => halves.as_flattened(),
        };
        warm.write(&all[..*beats], count);
    }

    /// Ends the segments.
    pub(crate) fn finish(&self) -> Packed {
        let Self { scene, dealer, warm, good, paddings, .. } = self;
        let limit = scene.held.impulses.largest();
        let good = *good && warm.as_ref().is_none_or(|warm| warm.are_within(limit));
        let warm = warm.as_ref().map_or(WarmSums::NONE, WarmDealer::sums);
        Packed { sum: dealer.sum(), warm, good, paddings: *paddings }
    }
}

/// The collision at a place. [`Collision::NOTHING`] replaces a collision without contact points,
/// whose other values may be anything.
#[inline(always)]
fn at(all: &[Collision], place: u32) -> &Collision {
    let collision = all.get(place as usize).unwrap_or(&Collision::NOTHING);
    if collision.is_empty() { &Collision::NOTHING } else { collision }
}
