//! Writes the collision segments of the warm passes into the buffer of the channel that carries
//! impulses: behind the beats that a collision has there in every pass, a beat of its impulses.
//!
//! The other channels have the same beats in every pass.

use std::ops::Range;

use pgs_interface::record::{Beat, collision};

use super::pool::{PackPool, Stretch as _, ranges};
use super::stripe_writer::BLOCK;
use crate::beat::stripe::Layout;
use crate::record::body_table::{Ends, Lookup as _};
use crate::record::{self, Counted};
use crate::scene::{Collision, Collisions, Impulses};

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
    /// Whether an impulse was not a number.
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
/// Shape: a segment has `layout.beats_on_channel(collisions.len(), channel)` beats. Collisions are
/// records in world coordinates and f32, a row a beat.
pub(crate) fn pack_warm<C: Collisions + ?Sized>(
    layout: &Layout,
    channel: usize,
    ends: Ends<'_>,
    (collisions, count): (&C, usize),
    segments: WarmSegments<'_>,
    packers: &mut PackPool,
) -> WarmSums {
    let rows = ChannelRows::of(layout, channel);
    let mut sums = WarmSums::default();
    let beats = rows.beats();
    let WarmSegments { mut contact, mut friction } = segments;
    let cut = |size| {
        ranges(count, size).map(move |range| {
            // A segment without beats stays empty.
            let (of_contact, behind) = std::mem::take(&mut contact).parted(size * beats);
            let (of_friction, others) = std::mem::take(&mut friction).parted(size * beats);
            (contact, friction) = (behind, others);
            (range, WarmSegments { contact: of_contact, friction: of_friction })
        })
    };
    let work = |part: (Range<usize>, WarmSegments<'_>)| pack_range(&rows, ends, collisions, part);
    packers.each(count, cut, work, |of_range| sums = sums.and(of_range));
    sums
}

/// The rows of a collision's record that a channel carries; behind them it carries the impulses.
struct ChannelRows {
    rows: [usize; collision::ROWS],
    count: usize,
}

impl ChannelRows {
    fn of(layout: &Layout, channel: usize) -> Self {
        let mut found = Self { rows: [0; collision::ROWS], count: 0 };
        for row in layout.rows_on(channel).filter(|row| *row < collision::ROWS) {
            found.rows[found.count] = row;
            found.count += 1;
        }
        found
    }

    fn rows(&self) -> &[usize] {
        &self.rows[..self.count]
    }

    /// Beats of a collision on the channel in a warm pass.
    fn beats(&self) -> usize {
        self.count + 1
    }
}

/// Writes a range of the collisions, otherwise as [`pack_warm`].
fn pack_range<C: Collisions + ?Sized>(
    rows: &ChannelRows,
    ends: Ends<'_>,
    collisions: &C,
    (range, segments): (Range<usize>, WarmSegments<'_>),
) -> WarmSums {
    let beats = rows.beats();
    let mut contact = segments.contact.chunks_exact_mut(beats);
    let mut friction = segments.friction.chunks_exact_mut(beats);
    let mut sums = WarmSums::default();
    let mut records = [0_u32; 4];
    let mut copies = [Collision::NOTHING; BLOCK];
    for first in range.clone().step_by(BLOCK) {
        let (behind, end) = (range.end.min(first + BLOCK), range.end.min(first + 2 * BLOCK));
        // The next block is on its way while this one is written.
        (behind..end).for_each(|index| collisions.prefetch(index));
        let copies = &mut copies[..behind - first];
        for (copy, index) in copies.iter_mut().zip(first..) {
            *copy = collisions.collision(index);
            ends.soon([copy.body_a, copy.body_b]);
        }
        for (copy, index) in copies.iter().zip(first..) {
            let impulses = collisions.impulses(index).used(copy);
            sums.broken |= !impulses.are_finite();
            let counted = Counted::from(copy);
            let bodies = [counted.collision.body_a, counted.collision.body_b];
            let at = bodies.map(|body| ends.get(body));
            let whole = record::collision::encode(counted, at).whole();
            for row in whole {
                for (sum, word) in records.iter_mut().zip(row.words()) {
                    *sum = sum.wrapping_add(word);
                }
            }
            let Impulses { normal, friction: [first, second] } = impulses;
            let kinds = [
                (contact.next(), normal, &mut sums.contact),
                (friction.next(), [first, second, 0.0, 0.0], &mut sums.friction),
            ];
            for (to, impulses, sum) in kinds {
                let Some((last, others)) = to.and_then(|to| to.split_last_mut()) else { continue };
                for (to, row) in others.iter_mut().zip(rows.rows()) {
                    *to = Beat(whole[*row].words());
                }
                *last = Beat(impulses.map(f32::to_bits));
                *sum = last.0.into_iter().fold(*sum, u32::wrapping_add);
            }
        }
    }
    sums.records = records.into_iter().fold(0, u32::wrapping_add);
    sums
}
