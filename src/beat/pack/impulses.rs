//! Writes the collision segments of the warm passes into the buffer of the channel that carries
//! impulses: behind the beats that a collision has there in every pass, a beat of its impulses.
//!
//! The other channels have the same beats in every pass.

use pgs_interface::record::{Beat, collision};

use crate::beat::stripe::Layout;
use crate::record::body_table::{Ends, Lookup as _};
use crate::record::{self, Counted};
use crate::scene::{Collisions, Impulses};

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

/// Writes the collisions of both warm passes, one after the other on the caller's thread. The records
/// of the other passes are written already: the sum of the words tells whether the caller's collisions
/// are still the same.
///
/// Shape: a segment has `layout.beats_on_channel(collisions.len(), channel)` beats. Collisions are
/// records in world coordinates and f32, a row a beat.
pub(crate) fn pack_warm<C: Collisions + ?Sized>(
    layout: &Layout,
    channel: usize,
    ends: Ends<'_>,
    (collisions, count): (&C, usize),
    segments: WarmSegments<'_>,
) -> WarmSums {
    let mut sums = WarmSums::default();
    let mut rows = [0; collision::ROWS];
    let mut beats = 1;
    for row in layout.rows_on(channel).filter(|row| *row < collision::ROWS) {
        rows[beats - 1] = row;
        beats += 1;
    }
    let rows = &rows[..beats - 1];
    let WarmSegments { contact, friction } = segments;
    let (mut contact, mut friction) =
        (contact.chunks_exact_mut(beats), friction.chunks_exact_mut(beats));
    for index in 0..count {
        let of = collisions.collision(index);
        let impulses = collisions.impulses(index).used(&of);
        sums.broken |= !impulses.are_finite();
        let counted = Counted::from(&of);
        let bodies = [counted.collision.body_a, counted.collision.body_b];
        let whole = record::collision::encode(counted, bodies.map(|body| ends.get(body))).whole();
        for row in whole {
            sums.records = row.words().into_iter().fold(sums.records, u32::wrapping_add);
        }
        let Impulses { normal, friction: [first, second] } = impulses;
        let kinds = [
            (contact.next(), normal, &mut sums.contact),
            (friction.next(), [first, second, 0.0, 0.0], &mut sums.friction),
        ];
        for (to, impulses, sum) in kinds {
            let Some((last, others)) = to.and_then(|to| to.split_last_mut()) else { continue };
            for (to, row) in others.iter_mut().zip(rows) {
                *to = Beat(whole[*row].words());
            }
            *last = Beat(impulses.map(f32::to_bits));
            *sum = last.0.into_iter().fold(*sum, u32::wrapping_add);
        }
    }
    sums
}
