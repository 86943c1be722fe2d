//! Writes the collision segments of a step into the channels' buffers.
//!
//! The method is the one of [`bodies`](super::bodies): threads take ranges, each range goes block
//! by block, and the packer writes each beat once, upwards, and never reads it back.

use pgs_interface::number::StreamFormat;
use std::ops::Range;

use pgs_interface::record::{Beat, collision};

use super::encode::{Encoding, most_are_full};
use super::pool::{ChannelChunks, PackPool, Piece, ranges, whole};
use super::stripe_writer::{CHECKED, MANY, StripeWriter};
use super::target::Target;
use crate::beat::format::{Format, in_format};
use crate::beat::stripe::BLOCK;
use crate::beat::stripe::Segment;
use crate::record::body_table::{Ends, Lookup as _};
use crate::record::source::{CollisionSource, Contiguous, InNearbyOrder, Indexed};
use crate::scene::{Collision, Collisions, Structures};
use crate::simd::{Vectors, Work, in_wide_vectors};
use crate::validate::{Block, Look, Quick};

/// The collisions of a step, as they are sent.
#[derive(Debug)]
pub(crate) struct Entries<'a, C: ?Sized> {
    pub(crate) collisions: &'a C,
    /// Number of records, with the entries that an order added.
    pub(crate) count: usize,
    /// Number of entries that the order added; `None` without an order.
    pub(crate) added: Option<usize>,
}

/// Writes the records of collisions; the sum of the words written, modulo 2^32, whether validation
/// accepts all of them, and how many are padding. A collision without contact points is written as
/// padding.
///
/// A body that does not exist has a position of zeros, and a body without a shape is static. Where
/// indices are sent in sixteen bits, their lower halves count. If sixteen bits do not name all
/// bodies, the packer writes nothing and refuses every collision.
///
/// A caller's [`Collisions`] may answer differently from one read to the next. The check applies to
/// the collisions as written. With an order, the number of paddings must be the number of entries
/// that the order added: it has left out the caller's collisions without contact points.
pub(crate) fn pack_collisions<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    channels: &mut [&mut [Beat]],
    packers: &mut PackPool,
) -> (u32, Seen) {
    let layout = Segment::Collisions.layout(target.variant);
    let (mut sum, mut seen) = (0_u32, Seen::NOTHING);
    let channels = whole(channels);
    let cut = |size| {
        let mut pieces = ChannelChunks::new(&layout, size, channels);
        ranges(entries.count, size).map(move |range| (range, pieces.cut()))
    };
    let work = |part: (Range<usize>, Piece<'_>)| pack_range(target, ends, entries, part);
    packers.each(entries.count, cut, work, |(of_range, also): (u32, Seen)| {
        sum = sum.wrapping_add(of_range);
        seen = seen.and(also);
    });
    let as_many =
        target.quick.is_none() || entries.added.is_none_or(|added| added == seen.paddings);
    seen.good &= as_many;
    (sum, seen)
}

/// The result of the checks of collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Seen {
    /// Whether validation accepts all of them.
    pub(crate) good: bool,
    /// The number of paddings; 0 without checks.
    pub(crate) paddings: usize,
}

impl Seen {
    /// The result for no collisions.
    const NOTHING: Self = Self { good: true, paddings: 0 };

    /// The result for collisions that are not written: the stream's indices do not name all bodies,
    /// or no survey of the bodies has run.
    const REFUSED: Self = Self { good: false, paddings: 0 };

    fn and(self, other: Self) -> Self {
        Self { good: self.good & other.good, paddings: self.paddings + other.paddings }
    }
}

/// Writes the records of a range of collisions, otherwise as [`pack_collisions`].
///
/// Only this function depends on the caller's container: it finds where the collisions lie. It
/// copies them one by one if they do not lie in memory as structures, or if the number of
/// structures is not `count`.
fn pack_range<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    (range, mut channels): (Range<usize>, Piece<'_>),
) -> (u32, Seen) {
    let Entries { collisions, count, .. } = *entries;
    let mut packer = CollisionPacker::new(target, ends, range.start, &mut channels);
    let seen = match collisions.structures().filter(|all| all.len() == count) {
        Some(Structures::Array(all)) => packer.write(Contiguous(all).part(range)),
        Some(Structures::Ordered { all, order }) => {
            let order = Indexed::new(all, order).part(range.clone());
            match order.nearby(range.start) {
                Some(order) => packer.write_nearby(order),
                None => packer.write_ordered(order),
            }
        }
        None => {
            let mut copies = [Collision::NOTHING; BLOCK];
            let blocks =
                range.clone().step_by(BLOCK).map(|first| first..range.end.min(first + BLOCK));
            blocks.fold(Seen::NOTHING, |seen, block| {
                let copies = &mut copies[..block.len()];
                // Prefetches the whole block before the first collision is copied.
                block.clone().for_each(|index| collisions.prefetch(index));
                for (to, index) in copies.iter_mut().zip(block) {
                    *to = collisions.collision(index);
                    ends.soon([to.body_a, to.body_b]);
                }
                seen.and(packer.write(Contiguous(copies)))
            })
        }
    };
    (packer.finish(), seen)
}

/// Writes collisions that lie in memory.
///
/// It is independent of the caller's container, so that it is compiled once, with the driver.
pub(crate) struct CollisionPacker<'a, 'b> {
    quick: Option<&'a Quick<'a>>,
    ends: Ends<'a>,
    dealer: StripeWriter<'a, 'b>,
    /// The index of the next collision.
    next: usize,
    /// Whether most collisions are expected to have all contact points. The block written last
    /// decides; the first block expects it.
    most_full: bool,
}

impl<'a, 'b> CollisionPacker<'a, 'b> {
    /// Begins with collision `first`, which begins a group.
    ///
    /// Shape: each channel is as long as
    /// [`Layout::beats_on_channel`](crate::beat::stripe::Layout::beats_on_channel) says for the
    /// collisions that are written.
    pub(crate) fn new(
        target: Target<'a>,
        ends: Ends<'a>,
        first: usize,
        channels: &'a mut [&'b mut [Beat]],
    ) -> Self {
        let layout = Segment::Collisions.layout(target.variant);
        let dealer = StripeWriter::new(&layout, channels);
        Self { quick: target.quick, ends, dealer, next: first, most_full: true }
    }

    /// As before, but few of the first collisions are expected to have all contact points.
    #[cfg(test)]
    pub(crate) const fn expecting_few_full(mut self) -> Self {
        self.most_full = false;
        self
    }

    /// Writes the next collisions. Their number is divisible by [`BLOCK`], except for the last ones.
    pub(crate) fn write(&mut self, collisions: Contiguous<'_>) -> Seen {
        self.write_lying(collisions)
    }

    /// As [`Self::write`], for collisions in any order.
    fn write_ordered(&mut self, collisions: Indexed<'_>) -> Seen {
        self.write_lying(collisions)
    }

    /// As [`Self::write`], for collisions in an order that is close to the order in memory.
    fn write_nearby(&mut self, collisions: InNearbyOrder<'_>) -> Seen {
        self.write_lying(collisions)
    }

    #[inline(always)]
    fn write_lying<'p, L: CollisionSource<'p>>(&'p mut self, collisions: L) -> Seen {
        let Self { quick, ends, dealer, next, most_full } = self;
        let (quick, first) = (*quick, *next);
        *next += collisions.len();
        let all = Block { first, collisions, ends: *ends };
        in_wide_vectors(Writing { quick, all, dealer, most_full })
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(crate) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// Collisions, and the writer that they go to.
struct Writing<'p, 'a, 'b, L> {
    quick: Option<&'p Quick<'p>>,
    all: Block<'p, L>,
    dealer: &'p mut StripeWriter<'a, 'b>,
    most_full: &'p mut bool,
}

impl<'p, L: CollisionSource<'p>> Work for Writing<'p, '_, '_, L> {
    type Output = Seen;

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> Seen {
        in_format!(self.dealer.format(), F => self.run_as::<V, F>(vectors))
    }
}

impl<'p, L: CollisionSource<'p>> Writing<'p, '_, '_, L> {
    /// Whether a loop with checks branches around the masks where all contact points are used. In
    /// loops of f32, and in loops without checks, the branch costs as much as the masks.
    const fn jumps<F: Format>() -> bool {
        matches!(F::WORDS, StreamFormat::Binary16)
    }

    /// Encodes, checks and writes the collisions block by block, and prefetches later ones
    /// meanwhile.
    #[inline(always)]
    fn run_as<V: Vectors, F: Format>(self, vectors: V) -> Seen {
        let Self { quick, all, dealer, most_full } = self;
        let Some(ends) = F::Among::of(all.ends) else {
            return Seen::REFUSED;
        };
        let mut seen = Seen::NOTHING;
        // Validation goes by blocks. Packing without validation, as a benchmark measures it, gains
        // nothing from small blocks.
        let size = if quick.is_some() { CHECKED } else { MANY };
        for at in (0..all.collisions.len()).step_by(size) {
            let collisions = all.collisions.part(at..at + size);
            let block = Block { first: all.first + at, collisions, ..all };
            // A loop for each kind of check, so that no loop tests for it.
            macro_rules! written {
                ($witness:expr, $most_full:literal) => {{
                    let mut records = Encoding::<_, _, _, $most_full>::new(&block, ends, $witness);
                    dealer.write_as::<V, F, _, { collision::ROWS }>(vectors, &mut records);
                    records
                }};
            }
            macro_rules! looked_at {
                ($quick:ident, $reaches:literal) => {{
                    let look = Look::<$reaches>::new($quick);
                    if const { Self::jumps::<F>() } && *most_full {
                        written!(look, true).good($quick, &block)
                    } else {
                        written!(look, false).good($quick, &block)
                    }
                }};
            }
            let (good, paddings) = match quick {
                None => {
                    written!((), false);
                    continue;
                }
                Some(quick) if quick.asks_how_far() => looked_at!(quick, true),
                Some(quick) => looked_at!(quick, false),
            };
            // This block predicts the next one, which is in no cache yet.
            if const { Self::jumps::<F>() } {
                *most_full = most_are_full(collisions);
            }
            seen = seen.and(Seen { good, paddings });
        }
        seen
    }
}
