//! This file writes the collision segments of a step into the channels' buffers.
//!
//! As [`bodies`](super::bodies) writes theirs: block by block, once, upwards, never read back.

use bitstream_model::interface::profile::Geometry;
use bitstream_model::interface::record::{Beat, collision, relative};

use super::deal::{BLOCK, Dealer};
use super::stage::Stage;
use super::stripe::{Layout, Segment};
use super::target::Target;
use crate::platform::{Work, in_wide_vectors};
use crate::record;
use crate::record::end::{End, Ends};
use crate::scene::validate::{Block, Quick, head};
use crate::scene::{CONTACT_POINTS, Collision, Collisions, Contact};

/// The collisions of a step, as they are sent.
#[derive(Debug)]
pub(crate) struct Entries<'a, C: ?Sized> {
    pub(crate) collisions: &'a C,
    /// Records, those that an order added included.
    pub(crate) count: usize,
    /// Whether they are in an order that was made for them, which may have added some.
    pub(crate) scheduled: bool,
    /// What stands in place of the bodies' indices, of each record. Only for
    /// [`Geometry::Relative`].
    pub(crate) words: Option<&'a [[u32; 2]]>,
}

/// A kind of collision record of `ROWS` rows.
pub(super) trait Kind<const ROWS: usize> {
    /// Rows whose word is an unsigned integer.
    const INTEGERS: [bool; ROWS];

    /// The record of collision `index`.
    fn encode(&self, index: usize, from: &Collision, ends: [End; 2]) -> [Beat; ROWS];

    /// Whether validation refuses nothing of a block, whose records these are.
    fn look(quick: &Quick<'_>, block: &Block<'_>, records: &[[Beat; ROWS]]) -> bool;
}

/// Records in world coordinates.
pub(super) struct Absolute;

impl Kind<{ collision::ROWS }> for Absolute {
    const INTEGERS: [bool; collision::ROWS] = record::collision::INTEGERS;

    #[inline(always)]
    fn encode(&self, _: usize, from: &Collision, ends: [End; 2]) -> [Beat; collision::ROWS] {
        record::collision::encode(from, ends)
    }

    #[inline(always)]
    fn look(quick: &Quick<'_>, block: &Block<'_>, records: &[[Beat; collision::ROWS]]) -> bool {
        quick.absolute(block, records)
    }
}

/// Records relative to body A, and what stands in place of the bodies' indices.
pub(super) struct Relative<'a> {
    pub(super) words: Option<&'a [[u32; 2]]>,
}

impl Kind<{ relative::ROWS }> for Relative<'_> {
    const INTEGERS: [bool; relative::ROWS] = record::relative::INTEGERS;

    /// Nobody reads the marks of padding, so that a collision which had contact points when the
    /// marks were made and has none now would shift all bodies behind it: it is sent as one to be
    /// refused.
    #[inline(always)]
    fn encode(&self, index: usize, from: &Collision, ends: [End; 2]) -> [Beat; relative::ROWS] {
        let ends = record::relative::anchors(ends, ends.map(|end| !end.is_static()));
        let Some(words) = self.words else { return record::relative::encode(from, ends) };
        let (mut collision, mut words) = (*from, words[index]);
        if collision.count == 0 && words != [0; 2] {
            (collision.count, words) = (1, REFUSED);
        }
        [collision.body_a, collision.body_b] = words;
        record::relative::encode(&collision, ends)
    }

    #[inline(always)]
    fn look(quick: &Quick<'_>, block: &Block<'_>, records: &[[Beat; relative::ROWS]]) -> bool {
        quick.relative(block, records)
    }
}

/// What no record of a live body holds; the accelerator refuses a collision of it with itself.
const REFUSED: [u32; 2] = [u32::MAX; 2];

/// Writes the records of collisions; the sum of the words written, modulo 2^32, and whether
/// validation refuses none.
///
/// A body that does not exist has its position written as zeros, and one without a shape is static.
/// Should a caller's [`Collisions`] answer differently from one look to the next, the accelerator
/// refuses the index.
pub(crate) fn pack_collisions<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    channels: &mut [&mut [Beat]],
) -> (u32, bool) {
    let layout = Segment::Collisions.layout(target.variant);
    let dealer = Dealer::new(&layout, channels);
    let (quick, words) = (target.quick, entries.words);
    match target.variant.profile.geometry {
        Geometry::Absolute => {
            in_wide_vectors(Packing { quick, layout, ends, entries, dealer, kind: Absolute })
        }
        Geometry::Relative => {
            let kind = Relative { words };
            in_wide_vectors(Packing { quick, layout, ends, entries, dealer, kind })
        }
    }
}

/// All collisions of a step, and where they go.
struct Packing<'a, 'b, C: ?Sized, K, const ROWS: usize> {
    quick: Option<&'a Quick<'a>>,
    layout: Layout,
    ends: Ends<'a>,
    entries: &'a Entries<'a, C>,
    dealer: Dealer<'a, 'b>,
    kind: K,
}

impl<C: Collisions + ?Sized, K: Kind<ROWS>, const ROWS: usize> Work
    for Packing<'_, '_, C, K, ROWS>
{
    type Output = (u32, bool);

    #[inline(always)]
    fn run(self) -> (u32, bool) {
        let Self { quick, layout, ends, entries, mut dealer, kind } = self;
        let Entries { collisions, count, scheduled, .. } = *entries;
        let mut stage = Stage::new(&layout);
        let mut copies = [NOTHING; BLOCK];
        let mut good = true;
        for first in (0..count).step_by(BLOCK) {
            let mut block = [&NOTHING; BLOCK];
            let block = &mut block[..(count - first).min(BLOCK)];
            for (index, (to, copy)) in (first..).zip(block.iter_mut().zip(&mut copies)) {
                *to = collisions.structure(index).unwrap_or_else(|| {
                    *copy = collisions.collision(index);
                    copy
                });
                ends.soon([to.body_a, to.body_b]);
            }
            // They may lie anywhere: on their way while those before them are dealt with.
            let ahead = |index: usize| {
                if index + BLOCK < count {
                    collisions.soon(index + BLOCK);
                }
            };
            let block = Block { first, collisions: block, ends, scheduled, heads: true };
            good &= pack_block(&kind, quick, block, (&mut stage, &mut dealer), ahead);
        }
        (dealer.finish(), good)
    }
}

/// Encodes, looks at and deals out a block of collisions; whether validation refuses none. `each` is
/// told the index of each on the way.
#[inline(always)]
pub(super) fn pack_block<K: Kind<ROWS>, const ROWS: usize>(
    kind: &K,
    quick: Option<&Quick<'_>>,
    mut block: Block<'_>,
    (stage, dealer): (&mut Stage<ROWS>, &mut Dealer<'_, '_>),
    each: impl Fn(usize),
) -> bool {
    let Block { first, collisions, ends, scheduled, .. } = block;
    let records = stage.records(collisions.len());
    let from = (first..).zip(collisions);
    let ends = |from: &Collision| [from.body_a, from.body_b].map(|body| ends.get(body));
    let mut good = true;
    if let Some(quick) = quick {
        for (to, (index, from)) in records.iter_mut().zip(from) {
            each(index);
            let ends = ends(from);
            block.heads &= head(from, ends, scheduled);
            *to = kind.encode(index, from, ends);
        }
        good = K::look(quick, &block, records);
    } else {
        for (to, (index, from)) in records.iter_mut().zip(from) {
            each(index);
            *to = kind.encode(index, from, ends(from));
        }
    }
    stage.deal(collisions.len(), &K::INTEGERS, dealer);
    good
}

/// What a block of collisions holds before it is read.
pub(crate) const NOTHING: Collision = Collision {
    body_a: 0,
    body_b: 0,
    normal: [0.0; 3],
    count: 0,
    contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
};
