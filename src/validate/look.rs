//! Screens the collisions of a block, one by one, while their records are made.

use pgs_interface::number::StreamFormat;

use super::quick::{Block, OFF_UNIT, Quick};
use super::reach::{Furthest, Locations, Reach};
use crate::record::body_table::{End, Lookup};
use crate::record::source::CollisionSource;
use crate::record::{Counted, FULL, alone, body_words, normal_and_count};
use crate::simd::Lanes;

/// Bits that are zero in every valid count less one.
const BEYOND_COUNTS: u32 = !(FULL - 1);
const _: () = assert!(FULL.is_power_of_two());

/// Bounds on the square of a normal's length, as bits.
const SHORTEST: u32 = (1.0 - OFF_UNIT).to_bits();
const LONGEST: u32 = (1.0 + OFF_UNIT).to_bits();

// A normal within these bounds has no number beyond a stream's range.
const _: () = assert!(1.0 + OFF_UNIT < StreamFormat::Binary16.largest());
const _: () = assert!(1.0 + OFF_UNIT < StreamFormat::Binary16.largest());

/// A word in the last lane.
#[inline(always)]
fn in_last(word: u32) -> Lanes {
    Lanes::new([0, 0, 0, word])
}

/// Findings about the collisions of a block.
///
/// Bits accumulate, and the verdict comes at the end. `REACHES` says whether lever arms are
/// bounded, too.
#[derive(Clone, Copy)]
pub(crate) struct Look<const REACHES: bool> {
    /// The top bit where both bodies are the same.
    alike: u32,
    /// Bits of the indices of bodies A and B, in the first two words.
    named: Lanes,
    /// Bits of the counts less one, in the last word.
    counts: Lanes,
    /// Bits of the tags of all ends.
    tags: Lanes,
    /// The top bit of the last word if both bodies are static or the length of a normal is wrong.
    wrong: Lanes,
    /// The top bits where a number may be beyond what the stream holds.
    beyond: Lanes,
    /// The largest number that the stream holds.
    limit: Lanes,
    furthest: Furthest,
}

impl<const REACHES: bool> Look<REACHES> {
    /// No collision yet.
    #[inline(always)]
    pub(crate) fn new(quick: &Quick<'_>) -> Self {
        let none = Lanes::all(0);
        Self {
            alike: 0,
            named: none,
            counts: none,
            tags: none,
            wrong: none,
            beyond: none,
            limit: Lanes::all(quick.limit_of_collisions().to_bits()),
            furthest: Furthest::new(),
        }
    }

    /// Takes the next collision. `ends` are the ends of its bodies, as looked up; its record may be
    /// made from others. `locations` are the locations in the record.
    #[inline(always)]
    pub(crate) fn take(&mut self, of: Counted<'_>, ends: [&End; 2], locations: &Locations) {
        let collision = of.collision;
        // The top bit stays clear, unless the indices are the same or one of them is far out of
        // range.
        self.alike |= (collision.body_a ^ collision.body_b).wrapping_sub(1);
        self.named = self.named.or(body_words(collision));
        let normal = normal_and_count(collision);
        self.counts = self.counts.or(normal.plus(in_last(u32::MAX)));
        let [a, b] = ends.map(End::with_tag);
        self.tags = self.tags.or(a).or(b);
        // `alone` removes the count: as an f32 it is subnormal, and its product is slow.
        let normal = alone(normal);
        let square = normal.times_f32(normal).sum_f32();
        // The bits of positive f32 order like the numbers: a difference is negative if the square
        // is beyond a bound.
        let off = square.minus(in_last(SHORTEST)).or(in_last(LONGEST).minus(square));
        self.wrong = self.wrong.or(off).or(a.and(b));
        // A NaN may have either sign, so the bits of the sum are taken, too.
        self.beyond = self.beyond.or(self.limit.minus(locations.sum)).or(locations.sum);
        if const { REACHES } {
            let [a, b] = ends;
            let reach = Reach::new(locations, of.count());
            self.furthest.take(&reach, [a.still(), b.still()]);
        }
    }

    /// Whether validation accepts every collision of the block, and how many are padding. The look
    /// has taken all of them at these `locations`, with their bodies looked up in `ends`, and has
    /// taken [`Collision::NOTHING`] for padding.
    #[inline(always)]
    pub(crate) fn good<'b, L: CollisionSource<'b>, E: Lookup<'b>>(
        self,
        quick: &Quick<'_>,
        block: &Block<'b, L>,
        ends: E,
        locations: impl Iterator<Item = Locations>,
    ) -> (bool, usize) {
        let [a, b, ..] = self.named.words();
        let [[.., counts], [.., wrong]] = [self.counts, self.wrong].map(Lanes::words);
        let mut good = ends.by_all_bits([a, b])
            & (self.alike >> 31 == 0)
            & (counts & BEYOND_COUNTS == 0)
            & !End::any_shapeless(self.tags)
            & (wrong >> 31 == 0);
        let mut paddings = 0;
        if !good {
            // Padding counts as wrong above.
            (good, paddings) = quick.heads(block);
        }
        good = good && self.beyond.words().iter().all(|word| word >> 31 == 0);
        if let Some(bounds) = quick.bounds_of_rows() {
            // Each collision is checked by itself if the common bound fails or a shape of the table
            // rules it out.
            good = good
                && (REACHES && self.furthest.all_surely_fit(bounds)
                    || quick.rows_fit(block, locations));
        }
        (good || quick.exactly(block), paddings)
    }
}
