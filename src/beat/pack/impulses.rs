//! Writes the collision segments of the warm passes for the channel that carries impulses. A segment
//! repeats, issue by issue, the collision beats of the channel, and adds a beat of impulses to each
//! issue.
//!
//! The other channels have the same beats in every pass.

use std::ops::Range;
use std::slice::ChunksExactMut;

use pgs_interface::profile::Variant;
use pgs_interface::record::{Beat, LANES, collision};

use super::encode::Encoding;
use super::pool::{PackPool, Stretch as _, ranges};
use crate::beat::format::{Beats, Format, Join, Records as _, in_format};
use crate::beat::stripe::BLOCK;
use crate::beat::stripe::Segment;
use crate::record::body_table::{Ends, Lookup as _};
use crate::record::source::Contiguous;
use crate::record::{Row, Rows};
use crate::scene::{Collision, Collisions, Impulses};
use crate::simd::{Lanes, Vectors, Work, in_wide_vectors};
use crate::validate::{Block, largest_impulse};

/// The segments of both warm passes on the channel that carries impulses. A kind without iterations
/// has no warm pass and an empty segment.
#[derive(Debug, Default)]
pub(crate) struct WarmSegments<'a> {
    pub(crate) contact: &'a mut [Beat],
    pub(crate) friction: &'a mut [Beat],
}

/// What was written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct WarmSums {
    /// Sum of the words of the impulses in the contact pass, modulo 2^32.
    pub(crate) contact: u32,
    /// In the friction pass.
    pub(crate) friction: u32,
    /// Sum of the words of the collisions' records in any other pass.
    pub(crate) records: u32,
    /// Whether an impulse was not a number, or beyond the range of the bitstream.
    pub(crate) broken: bool,
}

impl WarmSums {
    /// The sums of two parts.
    fn and(self, other: Self) -> Self {
        Self {
            contact: self.contact.wrapping_add(other.contact),
            friction: self.friction.wrapping_add(other.friction),
            records: self.records.wrapping_add(other.records),
            broken: self.broken | other.broken,
        }
    }
}

/// Writes the collisions of both warm passes. The records of the other passes are written already: the
/// sum of the words tells whether the caller's collisions are still the same.
///
/// Shape: the layout of [`Segment::WarmCollisions`] gives the number of beats of a segment on this channel.
pub(crate) fn pack_warm<C: Collisions + ?Sized>(
    variant: &Variant,
    channel: usize,
    ends: Ends<'_>,
    (collisions, count): (&C, usize),
    segments: WarmSegments<'_>,
    packers: &mut PackPool,
) -> WarmSums {
    let layout = Segment::WarmCollisions.layout(variant);
    let issue = Issue::of(variant, channel);
    let mut sums = WarmSums::default();
    let WarmSegments { mut contact, mut friction } = segments;
    let cut = |size| {
        let beats = layout.beats_on_channel(size, channel);
        ranges(count, size).map(move |range| {
            // A segment without beats stays empty.
            let (of_contact, behind) = std::mem::take(&mut contact).parted(beats);
            let (of_friction, others) = std::mem::take(&mut friction).parted(beats);
            (contact, friction) = (behind, others);
            (range, WarmSegments { contact: of_contact, friction: of_friction })
        })
    };
    let work = |part: (Range<usize>, WarmSegments<'_>)| pack_range(&issue, ends, collisions, part);
    packers.each(count, cut, work, |of_range| sums = sums.and(of_range));
    sums
}

/// Beats of the collisions of an issue, at most.
const BEATS_MAX: usize = 8;

/// The beats of an issue on the channel that carries impulses: its collision beats, then a beat of
/// impulses.
struct Issue<'a> {
    variant: &'a Variant,
    /// Collisions of an issue.
    together: usize,
    /// The collision beats of this channel: their numbers among all collision beats of the issue.
    places: [usize; BEATS_MAX],
    /// Number of collision beats on this channel.
    count: usize,
}

impl<'a> Issue<'a> {
    fn of(variant: &'a Variant, channel: usize) -> Self {
        let layout = Segment::WarmCollisions.layout(variant);
        let together = variant.profile.collisions_per_issue as usize;
        let beats = together * collision::ROWS / layout.rows_per_beat();
        let mut places = [0; BEATS_MAX];
        let on_channel = (0..beats).filter(|beat| layout.place(*beat).channel == channel);
        let count = places.iter_mut().zip(on_channel).map(|(to, beat)| *to = beat).count();
        const _: () = assert!(collision::WARM_ROWS == collision::ROWS + 1);
        Self { variant, together, places, count }
    }
}

/// Writes a range of the collisions, otherwise as [`pack_warm`].
fn pack_range<C: Collisions + ?Sized>(
    issue: &Issue<'_>,
    ends: Ends<'_>,
    collisions: &C,
    (range, segments): (Range<usize>, WarmSegments<'_>),
) -> WarmSums {
    let limit = largest_impulse(&issue.variant.numbers);
    let mut contact = segments.contact.chunks_exact_mut(issue.count + 1);
    let mut friction = segments.friction.chunks_exact_mut(issue.count + 1);
    let mut sums = WarmSums::default();
    let mut copies = [Collision::NOTHING; BLOCK];
    let mut impulses = [Impulses::ZERO; BLOCK];
    for first in range.clone().step_by(BLOCK) {
        let (behind, end) = (range.end.min(first + BLOCK), range.end.min(first + 2 * BLOCK));
        // The next block is on its way while this one is written.
        (behind..end).for_each(|index| collisions.prefetch(index));
        let (copies, impulses) = (&mut copies[..behind - first], &mut impulses[..behind - first]);
        for ((copy, impulses), index) in copies.iter_mut().zip(&mut *impulses).zip(first..) {
            *copy = collisions.collision(index);
            *impulses = collisions.impulses(index).used(copy);
            sums.broken |= !impulses.are_within(limit);
            ends.soon([copy.body_a, copy.body_b]);
        }
        let block = Block { first, collisions: Contiguous(copies), ends };
        let to = [&mut contact, &mut friction];
        sums = sums.and(in_wide_vectors(Writing { issue, block, impulses, to }));
    }
    sums
}

/// A block of collisions with their impulses, and its place in both segments.
struct Writing<'p, 'a> {
    issue: &'p Issue<'p>,
    block: Block<'p, Contiguous<'p>>,
    impulses: &'p [Impulses],
    to: [&'p mut ChunksExactMut<'a, Beat>; 2],
}

impl Work for Writing<'_, '_> {
    type Output = WarmSums;

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> WarmSums {
        let format = self.issue.variant.numbers.collisions;
        in_format!(format, F => self.run_as::<V, F>(vectors))
    }
}

/// The impulses of one kind, as a row.
type OfKind = fn(&Impulses) -> [f32; LANES];

impl Writing<'_, '_> {
    #[inline(always)]
    fn run_as<V: Vectors, F: Format>(self, vectors: V) -> WarmSums {
        let Self { issue, block, impulses, to: [contact, friction] } = self;
        let mut sums = WarmSums::default();
        let Some(ends) = F::Among::of(block.ends) else {
            return WarmSums { broken: true, ..sums };
        };
        let mut records = Encoding::<_, _, _, false>::new(&block, ends, ());
        for first in (0..impulses.len()).step_by(issue.together) {
            let of_issue = first..first + issue.together;
            let mut usual = Made::<V, F>::new(vectors);
            for nth in of_issue.clone() {
                if records.some::<1>(nth, &mut usual).is_none() {
                    // Padding fills the issue up.
                    usual.zeros(collision::ROWS);
                }
            }
            sums.records = sums.records.wrapping_add(usual.sum);
            let normal = |of: &Impulses| of.normal;
            let tangential = |of: &Impulses| [of.friction[0], of.friction[1], 0.0, 0.0];
            let kinds = [
                (contact.next(), normal as OfKind, &mut sums.contact),
                (friction.next(), tangential, &mut sums.friction),
            ];
            for (to, of, sum) in kinds {
                let Some((last, others)) = to.and_then(|to| to.split_last_mut()) else { continue };
                for (to, place) in others.iter_mut().zip(issue.places) {
                    *to = usual.beats[place];
                }
                let mut behind = Made::<V, F>::new(vectors);
                for nth in of_issue.clone() {
                    let words =
                        impulses.get(nth).map_or([0; LANES], |all| of(all).map(f32::to_bits));
                    behind.row(Row { numbers: Lanes::new(words), integer: None });
                }
                *last = behind.beats[0];
                *sum = sum.wrapping_add(behind.sum);
            }
        }
        sums
    }
}

/// The beats of rows.
struct Made<V, F> {
    joined: Beats<V, F>,
    beats: [Beat; BEATS_MAX],
    count: usize,
    /// Sum of the words.
    sum: u32,
}

impl<V: Vectors, F: Join> Made<V, F> {
    #[inline(always)]
    fn new(vectors: V) -> Self {
        let beats = [Beat::default(); BEATS_MAX];
        Self { joined: Beats::new(vectors), beats, count: 0, sum: 0 }
    }

    /// Adds rows of zeros.
    #[inline(always)]
    fn zeros(&mut self, rows: usize) {
        (0..rows).for_each(|_| self.row(Row::zero()));
    }
}

impl<V: Vectors, F: Join> Rows for Made<V, F> {
    #[inline(always)]
    fn row(&mut self, row: Row) {
        let Some(beat) = self.joined.with(row) else { return };
        self.sum = beat.0.into_iter().fold(self.sum, u32::wrapping_add);
        if let Some(to) = self.beats.get_mut(self.count) {
            *to = beat;
            self.count += 1;
        }
    }
}
